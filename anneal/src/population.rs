//! The particles to be packed: their sizes, shapes and categories, and the box that they fill.

use crate::conversions::truncated;
use nalgebra::{Point3, Vector3};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use stereology_shape::{Particle, PeriodicBox, UnitBody, isotropic_rotation};

/// A particle without a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grain {
    /// Index of its body.
    pub shape: usize,
    /// Equivalent circular diameter (ECD) of its largest section.
    pub size: f64,
    /// Colour category.
    pub category: u8,
}

/// Why a population cannot be created.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PopulationError {
    /// The width of a size distribution is negative or not finite.
    #[error("the standard deviation of the logarithm of sizes is {0}; it must be finite and not negative")]
    Sigma(f64),
    /// A size is not a positive number.
    #[error("size {size} at index {index} is not a positive finite length")]
    Size {
        /// Index of the size.
        index: usize,
        /// The size.
        size: f64,
    },
    /// A fraction of a shape is negative or not finite, or none is positive.
    #[error(
        "fraction {share} of shape {shape} is invalid: fractions must be finite and not negative, and at least one must be positive"
    )]
    Share {
        /// Index of the shape.
        shape: usize,
        /// Its fraction.
        share: f64,
    },
    /// A volume fraction is not in (0, 1).
    #[error("a volume fraction of {0} is impossible: it must lie between 0 and 1")]
    Fraction(f64),
    /// There are no particles, or the shape of one does not exist.
    #[error("there are no particles of the given shapes, so no box contains them at a volume fraction")]
    Nothing,
    /// A volume is not a positive number.
    #[error("the volume {0} is not a positive finite number")]
    Volume(f64),
    /// A histogram of number densities is invalid.
    #[error(
        "histogram {histogram} has {edges} edges and {densities} number densities: it needs one edge more than densities, increasing edges from 0 or above, and finite densities that are not negative"
    )]
    Histogram {
        /// Index of the histogram.
        histogram: usize,
        /// Number of its edges.
        edges: usize,
        /// Number of its densities.
        densities: usize,
    },
    /// There would be more than 10⁶ particles.
    #[error("{0:.3e} particles are too many, at most a million are packed: use a smaller box or omit the finest sizes")]
    TooMany(f64),
}

/// Sizes from a lognormal distribution of median 1: `exp(σ z)`, z normal. Only proportions matter until the box is
/// chosen.
///
/// # Errors
///
/// [`PopulationError::Sigma`].
///
/// ```
/// let sizes = stereology_anneal::lognormal_sizes(1000, 0.3, 1)?;
/// assert_eq!(sizes.iter().filter(|&&d| d > 1.0).count() / 100, 4); // about half
/// # Ok::<(), stereology_anneal::PopulationError>(())
/// ```
pub fn lognormal_sizes(count: usize, sigma: f64, seed: u64) -> Result<Vec<f64>, PopulationError> {
    if !(sigma.is_finite() && sigma >= 0.0) {
        return Err(PopulationError::Sigma(sigma));
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(SIZES);
    let mut draw = || {
        let z: f64 = StandardNormal.sample(&mut rng);
        (sigma * z).exp()
    };
    Ok((0..count).map(|_| draw()).collect())
}

const SIZES: u64 = 1;
const SHAPES: u64 = 2;
const PLACES: u64 = 3;
pub(crate) const BINS: u64 = 4;

/// Assigns a shape to each size: shape `i` to the number fraction `shares[i]` (fractions need not sum to 1). The
/// category is 0.
///
/// The number of each shape is its fraction of the total rounded down, plus one for the largest remainders until all
/// sizes have a shape. Which sizes get which shape is random.
///
/// # Errors
///
/// [`PopulationError::Size`], [`PopulationError::Share`].
///
/// ```
/// let grains = stereology_anneal::mix(&[1.0; 10], &[0.25, 0.75], 0)?;
/// assert_eq!(grains.iter().filter(|g| g.shape == 1).count(), 7); // 7.5 and 2.5: the first shape takes the odd one
/// # Ok::<(), stereology_anneal::PopulationError>(())
/// ```
pub fn mix(sizes: &[f64], shares: &[f64], seed: u64) -> Result<Vec<Grain>, PopulationError> {
    if let Some((index, &size)) = sizes
        .iter()
        .enumerate()
        .find(|(_, size)| !(size.is_finite() && **size > 0.0))
    {
        return Err(PopulationError::Size { index, size });
    }
    if let Some((shape, &share)) = shares
        .iter()
        .enumerate()
        .find(|(_, share)| !(share.is_finite() && **share >= 0.0))
    {
        return Err(PopulationError::Share { shape, share });
    }
    let whole: f64 = shares.iter().sum();
    if !(whole > 0.0 && whole.is_finite()) {
        return Err(PopulationError::Share {
            shape: 0,
            share: shares.first().copied().unwrap_or(0.0),
        });
    }
    let wanted: Vec<f64> = shares.iter().map(|share| share / whole * sizes.len() as f64).collect();
    let mut counts: Vec<usize> = wanted.iter().map(|&w| truncated(w)).collect();
    let mut by_remainder: Vec<usize> = (0..shares.len()).collect();
    by_remainder.sort_by(|&p, &q| wanted[q].fract().total_cmp(&wanted[p].fract()).then(p.cmp(&q)));
    let missing = sizes.len().saturating_sub(counts.iter().sum());
    for &shape in by_remainder.iter().take(missing) {
        counts[shape] += 1;
    }
    let mut shapes: Vec<usize> = counts
        .iter()
        .enumerate()
        .flat_map(|(shape, &n)| std::iter::repeat_n(shape, n))
        .collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(SHAPES);
    shapes.shuffle(&mut rng);
    Ok(sizes
        .iter()
        .zip(shapes)
        .map(|(&size, shape)| Grain {
            shape,
            size,
            category: 0,
        })
        .collect())
}

/// Total volume of all grains.
///
/// # Errors
///
/// [`PopulationError::Nothing`] if it is zero or a shape does not exist.
///
/// # Examples
///
/// ```
/// use stereology_anneal::{Grain, total_volume};
/// use stereology_shape::{Body, UnitBody};
///
/// let spheres = [UnitBody::new(&Body::sphere(1.0)?)];
/// let grains = [1.0, 2.0].map(|size| Grain { shape: 0, size, category: 0 });
/// assert!((total_volume(&spheres, &grains)? - 9.0 * std::f64::consts::PI / 6.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn total_volume(bodies: &[UnitBody], grains: &[Grain]) -> Result<f64, PopulationError> {
    let mut volume = 0.0;
    for grain in grains {
        volume += bodies.get(grain.shape).ok_or(PopulationError::Nothing)?.volume() * grain.size.powi(3);
    }
    if volume > 0.0 && volume.is_finite() {
        Ok(volume)
    } else {
        Err(PopulationError::Nothing)
    }
}

/// The cube that the grains fill to exactly `fraction`: sizes are kept and the box is adjusted.
///
/// # Errors
///
/// [`PopulationError::Fraction`] unless it lies in (0, 1); [`PopulationError::Nothing`].
///
/// ```
/// use stereology_anneal::{Grain, box_for_fraction};
/// use stereology_shape::{Body, UnitBody};
///
/// let ball = UnitBody::new(&Body::sphere(1.0)?);
/// let period = box_for_fraction(&[ball], &[Grain { shape: 0, size: 1.0, category: 0 }; 8], std::f64::consts::PI / 6.0)?;
/// assert!((period.sides().x - 2.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn box_for_fraction(bodies: &[UnitBody], grains: &[Grain], fraction: f64) -> Result<PeriodicBox, PopulationError> {
    let volume = total_volume(bodies, grains)? / checked(fraction)?;
    PeriodicBox::new(Vector3::repeat(volume.cbrt())).map_err(|_| PopulationError::Nothing)
}

/// Multiplies all sizes by one factor so that the grains fill `period` to exactly `fraction`, and returns the factor:
/// the box is kept and sizes are adjusted.
///
/// # Errors
///
/// As [`box_for_fraction`].
///
/// ```
/// use nalgebra::Vector3;
/// use stereology_anneal::{Grain, scale_to_fraction};
/// use stereology_shape::{Body, PeriodicBox, UnitBody};
///
/// let ball = UnitBody::new(&Body::sphere(1.0)?);
/// let mut grains = [Grain { shape: 0, size: 2.0, category: 0 }; 8];
/// let factor = scale_to_fraction(&[ball], &mut grains, &PeriodicBox::new(Vector3::repeat(2.0))?, std::f64::consts::PI / 6.0)?;
/// assert!((factor - 0.5).abs() < 1e-12 && (grains[0].size - 1.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn scale_to_fraction(
    bodies: &[UnitBody],
    grains: &mut [Grain],
    period: &PeriodicBox,
    fraction: f64,
) -> Result<f64, PopulationError> {
    let factor = (checked(fraction)? * period.volume() / total_volume(bodies, grains)?).cbrt();
    for grain in grains {
        grain.size *= factor;
    }
    Ok(factor)
}

/// Number of grains with the mean volume of a sample that fill `period` to `fraction`, rounded; at least one.
///
/// # Errors
///
/// As [`box_for_fraction`], and [`PopulationError::TooMany`] above 10⁶.
///
/// # Examples
///
/// ```
/// use stereology_anneal::{Grain, count_to_fill};
/// use stereology_shape::{Body, PeriodicBox, UnitBody};
///
/// let spheres = [UnitBody::new(&Body::sphere(1.0)?)];
/// let grain = Grain { shape: 0, size: 1.0, category: 0 };
/// let period = PeriodicBox::new(nalgebra::Vector3::repeat(10.0))?;
/// assert_eq!(count_to_fill(&spheres, &[grain], &period, 0.3)?, 573); // 300 / (pi / 6)
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn count_to_fill(
    bodies: &[UnitBody],
    sample: &[Grain],
    period: &PeriodicBox,
    fraction: f64,
) -> Result<usize, PopulationError> {
    let mean = total_volume(bodies, sample)? / sample.len() as f64;
    let count = (checked(fraction)? * period.volume() / mean).round().max(1.0);
    if count > MOST {
        Err(PopulationError::TooMany(count))
    } else {
        Ok(truncated(count))
    }
}

/// Larger numbers of particles are refused before memory is allocated.
pub(crate) const MOST: f64 = 1e6;

fn checked(fraction: f64) -> Result<f64, PopulationError> {
    if fraction > 0.0 && fraction < 1.0 {
        Ok(fraction)
    } else {
        Err(PopulationError::Fraction(fraction))
    }
}

/// Places every grain at a random position in a random orientation, ignoring overlap: Jagnow et al. 2004, section 4.1.
///
/// Positions are uniform and orientations isotropic.
///
/// ```
/// use nalgebra::Vector3;
/// use stereology_anneal::{Grain, populate};
/// use stereology_shape::PeriodicBox;
///
/// let period = PeriodicBox::new(Vector3::new(3.0, 2.0, 1.0))?;
/// let particles = populate(&[Grain { shape: 0, size: 0.1, category: 5 }; 50], &period, 1);
/// assert!(particles.iter().all(|p| p.category == 5 && p.position == period.wrap(&p.position)));
/// # Ok::<(), stereology_shape::BoxError>(())
/// ```
#[must_use]
pub fn populate(grains: &[Grain], period: &PeriodicBox, seed: u64) -> Vec<Particle> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(PLACES);
    let mut place = |grain: &Grain| {
        let at = Vector3::from_fn(|_, _| rng.random::<f64>()).component_mul(&period.sides());
        let position = period.wrap(&Point3::from(at));
        let orientation = isotropic_rotation(&mut rng);
        Particle {
            shape: grain.shape,
            size: grain.size,
            category: grain.category,
            position,
            orientation,
        }
    };
    grains.iter().map(&mut place).collect()
}
