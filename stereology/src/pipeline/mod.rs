//! The chain from a photograph to its solid: what composes the rooms.
//!
//! [`synthesize`] is the whole chain; its steps can be called alone: [`measured_profiles`], [`particle_densities`], [`population`], [`fine_details`], [`verify`], [`residual_spectra`].

mod association;
mod colouring;
mod densities;
mod fine_details;
mod fitting;
mod groups;
mod particle_types;
mod population;
mod residual_spectra;
mod section_model;
mod size_classes;
mod synthesis;
mod verification;
mod warning;
mod wasserstein;

pub use association::{Association, SIGNIFICANT, association};
pub use colouring::particle_colours;
pub use densities::{
    DensityError, DensityOptions, MeasuredProfiles, ParticleDensities, UnfoldingBins, particle_densities,
};
pub use fine_details::{FineDetails, fine_details};
pub use groups::{CategoryDensities, category_densities, type_densities};
pub use particle_types::{ParticleType, ParticleTypes, ParticleTypesError};
pub use population::{Extent, Population, PopulationFailure, population};
pub use residual_spectra::{ResidualSpectra, SpectraError, residual_spectra};
pub use section_model::{Capping, LargestSize, capping_angle, largest_particle, type_shares};
pub use size_classes::{Spacing, size_edges};
pub use synthesis::{Step, Synthesis, SynthesisError, SynthesisOptions, measured_profiles, synthesize};
pub use verification::{Comparison, Recipe, Verification, VerificationError, verify};
pub use warning::Warning;
pub use wasserstein::wasserstein;
