//! Profiles as they were measured on sections, and why they cannot be unfolded.

use crate::pipeline::ParticleTypesError;
use stereology_unfold::{ProfilesError, UnfoldError, smallest_size};

/// Profiles measured on sections: one entry per profile in each list.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeasuredProfiles {
    /// Equivalent circular diameters; lengths.
    pub sizes: Vec<f64>,
    /// Weight of each profile in the counts: 0 outside the counting frame.
    pub weights: Vec<f64>,
    /// Colour categories, from 0.
    pub categories: Vec<u8>,
    /// Mean colour of each category, encoded values / 255; empty if it is not known.
    pub colours: Vec<[f64; 3]>,
    /// Index of the slice of each profile, from 0; empty for one slice, or if the slices are not known.
    pub slices: Vec<usize>,
    /// Position of each profile on its slice; empty if the positions are not known.
    pub positions: Vec<[f64; 2]>,
    /// Index of the particle type of each profile, from 0; empty if the types are not known.
    pub types: Vec<usize>,
    /// Area examined; length squared.
    pub area: f64,
    /// Detection limit: profiles up to this size are not observed.
    pub min_size: f64,
    /// Relative standard deviation of the errors of the sizes; 0: none.
    pub size_error: f64,
}

impl MeasuredProfiles {
    /// Detection limit where profiles from the size `smallest` on are kept: just below it.
    ///
    /// ```
    /// use stereology::pipeline::MeasuredProfiles;
    /// assert!(MeasuredProfiles::limit_below(2.0) < 2.0);
    /// ```
    #[must_use]
    pub fn limit_below(smallest: f64) -> f64 {
        smallest * (1.0 - 1e-9)
    }

    /// Indices of the profiles with a positive weight.
    pub(crate) fn counted(&self) -> Result<Vec<usize>, DensityError> {
        let counted: Vec<usize> = (0..self.sizes.len()).filter(|&i| self.weights[i] > 0.0).collect();
        if counted.is_empty() {
            return Err(DensityError::NoProfiles(self.sizes.len()));
        }
        Ok(counted)
    }

    /// Size of the smallest profiles with a positive weight that a fit resolves ([`smallest_size`]); infinite without
    /// one.
    pub(crate) fn smallest(&self) -> f64 {
        let sizes = self.sizes.iter().zip(&self.weights);
        let counted: Vec<f64> = sizes
            .filter(|(_, weight)| **weight > 0.0)
            .map(|(size, _)| *size)
            .collect();
        smallest_size(&counted)
    }

    /// Whether the particle type of every profile is known.
    pub(crate) fn have_types(&self) -> bool {
        !self.types.is_empty() && self.types.len() == self.sizes.len()
    }
}

/// Profiles that cannot be unfolded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DensityError {
    /// No profile has a positive weight.
    #[error(
        "no profile counts: all {0} lie outside the counting frame or touch the edge; a photograph of a larger area is needed, or another edge rule"
    )]
    NoProfiles(usize),
    /// Bins of equal ratio need sizes that differ.
    #[error(
        "bins of equal ratio need two or more bins, and sizes that differ (smallest {smallest}, largest {largest}): give both sizes, or take equal bins"
    )]
    Spacing {
        /// The smallest size.
        smallest: f64,
        /// The largest size.
        largest: f64,
    },
    /// Some profiles have a particle type and others have none.
    #[error("{types} particle types for {profiles} profiles: give the type of every profile, or of none")]
    SomeTypes {
        /// Profiles with a type.
        types: usize,
        /// All profiles.
        profiles: usize,
    },
    /// A profile has a particle type that does not exist.
    #[error("a profile has particle type {found}, but there are {types} (numbered from 0)")]
    UnknownType {
        /// Type of the profile.
        found: usize,
        /// Number of types.
        types: usize,
    },
    /// No counted profile has this particle type.
    #[error("no profile of particle type {index} ({name}) counts: leave this type out")]
    EmptyType {
        /// Index of the type.
        index: usize,
        /// Name of its shape.
        name: String,
    },
    /// The fractions of a single particle type are not unknown.
    #[error("unknown fractions need two or more particle types")]
    OneType,
    /// Profiles that cannot be counted.
    #[error(transparent)]
    Profiles(#[from] ProfilesError),
    /// Particle types that have no kernel.
    #[error(transparent)]
    Types(#[from] ParticleTypesError),
    /// Counts that cannot be unfolded.
    #[error(transparent)]
    Unfold(#[from] UnfoldError),
}
