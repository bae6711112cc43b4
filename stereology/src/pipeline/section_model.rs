//! What must be known before densities can be: the largest size, what is lost at the rims, the shares of the types; each given, or found from the profiles.

use crate::pipeline::densities::reported;
use crate::pipeline::{DensityError, MeasuredProfiles, ParticleTypes, UnfoldingBins};
use stereology_kmatrix::Sizes;
use stereology_unfold::{
    Fractions, Kernel, LikelyParameter, ProfileCounts, SizeBins, UnfoldOptions, capped_kernel, equal_edges,
    largest_size, likely_parameter, unknown_fractions,
};

/// The largest size of a particle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum LargestSize {
    /// That of the largest profile, eq. (7): a cut through the middle of the largest particle. Too small, by half a percent with a thousand profiles.
    #[default]
    Profile,
    /// The largest profile and what it falls short of, from the spacing of the largest ones.
    Corrected,
    /// Of highest likelihood, between the largest profile and half as much again.
    Likelihood,
    /// Known.
    Given(f64),
}

/// Profiles that are lost at the rims of particles, where the plane only just cuts them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Capping {
    /// None.
    #[default]
    None,
    /// Those below D sin φ of a particle of size D; φ in radians.
    Angle(f64),
    /// The same with φ of highest likelihood, between 0 and 80°.
    Likelihood,
}

/// Nominal coverage of the intervals of what is found by likelihood.
const LEVEL: f64 = 0.9;
/// The largest capping angle that is looked for, in radians: a profile as wide as all but 1.5 % of the particle.
const STEEPEST: f64 = 1.4;
/// Sizes beyond this many largest profiles are not looked for.
const BEYOND: f64 = 1.5;

/// The counted profiles: sizes and weights.
struct Counted {
    sizes: Vec<f64>,
    weights: Vec<f64>,
}

fn counted(profiles: &MeasuredProfiles) -> Result<Counted, DensityError> {
    let places = || (0..profiles.sizes.len()).filter(|&i| profiles.weights[i] > 0.0);
    if places().next().is_none() {
        return Err(DensityError::NoProfiles(profiles.sizes.len()));
    }
    Ok(Counted {
        sizes: places().map(|i| profiles.sizes[i]).collect(),
        weights: places().map(|i| profiles.weights[i]).collect(),
    })
}

impl Counted {
    fn largest(&self) -> f64 {
        self.sizes.iter().copied().fold(0.0, f64::max)
    }

    fn counts(&self, edges: &[f64], area: f64) -> Result<ProfileCounts, DensityError> {
        Ok(ProfileCounts::from_sizes(
            &self.sizes,
            Some(&self.weights),
            edges,
            area,
        )?)
    }
}

/// The largest size, and if it is sought by likelihood the search.
///
/// # Errors
///
/// [`DensityError`]: nothing counted, or as [`likely_parameter`].
///
/// ```
/// use stereology::pipeline::{LargestSize, MeasuredProfiles, ParticleTypes, largest_particle};
/// use stereology::unfold::UnfoldOptions;
/// // Spheres of diameter 10, cut at even depths.
/// let sizes: Vec<f64> = (0..300).map(|i| 10.0 * (1.0 - ((f64::from(i) + 0.5) / 300.0).powi(2)).sqrt()).collect();
/// let profiles = MeasuredProfiles { weights: vec![1.0; 300], categories: vec![0; 300], area: 1e5, sizes, ..MeasuredProfiles::default() };
/// let types = ParticleTypes::parse(&["sphere"])?;
/// let (size, _) = largest_particle(&profiles, &types, LargestSize::Corrected, &UnfoldOptions::default())?;
/// assert!((size - 10.0).abs() < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn largest_particle(
    profiles: &MeasuredProfiles,
    types: &ParticleTypes,
    of: LargestSize,
    options: &UnfoldOptions,
) -> Result<(f64, Option<LikelyParameter>), DensityError> {
    let counted = counted(profiles)?;
    let observed = counted.largest();
    match of {
        LargestSize::Given(size) => Ok((size, None)),
        LargestSize::Profile => Ok((observed, None)),
        LargestSize::Corrected => Ok((largest_size(&counted.sizes).map_or(observed, |found| found.value), None)),
        LargestSize::Likelihood => {
            let bins = equal_edges(observed * BEYOND, LIKELIHOOD_BINS);
            let counts = counted.counts(&bins, profiles.area)?;
            let kernel = |size: f64| {
                types
                    .kernel(&bins, &equal_edges(size, SIZE_BINS), Sizes::Integrated)
                    .map_err(|_| stereology_unfold::KernelError::Volume(size))
            };
            let range = (observed, observed * BEYOND);
            let found = likely_parameter(&counts, &kernel, range, LEVEL, options)?;
            Ok((found.value, Some(found)))
        }
    }
}

const LIKELIHOOD_BINS: usize = 300;
const SIZE_BINS: usize = 40;

impl ParticleTypes {
    /// The kernel of the types together under a capping angle (radians), as [`kernel`](Self::kernel) without one.
    ///
    /// # Errors
    ///
    /// [`DensityError`]: edges that make no bins, an angle that is none.
    ///
    /// ```
    /// use stereology::kmatrix::Sizes;
    /// use stereology::pipeline::{ParticleTypes, UnfoldingBins};
    /// use stereology::unfold::Method;
    /// let bins = UnfoldingBins::new(&[0.0, 0.5, 1.0], 0.0, Method::Paper, Sizes::UpperEdge);
    /// let kernel = ParticleTypes::parse(&["sphere"])?.capped_kernel(0.5, &bins, Sizes::UpperEdge)?;
    /// assert!((kernel.matrix().column(1).sum() - 0.5_f64.cos()).abs() < 1e-9); // so many of a sphere's profiles are seen
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn capped_kernel(&self, angle: f64, bins: &UnfoldingBins, sizes: Sizes) -> Result<Kernel, DensityError> {
        if angle <= 0.0 {
            return Ok(self.kernel(&bins.profile_edges, &bins.size_edges, sizes)?);
        }
        let edges = match sizes {
            Sizes::UpperEdge => SizeBins::upper_edge(&bins.size_edges),
            Sizes::Integrated => SizeBins::integrated(&bins.size_edges),
        };
        let edges = edges.map_err(stereology_unfold::UnfoldError::from)?;
        let kernels = self
            .types()
            .iter()
            .map(|of| {
                let law = of.law();
                let caliper = law.caliper_effective() / law.size();
                let kernel = capped_kernel(
                    &|x| law.cdf(x),
                    caliper,
                    angle,
                    &bins.profile_edges,
                    edges.clone(),
                    law.unit_volume(),
                );
                kernel?.with_unit_surface(law.surface_area() / law.size().powi(2))
            })
            .collect::<Result<Vec<_>, _>>()
            .map_err(stereology_unfold::UnfoldError::from)?;
        let shares: Vec<f64> = self.types().iter().map(|of| of.share).collect();
        Ok(Kernel::mix(&kernels, &shares).map_err(stereology_unfold::UnfoldError::from)?)
    }
}

/// The capping angle, and if it is sought by likelihood the search; for bins between `edges`.
///
/// # Errors
///
/// [`DensityError`]: nothing counted, or as [`likely_parameter`].
///
/// ```
/// use stereology::pipeline::{Capping, MeasuredProfiles, ParticleTypes, capping_angle};
/// use stereology::unfold::UnfoldOptions;
/// // Spheres of diameter 10, cut at even depths.
/// let sizes: Vec<f64> = (0..300).map(|i| 10.0 * (1.0 - ((f64::from(i) + 0.5) / 300.0).powi(2)).sqrt()).collect();
/// let profiles = MeasuredProfiles { weights: vec![1.0; 300], categories: vec![0; 300], area: 1e5, sizes, ..MeasuredProfiles::default() };
/// let types = ParticleTypes::parse(&["sphere"])?;
/// let edges = [0.0, 2.0, 4.0, 6.0, 8.0, 10.0];
/// let (angle, search) = capping_angle(&profiles, &types, Capping::Likelihood, &edges, &UnfoldOptions::default())?;
/// assert!(angle < 0.3 && search.is_some_and(|search| search.interval.lower < 0.1)); // nothing is lost
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn capping_angle(
    profiles: &MeasuredProfiles,
    types: &ParticleTypes,
    of: Capping,
    edges: &[f64],
    options: &UnfoldOptions,
) -> Result<(f64, Option<LikelyParameter>), DensityError> {
    match of {
        Capping::None => Ok((0.0, None)),
        Capping::Angle(angle) => Ok((angle, None)),
        Capping::Likelihood => {
            let bins = UnfoldingBins::new(
                edges,
                options.min_size.unwrap_or(0.0),
                options.method,
                Sizes::Integrated,
            );
            let counts = counted(profiles)?.counts(&bins.profile_edges, profiles.area)?;
            let kernel = |angle: f64| {
                types
                    .capped_kernel(angle, &bins, Sizes::Integrated)
                    .map_err(|_| stereology_unfold::KernelError::CappingAngle(angle))
            };
            let found = likely_parameter(&counts, &kernel, (0.0, STEEPEST), LEVEL, options)?;
            Ok((found.value, Some(found)))
        }
    }
}

/// The shares of the types by likelihood, where profiles do not tell their type; for bins between `edges`.
///
/// # Errors
///
/// [`DensityError`]: nothing counted, or as [`unknown_fractions`]: often the profiles do not tell.
///
/// ```
/// use stereology::pipeline::{MeasuredProfiles, ParticleTypes, type_shares};
/// use stereology::unfold::UnfoldOptions;
/// // Spheres of diameter 10, cut at even depths.
/// let sizes: Vec<f64> = (0..300).map(|i| 10.0 * (1.0 - ((f64::from(i) + 0.5) / 300.0).powi(2)).sqrt()).collect();
/// let profiles = MeasuredProfiles { weights: vec![1.0; 300], categories: vec![0; 300], area: 1e5, sizes, ..MeasuredProfiles::default() };
/// let types = ParticleTypes::parse(&["sphere", "ellipsoid:1,1,1.1"])?;
/// // Either a share with an interval, or the word that the profiles do not tell.
/// match type_shares(&profiles, &types, &[0.0, 5.0, 10.0], &UnfoldOptions::default()) {
///     Ok(shares) => assert!((shares.fractions.iter().sum::<f64>() - 1.0).abs() < 1e-9),
///     Err(error) => assert!(error.to_string().contains("do not tell")),
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn type_shares(
    profiles: &MeasuredProfiles,
    types: &ParticleTypes,
    edges: &[f64],
    options: &UnfoldOptions,
) -> Result<Fractions, DensityError> {
    let bins = UnfoldingBins::new(
        edges,
        options.min_size.unwrap_or(0.0),
        options.method,
        Sizes::Integrated,
    );
    let counts = counted(profiles)?.counts(&bins.profile_edges, profiles.area)?;
    let kernels = types
        .types()
        .iter()
        .map(|of| {
            reported(
                of.kernel(&bins.profile_edges, &bins.size_edges, Sizes::Integrated)?,
                edges,
            )
        })
        .collect::<Result<Vec<_>, DensityError>>()?;
    Ok(unknown_fractions(&counts, &kernels, LEVEL, options)?)
}
