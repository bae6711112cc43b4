//! Options of unfolding: size bins, largest size, capping angle, fractions of the particle types, estimator.

use stereology_kmatrix::Sizes;
use stereology_unfold::UnfoldOptions;

/// Options of [`unfold_profiles`](crate::pipeline::unfold_profiles).
#[derive(Clone, Debug, PartialEq)]
pub struct DensityOptions {
    /// Number of size bins between 0 and the largest size; 0: as many as the profiles allow
    /// ([`automatic_bins`](stereology_unfold::automatic_bins)).
    pub bins: usize,
    /// Spacing of the size bins.
    pub spacing: Spacing,
    /// Edges of the size bins; they replace `bins`, `spacing` and `max_size`.
    pub edges: Option<Vec<f64>>,
    /// Largest particle size.
    pub max_size: LargestSize,
    /// Profiles lost where the plane cuts only the rim of a particle.
    pub capping: Capping,
    /// Sizes of the particles within a bin.
    pub sizes: Sizes,
    /// Fractions of the particle types, where the types of the profiles are not known.
    pub fractions: TypeFractions,
    /// The estimator, its threshold and intervals. Without a threshold the detection limit of the profiles is used.
    pub unfold: UnfoldOptions,
}

impl Default for DensityOptions {
    /// 16 bins (ten leave steps in the profile sizes of the sections), sizes spread over them, the default estimator
    /// without intervals.
    fn default() -> Self {
        Self {
            bins: 16,
            spacing: Spacing::Equal,
            edges: None,
            max_size: LargestSize::Profile,
            capping: Capping::None,
            sizes: Sizes::Integrated,
            fractions: TypeFractions::Given,
            unfold: UnfoldOptions::default(),
        }
    }
}

/// Spacing of size bins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spacing {
    /// Equal widths, from 0.
    #[default]
    Equal,
    /// Equal ratios; the first bin holds everything up to the smallest observed size.
    Geometric,
    /// Krumbein's half φ classes: edges at powers of √2 of the unit, whatever the number of bins.
    Phi,
}

/// The largest size of a particle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum LargestSize {
    /// The size of the largest profile, eq. (7). It is too small, by half a percent with a thousand profiles.
    #[default]
    Profile,
    /// The largest profile, extrapolated from the spacing of the largest ones.
    Corrected,
    /// The size of highest likelihood, between the largest profile and 1.5 times it.
    Likelihood,
    /// A known size.
    Given(f64),
}

/// Profiles lost where the plane cuts only the rim of a particle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Capping {
    /// None.
    #[default]
    None,
    /// Those below D sin φ of a particle of size D; φ in radians.
    Angle(f64),
    /// The same with the angle φ of highest likelihood, between 0 and 80°.
    Likelihood,
}

/// Fractions of the particle types by number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TypeFractions {
    /// The shares of the [`ParticleTypes`](crate::pipeline::ParticleTypes).
    #[default]
    Given,
    /// The fractions of highest likelihood; an error where the profiles do not determine them.
    Likelihood,
}
