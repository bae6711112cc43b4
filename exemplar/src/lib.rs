//! Solids from one picture, without separable particles.

mod batch;
mod domain;
mod error;
mod exemplar;
mod feature_size;
mod field;
mod level;
mod options;
mod phases;
mod principal;
mod quantiser;
mod recipe;
mod scan;
mod search;
mod sequential;
mod similar;
mod stage;
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
