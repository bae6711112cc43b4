//! The chain from a photograph to its solid: what composes the rooms.

mod association;
mod densities;
mod particle_types;
mod population;
mod warning;
mod wasserstein;

pub use association::{Association, SIGNIFICANT, association};
pub use densities::{DensityError, DensityOptions, MeasuredProfiles, ParticleDensities, particle_densities};
pub use particle_types::{ParticleType, ParticleTypes, ParticleTypesError};
pub use population::{Extent, Population, PopulationFailure, population};
pub use warning::Warning;
pub use wasserstein::wasserstein;
