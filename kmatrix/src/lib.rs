//! Stereological kernels: how often a random section shows a particle of each size as a profile of each size.
mod distribution;
mod ellipsoid;
mod kernel;
mod saltikov;
mod section_law;

pub use kernel::{Counting, EdgesError, Sizes};
pub use saltikov::{BinCountError, SphereKernel, profiles_per_area, scale};
pub use section_law::{LengthError, SectionLaw};
