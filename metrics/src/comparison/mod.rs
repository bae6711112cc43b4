//! The slices of a solid compared with an exemplar by every measure.

mod compare;
mod error;
mod figures;
mod options;
mod statistics;

pub use compare::{check_images, compare};
pub use error::MeasureError;
pub use figures::{Comparison, Curves, Figure};
pub use options::{FringeBand, FringeFilter, MeasureOptions};
