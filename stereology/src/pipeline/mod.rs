//! The chain from a photograph to its solid, which combines the other crates.
//!
//! [`synthesize`] runs the whole chain. Its steps can be called separately: [`measured_profiles`], [`unfold_profiles`],
//! [`population`], [`fine_details`], [`verify`], [`residual_spectra`]. [`Verdict`] judges the result.

mod association;
mod clusters;
mod colouring;
mod densities;
mod density_options;
mod digest;
mod fine_details;
mod finish_grown;
mod finished;
mod fitting;
mod measured_profiles;
mod narrowing;
mod outline_comparison;
mod particle_types;
mod phase_geometry;
mod population;
mod residual_spectra;
mod section_model;
mod shape_table;
mod size_classes;
mod solid_comparison;
mod synthesis;
mod texture_limits;
mod unfolding_bins;
mod verdict;
mod verification;

pub use association::{Association, SIGNIFICANT, association};
pub use clusters::Clusters;
pub use colouring::{ColourSample, particle_colours};
pub use densities::{CategoryPart, ParticleDensities, unfold_profiles};
pub use density_options::{Capping, DensityOptions, LargestSize, Spacing, TypeFractions};
pub use digest::{Digest, Inputs};
pub use fine_details::{FineDetails, fine_details};
pub use finish_grown::finish_grown;
pub use finished::{Finished, FinishedPacking, FinishedTexture};
pub use fitting::Settled;
pub use measured_profiles::{DensityError, MeasuredProfiles};
pub use outline_comparison::{OutlineComparison, OutlineDistance};
pub use particle_types::{ParticleType, ParticleTypes, ParticleTypesError};
pub use phase_geometry::{PlanarPhase, SpatialPhase, planar_phases, spatial_phases};
pub use population::{Extent, Population, PopulationFailure, population};
pub use residual_spectra::{ResidualSpectra, SpectraError, residual_spectra};
pub use section_model::{LargestParticle, capping_angle, largest_particle, type_fractions};
pub use shape_table::{SHAPES, ShapeDensity, ShapeEstimates, densities_by_shape};
pub use size_classes::size_edges;
pub use solid_comparison::{CompareOptions, compare_solid};
pub use stereology_metrics::{Finding, Level, Progress};
pub use synthesis::{
    Step, Synthesis, SynthesisError, SynthesisOptions, measured_profiles, synthesize, synthesize_from,
};
pub use texture_limits::{TextureLimits, image_texture_limits, texture_limits};
pub use unfolding_bins::{SizeError, UnfoldingBins};
pub use verdict::{Check, CheckName, Evidence, Opinion, Verdict};
pub use verification::{Comparison, Recipe, Verification, VerificationError, verify};
