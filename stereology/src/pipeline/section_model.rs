//! Parameters of the kernel: the largest size, the capping angle, the fractions of the particle types; each given, or
//! estimated from the profiles.

use crate::pipeline::{Capping, DensityError, LargestSize, MeasuredProfiles, ParticleTypes, UnfoldingBins};
use stereology_kmatrix::Sizes;
use stereology_unfold::{
    Fractions, Kernel, LikelyParameter, ProfileCounts, SizeBins, UnfoldError, UnfoldOptions, capped_kernel,
    equal_edges, largest_size, likely_parameter, measured_kernel, unknown_fractions,
};

/// Nominal coverage of the intervals of parameters of highest likelihood.
const LEVEL: f64 = 0.9;
/// Upper end of the search for the capping angle, in radians: at this angle profiles narrower than 98.5 % of the
/// particle are lost.
const STEEPEST: f64 = 1.4;
/// Upper end of the search for the largest size, in sizes of the largest profile.
const BEYOND: f64 = 1.5;

/// Sizes and weights of the counted profiles.
struct Counted {
    sizes: Vec<f64>,
    weights: Vec<f64>,
}

impl Counted {
    fn of(profiles: &MeasuredProfiles) -> Result<Self, DensityError> {
        let places = profiles.counted()?;
        Ok(Self {
            sizes: places.iter().map(|&i| profiles.sizes[i]).collect(),
            weights: places.iter().map(|&i| profiles.weights[i]).collect(),
        })
    }

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

/// The largest particle size of a fit, and how it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct LargestParticle {
    /// The size.
    pub size: f64,
    /// How it was found. It differs from the request in one case: [`LargestSize::Corrected`] becomes
    /// [`LargestSize::Profile`] if the largest profiles are all of one size, or if there is only one.
    pub method: LargestSize,
    /// The search, for [`LargestSize::Likelihood`].
    pub likelihood: Option<LikelyParameter>,
}

/// The largest particle size.
///
/// # Errors
///
/// [`DensityError`]: no counted profile, or as [`likely_parameter`].
///
/// ```
/// use stereology::pipeline::{LargestSize, MeasuredProfiles, ParticleTypes, largest_particle};
/// use stereology::unfold::UnfoldOptions;
/// // Spheres of diameter 10, sectioned at even depths.
/// let sizes: Vec<f64> = (0..300).map(|i| 10.0 * (1.0 - ((f64::from(i) + 0.5) / 300.0).powi(2)).sqrt()).collect();
/// let mut profiles = MeasuredProfiles { weights: vec![1.0; 300], categories: vec![0; 300], area: 1e5, sizes, ..MeasuredProfiles::default() };
/// let types = ParticleTypes::parse(&["sphere"])?;
/// let largest = largest_particle(&profiles, &types, LargestSize::Corrected, &UnfoldOptions::default())?;
/// assert!((largest.size - 10.0).abs() < 0.01);
/// // Profiles of one size cannot be extrapolated, and the result says so.
/// profiles.sizes.fill(8.0);
/// let largest = largest_particle(&profiles, &types, LargestSize::Corrected, &UnfoldOptions::default())?;
/// assert_eq!((largest.size, largest.method), (8.0, LargestSize::Profile));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn largest_particle(
    profiles: &MeasuredProfiles,
    types: &ParticleTypes,
    method: LargestSize,
    options: &UnfoldOptions,
) -> Result<LargestParticle, DensityError> {
    let counted = Counted::of(profiles)?;
    let observed = counted.largest();
    let found = |size: f64, method: LargestSize| LargestParticle {
        size,
        method,
        likelihood: None,
    };
    match method {
        LargestSize::Given(size) => Ok(found(size, method)),
        LargestSize::Profile => Ok(found(observed, method)),
        LargestSize::Corrected => Ok(largest_size(&counted.sizes)
            .map_or(found(observed, LargestSize::Profile), |corrected| {
                found(corrected.value, method)
            })),
        LargestSize::Likelihood => {
            let bins = equal_edges(observed * BEYOND, LIKELIHOOD_BINS);
            let counts = counted.counts(&bins, profiles.area)?;
            let kernel = |size: f64| {
                let bins = UnfoldingBins {
                    profile_edges: bins.clone(),
                    size_edges: equal_edges(size, SIZE_BINS),
                    error: None,
                };
                let mut bins = bins.with_size_error(profiles.size_error, profiles.smallest(), 0.0);
                bins.profile_edges.truncate(LIKELIHOOD_BINS + 1);
                types
                    .capped_kernel(0.0, &bins, Sizes::Integrated)
                    .map_err(|_| stereology_unfold::KernelError::Volume(size))
            };
            // An error of the sizes makes the largest profile too large.
            let smallest = observed * (1.0 - 3.0 * profiles.size_error).max(0.3);
            let range = (smallest, observed * BEYOND);
            let likely = likely_parameter(&counts, &kernel, range, LEVEL, options)?;
            Ok(LargestParticle {
                size: likely.value,
                method,
                likelihood: Some(likely),
            })
        }
    }
}

const LIKELIHOOD_BINS: usize = 300;
const SIZE_BINS: usize = 40;

impl ParticleTypes {
    /// The kernel of the types together under a capping angle (radians); [`kernel`](Self::kernel) is that without one.
    ///
    /// # Errors
    ///
    /// [`DensityError`]: edges that do not form bins, an angle outside 0 to π/2.
    ///
    /// ```
    /// use stereology::kmatrix::Sizes;
    /// use stereology::pipeline::{ParticleTypes, UnfoldingBins};
    /// use stereology::unfold::Method;
    /// let bins = UnfoldingBins::new(&[0.0, 0.5, 1.0], 0.0, Method::Paper, Sizes::UpperEdge);
    /// let kernel = ParticleTypes::parse(&["sphere"])?.capped_kernel(0.5, &bins, Sizes::UpperEdge)?;
    /// assert!((kernel.matrix().column(1).sum() - 0.5_f64.cos()).abs() < 1e-9); // the observed part of a sphere's profiles
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn capped_kernel(&self, angle: f64, bins: &UnfoldingBins, sizes: Sizes) -> Result<Kernel, DensityError> {
        let Some(error) = &bins.error else {
            return self.exact_kernel(angle, bins, sizes);
        };
        let exact = UnfoldingBins {
            profile_edges: error.true_edges.clone(),
            size_edges: bins.size_edges.clone(),
            error: None,
        };
        let exact = self.exact_kernel(angle, &exact, sizes)?;
        let edges = &bins.profile_edges;
        let measured = measured_kernel(&exact, &error.true_edges, edges, error.relative, error.threshold);
        Ok(measured.map_err(stereology_unfold::UnfoldError::from)?)
    }

    /// The kernel of exact sizes.
    fn exact_kernel(&self, angle: f64, bins: &UnfoldingBins, sizes: Sizes) -> Result<Kernel, DensityError> {
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
                let kernel = kernel?.with_unit_surface(law.surface_area() / law.size().powi(2))?;
                Ok(kernel.with_profile_law(of.profile_law(angle)))
            })
            .collect::<Result<Vec<_>, stereology_unfold::KernelError>>()
            .map_err(stereology_unfold::UnfoldError::from)?;
        let shares: Vec<f64> = self.types().iter().map(|of| of.share).collect();
        Ok(Kernel::mix(&kernels, &shares).map_err(stereology_unfold::UnfoldError::from)?)
    }
}

/// The capping angle in radians, and the search for it ([`Capping::Likelihood`]); for bins between `edges`.
///
/// # Errors
///
/// [`DensityError`]: no counted profile, or as [`likely_parameter`].
///
/// ```
/// use stereology::pipeline::{Capping, MeasuredProfiles, ParticleTypes, capping_angle};
/// use stereology::unfold::UnfoldOptions;
/// // Spheres of diameter 10, sectioned at even depths.
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
            let threshold = options.min_size.unwrap_or(0.0);
            let bins = bins.with_size_error(profiles.size_error, profiles.smallest(), threshold);
            let counts = Counted::of(profiles)?.counts(&bins.profile_edges, profiles.area)?;
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

/// Fractions of the particle types of highest likelihood, where the types of the profiles are not known; for bins
/// between `edges`.
///
/// # Errors
///
/// [`DensityError`]: a single type, no counted profile, or as [`unknown_fractions`]: often the profiles do not
/// determine the fractions.
///
/// ```
/// use stereology::pipeline::{MeasuredProfiles, ParticleTypes, type_fractions};
/// use stereology::unfold::UnfoldOptions;
/// // Spheres of diameter 10, sectioned at even depths.
/// let sizes: Vec<f64> = (0..300).map(|i| 10.0 * (1.0 - ((f64::from(i) + 0.5) / 300.0).powi(2)).sqrt()).collect();
/// let profiles = MeasuredProfiles { weights: vec![1.0; 300], categories: vec![0; 300], area: 1e5, sizes, ..MeasuredProfiles::default() };
/// let types = ParticleTypes::parse(&["sphere", "ellipsoid:1,1,1.1"])?;
/// // Either fractions with intervals, or the error that the profiles do not determine them.
/// match type_fractions(&profiles, &types, &[0.0, 5.0, 10.0], &UnfoldOptions::default()) {
///     Ok(found) => assert!((found.fractions.iter().sum::<f64>() - 1.0).abs() < 1e-9),
///     Err(error) => assert!(error.to_string().contains("fractions of the types")),
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn type_fractions(
    profiles: &MeasuredProfiles,
    types: &ParticleTypes,
    edges: &[f64],
    options: &UnfoldOptions,
) -> Result<Fractions, DensityError> {
    if types.types().len() < 2 {
        return Err(DensityError::OneType);
    }
    let bins = UnfoldingBins::new(
        edges,
        options.min_size.unwrap_or(0.0),
        options.method,
        Sizes::Integrated,
    );
    let threshold = options.min_size.unwrap_or(0.0);
    let bins = bins.with_size_error(profiles.size_error, profiles.smallest(), threshold);
    let counts = Counted::of(profiles)?.counts(&bins.profile_edges, profiles.area)?;
    let kernels = (0..types.types().len())
        .map(|index| {
            let kernel = types.only(index).capped_kernel(0.0, &bins, Sizes::Integrated)?;
            reported(kernel, edges)
        })
        .collect::<Result<Vec<_>, DensityError>>()?;
    Ok(unknown_fractions(&counts, &kernels, LEVEL, options)?)
}

/// The kernel with its bins summed to those between `edges`.
pub(crate) fn reported(kernel: Kernel, edges: &[f64]) -> Result<Kernel, DensityError> {
    kernel
        .reported_in(edges)
        .map_err(|error| DensityError::Unfold(UnfoldError::Reported(error)))
}
