//! The size of the periodic box, and the particles that go into it.

use crate::pipeline::{ParticleDensities, ParticleTypes};
use nalgebra::Vector3;
use stereology_anneal::{Grain, PopulationError, SizeDensities, SizeInBin, grains_from_densities, scale_to_fraction};
use stereology_kmatrix::Sizes;
use stereology_metrics::Finding;
use stereology_shape::{BoxError, PeriodicBox};

/// The size of the solid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Extent {
    /// Side of the box: 4 × the largest particle, or more to hold 5,000 particles.
    #[default]
    Auto,
    /// Side of the box; rounded to whole periods of the texture.
    Side(f64),
    /// Approximate number of particles: the box is rounded to whole periods of the texture.
    Count(usize),
}

/// Particles without positions, and their box.
#[derive(Clone, Debug)]
pub struct Population {
    /// The particles.
    pub grains: Vec<Grain>,
    /// The box, a cube whose side is a whole number of periods of the texture.
    pub period: PeriodicBox,
    /// Volume fraction of the particles in the box.
    pub fraction: f64,
    /// Volume fraction of the unfolded densities.
    pub unfolded_fraction: f64,
    /// Factor by which the densities were multiplied to give the requested fraction, by default the photograph's area
    /// fraction (Delesse: V_V = A_A).
    pub density_factor: f64,
    /// What was rounded or left out.
    pub findings: Vec<Finding>,
}

/// Why no population can be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PopulationFailure {
    /// No particles above the threshold.
    #[error("the unfolded densities hold no particles above the threshold; check the segmentation, or use fewer bins")]
    Nothing,
    /// A box too small for its largest particle, or with too many particles.
    #[error("the box of side {side:.4} {why}; choose another side or number of particles")]
    Side {
        /// The side.
        side: f64,
        /// The reason.
        why: String,
    },
    /// Invalid sides of the box.
    #[error(transparent)]
    Box(#[from] BoxError),
    /// Invalid densities or sizes.
    #[error(transparent)]
    Population(#[from] PopulationError),
}

const ENOUGH_PARTICLES: f64 = 5_000.0;
const MOST_PARTICLES: f64 = 50_000.0;
/// A box with more particles than this would keep only its few largest.
const HOPELESS: f64 = 1e9;
/// Relative difference of area fraction and unfolded volume fraction that gives a warning: the standard error of both
/// with some hundred profiles.
const FRACTION_TOLERANCE: f64 = 0.1;

/// The particles of a box: whole numbers from the densities, scaled so that their volume is `fraction` of the box;
/// sizes are spread over each bin.
///
/// `texture_period` is the period of the residual; the side of the box is a multiple of it. Beyond 50,000 particles the
/// smallest are left out, and the fraction decreases by their volume.
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
    let unfolded_fraction = densities.all.volume_fraction.value;
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
                 multiplied by {density_factor:.3}. Check the assumed shape, the largest size and the segmentation"
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
    // Rounding to whole particles changed the volume slightly; one factor on all sizes restores it.
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

/// Part of a fine size bin above the threshold, all categories together.
#[derive(Clone, Copy, Debug)]
struct Bin {
    index: usize,
    lower: f64,
    upper: f64,
    number_density: f64,
}

impl Bin {
    /// Volume of the particles of the bin per unit volume, for bodies of volume 1 at size 1: number density times the
    /// mean of D³ over the bin.
    fn volume(&self) -> f64 {
        let mean_cube = 0.25 * (self.upper + self.lower) * (self.upper.powi(2) + self.lower.powi(2));
        self.number_density * mean_cube
    }
}

/// The fine bins above the threshold; of the bin that contains it, the part above.
fn observable_bins(densities: &ParticleDensities) -> Vec<Bin> {
    let edges = &densities.fine_edges;
    let bin = |index: usize| {
        let (lower, upper) = (edges[index], edges[index + 1]);
        let number_density = densities.by_category.iter().map(|part| part.density.fine[index]).sum();
        if densities.sizes == Sizes::UpperEdge {
            return Some(Bin {
                index,
                lower: upper,
                upper,
                number_density,
            });
        }
        let seen = lower.max(densities.all.threshold.min(upper));
        // The density of that bin counts only the particles above the threshold.
        (seen < upper).then_some(Bin {
            index,
            lower: seen,
            upper,
            number_density,
        })
    };
    (0..edges.len() - 1).filter_map(bin).collect()
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
        // Never smaller than required.
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

/// The largest particles, up to the maximum number that is packed.
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
        // The upper part of this bin, as its sizes are spread evenly.
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
            "the box would hold {expected:.0} particles; those below size {smallest:.4} ({:.1} % of the particles' volume) were left out. Use a smaller box to keep them",
            100.0 * lost
        ),
    ));
    kept
}

/// Whole numbers of particles of every type and category, in order of size.
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
                densities.fine_edges[bin.index]
            }
        })
        .collect();
    edges.push(last.upper);
    let mut histograms = Vec::new();
    for part in &densities.by_category {
        let number = |share: f64| -> Vec<f64> {
            let of_bin = |bin: &Bin| {
                let whole: f64 = densities
                    .by_category
                    .iter()
                    .map(|part| part.density.fine[bin.index])
                    .sum();
                let fraction = if whole > 0.0 {
                    part.density.fine[bin.index] / whole
                } else {
                    0.0
                };
                bin.number_density * fraction * share * density_factor
            };
            bins.iter().map(of_bin).collect()
        };
        match part.kind {
            Some(shape) => histograms.push((shape, part.category, number(1.0))),
            None => {
                let shapes = types.types().iter().enumerate();
                histograms.extend(shapes.map(|(shape, of)| (shape, part.category, number(of.share))));
            }
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
