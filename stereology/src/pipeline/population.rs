//! How large the box that repeats is, and which particles go into it.

use crate::pipeline::{ParticleDensities, ParticleTypes};
use nalgebra::Vector3;
use stereology_anneal::{Grain, PopulationError, SizeDensities, SizeInBin, grains_from_densities, scale_to_fraction};
use stereology_kmatrix::Sizes;
use stereology_metrics::Finding;
use stereology_shape::{BoxError, PeriodicBox};

/// How large the solid is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Extent {
    /// Side of the box: 4 × the largest particle, or more to hold 5,000 particles.
    #[default]
    Auto,
    /// Side of the box; rounded to whole periods of the texture.
    Side(f64),
    /// Number of particles; nearly, since the box is rounded to whole periods of the texture.
    Count(usize),
}

/// Particles without a place, and their box.
#[derive(Clone, Debug)]
pub struct Population {
    /// The particles.
    pub grains: Vec<Grain>,
    /// The box, a cube whose side is a whole number of periods of the texture.
    pub period: PeriodicBox,
    /// Volume fraction of the particles in the box.
    pub fraction: f64,
    /// Volume fraction that the densities give by themselves.
    pub unfolded_fraction: f64,
    /// Densities were multiplied by this to meet the photograph's area fraction (Delesse: V_V = A_A).
    pub density_factor: f64,
    /// What was rounded or left out.
    pub findings: Vec<Finding>,
}

/// A population that cannot be.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PopulationFailure {
    /// No particles were found.
    #[error("the unfolded densities hold no particles above the threshold; check the segmentation, or take fewer bins")]
    Nothing,
    /// A box too small for its largest particle, or beyond what can be held.
    #[error("the box of side {side:.4} {why}; choose another --box or --count")]
    Side {
        /// The side.
        side: f64,
        /// What is wrong with it.
        why: String,
    },
    /// The sides of the box.
    #[error(transparent)]
    Box(#[from] BoxError),
    /// The particles.
    #[error(transparent)]
    Population(#[from] PopulationError),
}

const ENOUGH_PARTICLES: f64 = 5_000.0;
const MOST_PARTICLES: f64 = 50_000.0;
/// A box that holds so many would be left with its few largest particles.
const HOPELESS: f64 = 1e9;
/// Beyond this the area fraction and the unfolded volume fraction contradict each other.
const FRACTION_TOLERANCE: f64 = 0.1;

/// The particles of a box: counts from the densities, scaled so that their volume is `fraction` of it; sizes spread over each bin, kept whole.
///
/// `texture_period` is the length after which the residual repeats; the box's side is a multiple of it. Beyond 50,000 particles the smallest are left out,
/// and the fraction is then less by their volume.
///
/// # Errors
///
/// [`PopulationFailure`].
///
/// # Examples
///
/// ```
/// use std::ops::ControlFlow;
/// use stereology::pipeline::{DensityOptions, Extent, MeasuredProfiles, ParticleTypes, unfold_profiles, population};
///
/// // Cuts through spheres of diameter 10, at evenly spread depths, on an area of 1e5: they fill 300 / 1e5 / 10 * pi 10³ / 6 = .157.
/// let sizes: Vec<f64> = (0..300).map(|i| 10.0 * (1.0 - ((f64::from(i) + 0.5) / 300.0).powi(2)).sqrt()).collect();
/// let profiles = MeasuredProfiles { weights: vec![1.0; 300], categories: vec![0; 300], area: 1e5, sizes, ..MeasuredProfiles::default() };
/// let spheres = ParticleTypes::parse(&["sphere"])?;
/// let options = DensityOptions { bins: 5, ..DensityOptions::default() };
/// let densities = unfold_profiles(&profiles, &spheres, &options, &|_| ControlFlow::Continue(()))?;
/// let drawn = population(&densities, &spheres, 0.157, Extent::Count(1000), 8.0, 0)?;
/// let volume: f64 = drawn.grains.iter().map(|grain| grain.size.powi(3) * std::f64::consts::PI / 6.0).sum();
/// assert!((volume / drawn.period.volume() - 0.157).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn population(
    densities: &ParticleDensities,
    types: &ParticleTypes,
    fraction: f64,
    extent: Extent,
    texture_period: f64,
    seed: u64,
) -> Result<Population, PopulationFailure> {
    let bodies = types.unit_bodies();
    let bins = observable_bins(densities);
    let unit_volume: f64 = types
        .types()
        .iter()
        .zip(&bodies)
        .map(|(of, body)| of.share * body.volume())
        .sum();
    let unfolded_fraction = unit_volume * bins.iter().map(Bin::volume).sum::<f64>();
    let number: f64 = bins.iter().map(|bin| bin.number_density).sum();
    if !(unfolded_fraction > 0.0 && number > 0.0) {
        return Err(PopulationFailure::Nothing);
    }
    let density_factor = fraction / unfolded_fraction;
    let mut findings = Vec::new();
    if (density_factor - 1.0).abs() > FRACTION_TOLERANCE {
        findings.push(Finding::new(
            "fraction-mismatch",
            format!(
                "the unfolded particles fill {unfolded_fraction:.3} of the volume, the photograph's profiles cover {fraction:.3} of its area: densities were \
                 multiplied by {density_factor:.3}. The assumed shape, the largest size or the segmentation is off"
            ),
        ));
    }
    let per_volume = number * density_factor;
    let largest = bins
        .iter()
        .filter(|bin| bin.number_density > 0.0)
        .map(|bin| bin.upper)
        .fold(0.0, f64::max);
    let side = side(extent, largest, per_volume, texture_period, &mut findings)?;
    let period = PeriodicBox::new(Vector3::repeat(side))?;
    let kept = keep_largest(bins, density_factor, period.volume(), &mut findings);
    let mut grains = draw(&kept, densities, types, density_factor, period.volume(), seed)?;
    if grains.is_empty() {
        return Err(PopulationFailure::Nothing);
    }
    let kept_volume: f64 = kept.iter().map(Bin::volume).sum();
    let all_volume: f64 = observable_bins(densities).iter().map(Bin::volume).sum();
    let fraction = fraction * kept_volume / all_volume;
    // Rounding to whole particles changed the volume a little; sizes take it up, all by one factor.
    scale_to_fraction(&bodies, &mut grains, &period, fraction)?;
    Ok(Population {
        grains,
        period,
        fraction,
        unfolded_fraction,
        density_factor,
        findings,
    })
}

/// Part of a size bin that profiles can tell about, all categories together.
#[derive(Clone, Copy, Debug)]
struct Bin {
    index: usize,
    lower: f64,
    upper: f64,
    number_density: f64,
}

impl Bin {
    /// Number density times the mean of D³ over the bin: the volume of its particles per unit volume, for bodies of volume 1 at size 1.
    fn volume(&self) -> f64 {
        let mean_cube = 0.25 * (self.upper + self.lower) * (self.upper.powi(2) + self.lower.powi(2));
        self.number_density * mean_cube
    }
}

/// The bins from the threshold on; of the bin it falls in, the part above it.
fn observable_bins(densities: &ParticleDensities) -> Vec<Bin> {
    let all = &densities.all;
    let bin = |index: usize| {
        let (lower, upper) = (all.edges[index], all.edges[index + 1]);
        let number_density = densities.combined(index)?;
        if densities.sizes == Sizes::UpperEdge {
            return Some(Bin {
                index,
                lower: upper,
                upper,
                number_density,
            });
        }
        let seen = lower.max(all.threshold.min(upper));
        // The densities of that bin are of the particles above the threshold only.
        (seen < upper).then_some(Bin {
            index,
            lower: seen,
            upper,
            number_density,
        })
    };
    (0..all.number_density.len()).filter_map(bin).collect()
}

fn side(
    extent: Extent,
    largest: f64,
    per_volume: f64,
    texture_period: f64,
    findings: &mut Vec<Finding>,
) -> Result<f64, PopulationFailure> {
    let holding = |count: f64| (count / per_volume).cbrt();
    let asked = match extent {
        Extent::Auto => (4.0 * largest).max(holding(ENOUGH_PARTICLES)),
        Extent::Side(side) => side,
        Extent::Count(count) => holding(count as f64),
    };
    let periods = match extent {
        // Not smaller than it must be.
        Extent::Auto => (asked / texture_period).ceil(),
        _ => (asked / texture_period).round(),
    }
    .max(1.0);
    let side = periods * texture_period;
    if !side.is_finite() || side < 1.5 * largest {
        let why = format!("is less than 1.5 x the largest particle ({largest:.4})");
        return Err(PopulationFailure::Side { side, why });
    }
    let held = per_volume * side.powi(3);
    if held > HOPELESS {
        let why = format!(
            "would hold {held:.2e} particles, of which {MOST_PARTICLES:.0} could be packed: a solid without its fines"
        );
        return Err(PopulationFailure::Side { side, why });
    }
    if extent != Extent::Auto && (side / asked - 1.0).abs() > 0.02 {
        findings.push(Finding::new(
            "box-rounded",
            format!("the box's side was rounded from {asked:.4} to {side:.4}, {periods} periods of the texture, so that the solid repeats"),
        ));
    }
    Ok(side)
}

/// The largest particles up to the most that are packed.
fn keep_largest(bins: Vec<Bin>, density_factor: f64, volume: f64, findings: &mut Vec<Finding>) -> Vec<Bin> {
    let per_count = density_factor * volume;
    let expected: f64 = bins.iter().map(|bin| bin.number_density * per_count).sum();
    if expected <= MOST_PARTICLES {
        return bins;
    }
    let mut kept = Vec::new();
    let mut room = MOST_PARTICLES;
    let mut smallest = 0.0;
    for bin in bins.iter().rev() {
        let count = bin.number_density * per_count;
        if count <= room {
            kept.push(*bin);
            room -= count;
            smallest = bin.lower;
            continue;
        }
        // The upper part of this bin: its sizes are spread evenly.
        let share = room / count;
        let lower = bin.upper - share * (bin.upper - bin.lower);
        if share > 0.0 {
            kept.push(Bin {
                lower,
                number_density: bin.number_density * share,
                ..*bin
            });
            smallest = lower;
        }
        break;
    }
    kept.reverse();
    let lost = 1.0 - kept.iter().map(Bin::volume).sum::<f64>() / bins.iter().map(Bin::volume).sum::<f64>();
    findings.push(Finding::new(
        "fines-left-out",
        format!(
            "the box would hold {expected:.0} particles; those below size {smallest:.4} ({:.1} % of the particles' volume) were left out. Take a smaller --box to keep them",
            100.0 * lost
        ),
    ));
    kept
}

/// Whole particles of every type and category, largest last.
fn draw(
    bins: &[Bin],
    densities: &ParticleDensities,
    types: &ParticleTypes,
    density_factor: f64,
    volume: f64,
    seed: u64,
) -> Result<Vec<Grain>, PopulationError> {
    let Some(last) = bins.last() else { return Ok(Vec::new()) };
    let spread = densities.sizes == Sizes::Integrated;
    let mut edges: Vec<f64> = bins
        .iter()
        .map(|bin| {
            if spread {
                bin.lower
            } else {
                densities.all.edges[bin.index]
            }
        })
        .collect();
    edges.push(last.upper);
    let mut histograms = Vec::new();
    for (shape, of) in types.types().iter().enumerate() {
        for (category, by_bin) in densities.by_category.iter().enumerate() {
            let number = bins
                .iter()
                .map(|bin| {
                    let whole = densities.combined(bin.index).unwrap_or(0.0);
                    let share = if whole > 0.0 {
                        by_bin[bin.index].unwrap_or(0.0) / whole
                    } else {
                        0.0
                    };
                    bin.number_density * share * of.share * density_factor
                })
                .collect::<Vec<f64>>();
            histograms.push((shape, u8::try_from(category).unwrap_or(u8::MAX), number));
        }
    }
    let histograms: Vec<SizeDensities<'_>> = histograms
        .iter()
        .map(|(shape, category, number_density)| SizeDensities {
            shape: *shape,
            category: *category,
            edges: &edges,
            number_density,
        })
        .collect();
    let size_in_bin = if spread {
        SizeInBin::Spread
    } else {
        SizeInBin::UpperEdge
    };
    grains_from_densities(&histograms, volume, size_in_bin, seed)
}
