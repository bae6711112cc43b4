//! Solids from one picture, without separable particles.
#![allow(missing_docs, clippy::all)]
mod batch;
mod domain;
mod error;
mod exemplar;
mod field;
mod level;
mod options;
mod principal;
mod recipe;
mod scan;
mod similar;
mod synthesis;
mod tallies;
mod window;

pub use domain::{Domain, FixedVoxel};
pub use error::SolidError;
pub use exemplar::Exemplar;
pub use options::{Method, Search, SolidOptions, Solver, Views};
pub use scan::Scan;
pub use synthesis::{LevelReport, Solid, synthesize_solid};
pub mod grow;
pub mod measure;
