//! Microgeometry.
mod bounds;
mod budget;
mod contact;
mod dual;
mod error;
mod leftovers;
mod measure;
mod paper;
mod reconstruction;
mod tight;
pub use contact::{ContactDistribution, MOST_BINS};
pub use dual::{Adjacency, DualGraph, Metric};
pub use error::MicrogeometryError;
pub use measure::{distribution_of, interface_distances, violations};
pub use reconstruction::{
    Method, ReconstructOptions, Reconstruction, Shortfall, Weighting, reconstruct, to_distribution_units,
};
