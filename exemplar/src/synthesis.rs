//! Synthesis of a solid from exemplars, from coarse to fine levels.

use std::ops::ControlFlow;

use ndarray::{Array3, Array4, ArrayView3};

use stereology_metrics::Progress;

use crate::domain::Domain;
use crate::error::SolidError;
use crate::exemplar::Exemplar;
use crate::feature_size::levels_for;
use crate::field::Field;
use crate::iteration::Iteration;
use crate::level::{Atlas, Level, NONE, smoothed};
use crate::numbers::number as numbered;
use crate::options::{SolidOptions, Solver};
use crate::recipe::{Combine, Recipe};
use crate::stage::Stage;
use crate::window::Window;

/// Report of one level.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LevelReport {
    /// Voxels along z, y, x.
    pub size: [usize; 3],
    /// Mean over the neighbourhoods of |difference from the most similar one of the exemplar|^0.8, in each iteration.
    /// Methods that use all neighbourhoods equally often have higher energies, so compare energies of one method only.
    pub energies: Vec<f64>,
}

/// A solid and the report of its synthesis.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Solid {
    /// Values (z, y, x, channel); 0 outside the mask. For phases these are their numbers.
    pub values: Array4<f32>,
    /// The pixel from which each voxel is copied, or to which it is nearest: exemplars one after the other, row by row;
    /// [`u32::MAX`] outside the mask.
    pub sources: Array3<u32>,
    /// Levels, the coarsest first.
    pub levels: Vec<LevelReport>,
    /// Fraction of the exemplars' pixels that the solid uses.
    pub coverage: f64,
    /// exp(entropy) of the use of the exemplars' pixels, over their number: 1 if all are used equally often.
    pub perplexity: f64,
    /// Voxels written, over all iterations and levels.
    pub voxel_iterations: u64,
}

/// A solid whose slices look like the exemplars.
///
/// Slices of constant y look like the first exemplar (its rows along z, its columns along x), those of constant x like
/// the second (rows along z, columns along y), and with [`Views::Three`](crate::Views::Three) those of constant z like
/// the third (rows along y, columns along x). One exemplar serves all directions; of two, the second serves x and z.
///
/// Time: 1 to 3 microseconds per voxel, iteration and core for [`Method::Best`](crate::Method::Best) with one channel,
/// by the number of views. Memory: 8 bytes per voxel and view, and 4 bytes per voxel for its source and for each
/// channel.
///
/// # Errors
///
/// [`SolidError`]: too few, too many or too small exemplars, or different channels; options out of range; fixed voxels
/// with values that the exemplars do not have; a cancelled run.
///
/// # References
///
/// urs-2012; Wei & Levoy 2000; Kopf et al. 2007; Chen & Wang 2010. [`Method::Best`](crate::Method::Best): this crate.
///
/// # Examples
///
/// ```
/// use ndarray::Array2;
/// use std::ops::ControlFlow;
/// use stereology_exemplar::{Domain, Exemplar, SolidOptions, Views, synthesize_solid};
///
/// let layers = Array2::from_shape_fn((48, 48), |(z, x)| 0.5 + 0.4 * (0.9 * z as f32 + (0.2 * x as f32).sin()).sin());
/// let exemplar = Exemplar::grey(layers.view())?;
/// let options = SolidOptions::default().with_views(Views::Two).with_iterations(4);
/// let solid = synthesize_solid(&[exemplar], &Domain::new([24; 3])?, &options, &|_| ControlFlow::Continue(()))?;
/// let step = |dz: usize, dx: usize| -> f32 {
///     let moved = |z: usize, y: usize, x: usize| solid.values[[(z + dz) % 24, y, (x + dx) % 24, 0]];
///     solid.values.indexed_iter().map(|((z, y, x, _), v)| (v - moved(z, y, x)).abs()).sum()
/// };
/// assert!(step(1, 0) > 2.0 * step(0, 1), "values change across the layers, not along them");
/// # Ok::<(), stereology_exemplar::SolidError>(())
/// ```
pub fn synthesize_solid(
    exemplars: &[Exemplar],
    domain: &Domain,
    options: &SolidOptions,
    progress: Progress<'_>,
) -> Result<Solid, SolidError> {
    synthesize(exemplars, domain, options, None, progress, &mut |_| ())
}

/// [`synthesize_solid`] that passes the solid to `watch` after each iteration of each level.
///
/// # Errors
///
/// As [`synthesize_solid`].
///
/// # Examples
///
/// Contrast after each iteration (urs-2012, figure 7):
///
/// ```
/// use ndarray::Array2;
/// use std::ops::ControlFlow;
/// use stereology_exemplar::{Domain, Exemplar, SolidOptions, synthesize_solid_watched};
///
/// let layers = Array2::from_shape_fn((32, 32), |(z, x)| 0.5 + 0.4 * (0.9 * z as f32 + (0.2 * x as f32).sin()).sin());
/// let mut deviations = Vec::new();
/// let options = SolidOptions::default().with_iterations(3).with_levels(2);
/// let (exemplar, domain) = ([Exemplar::grey(layers.view())?], Domain::new([12; 3])?);
/// let go = |_: f64| ControlFlow::Continue(());
/// synthesize_solid_watched(&exemplar, &domain, &options, &go, &mut |now| {
///     deviations.push((now.coarser_by, now.number, now.values().std(0.0)));
/// })?;
/// assert_eq!(deviations.len(), 6);
/// assert_eq!((deviations[0].0, deviations[5].0, deviations[5].1), (1, 0, 3));
/// # Ok::<(), stereology_exemplar::SolidError>(())
/// ```
pub fn synthesize_solid_watched(
    exemplars: &[Exemplar],
    domain: &Domain,
    options: &SolidOptions,
    progress: Progress<'_>,
    watch: &mut dyn FnMut(&Iteration<'_>),
) -> Result<Solid, SolidError> {
    synthesize(exemplars, domain, options, None, progress, watch)
}

/// Synthesises a solid; its voxels start with the pixels `begin`, or with random ones if `None`.
pub(crate) fn synthesize(
    exemplars: &[Exemplar],
    domain: &Domain,
    options: &SolidOptions,
    begin: Option<ArrayView3<'_, u32>>,
    progress: Progress<'_>,
    watch: &mut dyn FnMut(&Iteration<'_>),
) -> Result<Solid, SolidError> {
    check(exemplars, domain, options)?;
    let recipe = Recipe::new(options, exemplars[0].phases().is_some());
    let levels = levels(exemplars, domain, options, &recipe)?;
    let views = options.views.count();
    let exemplars = &exemplars[..exemplars.len().min(views)];
    let colours = exemplars[0].inner_colours();
    let atlas = Atlas::new(exemplars);
    let window = Window::new(options.neighbourhood, exemplars[0].channels(), options.causal);
    let stacks: Vec<Vec<Vec<f32>>> = exemplars.iter().map(|exemplar| smoothed(exemplar, levels)).collect();
    let voxels_of = |level: usize| domain.size().map(|n| n.div_ceil(1 << level)).iter().product::<usize>() as f64;
    let all: f64 = (0..levels).map(voxels_of).sum();
    let mut done = 0.0;
    let mut before: Option<(Field, Level)> = None;
    let mut reports = Vec::new();
    let mut voxel_iterations = 0;
    let mut number = levels;
    loop {
        number -= 1;
        let level = Level::new(exemplars, &stacks, &atlas, number, window.half, recipe.thinned);
        let mut field = field_at(domain, number, exemplars, &level);
        match before.take() {
            None => {
                field.begin(&level, views, options.seed);
                if let Some(pixels) = begin {
                    field.begin_with(&level, pixels);
                }
            }
            Some((coarse, from)) => field.refine(&coarse, &from, &level, &atlas, recipe.combine != Combine::Discrete),
        }
        let stage = Stage::new(&level, &atlas, &window, &recipe, options.search, colours);
        let part = voxels_of(number) / all;
        let go_on = |share: f64| progress(done + share * part);
        let ControlFlow::Continue(energies) = iterate(&stage, &mut field, options, &go_on, &mut |field, at, energy| {
            watch(&Iteration {
                coarser_by: number,
                number: at,
                energy,
                field,
                colours,
            });
        }) else {
            return Err(SolidError::Cancelled);
        };
        done += part;
        voxel_iterations += (field.voxels() * energies.len()) as u64;
        reports.push(LevelReport {
            size: field.size,
            energies,
        });
        if number == 0 {
            let labels = exemplars[0].phases().map(|phases| {
                if options.solver() == Solver::Sequential {
                    stage.weigh(&mut field);
                }
                let labels = stage.settle_phases(&mut field, phases.len());
                labels.into_iter().map(|label| phases[usize::from(label)]).collect()
            });
            return Ok(finished(
                field,
                &level,
                &atlas,
                labels,
                colours,
                reports,
                voxel_iterations,
            ));
        }
        before = Some((field, level));
    }
}

/// The iterations of one level, up to the one that changes nothing; returns the energy of each. `watch` receives the
/// field, the number of the iteration (from 1) and its energy.
fn iterate(
    stage: &Stage<'_>,
    field: &mut Field,
    options: &SolidOptions,
    progress: Progress<'_>,
    watch: &mut dyn FnMut(&Field, usize, f64),
) -> ControlFlow<(), Vec<f64>> {
    let order = match options.solver() {
        Solver::Sequential => options.scan.order(field.size, options.seed),
        Solver::Batch => Vec::new(),
    };
    let mut tallies = stage.tally(field);
    let mut energies = Vec::new();
    for iteration in 0..options.iterations {
        let go_on = |share: f64| progress((iteration as f64 + share) / options.iterations as f64);
        go_on(0.0)?;
        let (energy, changed) = match options.solver() {
            Solver::Batch => {
                let energy = stage.search(field, &mut tallies, iteration, &|share| go_on(0.75 * share))?;
                go_on(0.75)?;
                stage.vote(field, &mut tallies, stage.recipe.radius(iteration, options.iterations));
                (energy, true)
            }
            Solver::Sequential => {
                let (energy, changed) = stage.sweep(field, &mut tallies, &order, &go_on)?;
                (energy, changed > 0)
            }
        };
        energies.push(energy);
        watch(field, iteration + 1, energy);
        if !changed {
            break;
        }
    }
    ControlFlow::Continue(energies)
}

/// The result of the finest level; phases have `labels` instead of values.
fn finished(
    field: Field,
    level: &Level,
    atlas: &Atlas,
    labels: Option<Vec<u32>>,
    colours: usize,
    levels: Vec<LevelReport>,
    voxel_iterations: u64,
) -> Solid {
    let [nz, ny, nx] = field.size;
    let channels = if labels.is_some() { 1 } else { colours };
    let values = Array4::from_shape_fn((nz, ny, nx, channels), |(z, y, x, channel)| {
        let voxel = field.index([z, y, x]);
        match &labels {
            _ if !field.holds(voxel) => 0.0,
            Some(labels) => labels[voxel] as f32,
            None => field.values[channel][voxel],
        }
    });
    let sources = Array3::from_shape_fn((nz, ny, nx), |(z, y, x)| {
        let voxel = field.index([z, y, x]);
        if field.holds(voxel) {
            level.pixel[field.sources[voxel] as usize]
        } else {
            NONE
        }
    });
    let mut uses = vec![0_u32; atlas.pixels()];
    sources
        .iter()
        .filter(|s| **s != NONE)
        .for_each(|&s| uses[s as usize] += 1);
    let n = field.voxels() as f64;
    let used = || uses.iter().filter(|uses| **uses > 0);
    let entropy: f64 = used()
        .map(|&uses| -(f64::from(uses) / n) * (f64::from(uses) / n).ln())
        .sum();
    Solid {
        values,
        sources,
        levels,
        coverage: used().count() as f64 / uses.len() as f64,
        perplexity: entropy.exp() / uses.len() as f64,
        voxel_iterations,
    }
}

/// Checks of all inputs.
fn check(exemplars: &[Exemplar], domain: &Domain, options: &SolidOptions) -> Result<(), SolidError> {
    if exemplars.is_empty() || exemplars.len() > 3 {
        return Err(SolidError::Exemplars { found: exemplars.len() });
    }
    let side = options.neighbourhood;
    if side.is_multiple_of(2) || !(3..=15).contains(&side) {
        return Err(SolidError::Neighbourhood { side });
    }
    let in_range = |option, value: usize, range: std::ops::RangeInclusive<usize>, text| {
        if range.contains(&value) {
            Ok(())
        } else {
            Err(SolidError::Option {
                option,
                range: text,
                asked: value,
            })
        }
    };
    in_range("iterations", options.iterations, 1..=1000, "1 to 1000")?;
    in_range("similar pixels", options.similar.unwrap_or(1), 0..=64, "at most 64")?;
    if options.causal && options.solver() == Solver::Batch {
        return Err(SolidError::Mismatch {
            what: "causal neighbourhoods are for the sequential solver: the batch solver visits voxels in no order"
                .to_owned(),
        });
    }
    let first = &exemplars[0];
    options.check_memory(domain.size(), first.channels())?;
    for other in &exemplars[1..] {
        if (other.channels(), other.colours()) != (first.channels(), first.colours()) {
            return Err(SolidError::Mismatch {
                what: format!(
                    "the exemplars must have the same channels, but have {} and {}",
                    first.channels(),
                    other.channels()
                ),
            });
        }
        if other.phases() != first.phases() {
            return Err(SolidError::Mismatch {
                what: format!(
                    "the exemplars must have the same phases, but have {:?} and {:?}",
                    first.phases().unwrap_or_default(),
                    other.phases().unwrap_or_default()
                ),
            });
        }
    }
    if first.channels() > 24 {
        return Err(SolidError::Mismatch {
            what: format!("{} channels: at most 24 can be compared", first.channels()),
        });
    }
    for (at, value) in domain.fixed() {
        let fits = first
            .phases()
            .is_none_or(|phases| value.iter().all(|v| phases.iter().any(|&p| is_phase(*v, p))));
        if value.len() != first.colours() || !fits {
            return Err(SolidError::FixedValue {
                at: *at,
                channels: first.colours(),
                found: value.clone(),
            });
        }
    }
    Ok(())
}

/// Number of levels.
fn levels(
    exemplars: &[Exemplar],
    domain: &Domain,
    options: &SolidOptions,
    recipe: &Recipe,
) -> Result<usize, SolidError> {
    let half = options.neighbourhood / 2;
    let enough = |levels: usize| {
        let step = 1_usize << (levels - 1);
        let fits = |n: usize| {
            if recipe.thinned {
                n.div_ceil(step) >= 2 * half + 2
            } else {
                n >= 2 * half * step + 2
            }
        };
        exemplars.iter().all(|e| fits(e.shape().0) && fits(e.shape().1))
            && (levels == 1 || domain.size().iter().all(|n| n.div_ceil(step) >= 2))
    };
    let most = (1..=10).take_while(|&levels| enough(levels)).count();
    if most == 0 {
        let small = exemplars.iter().min_by_key(|e| e.shape().0.min(e.shape().1));
        let (height, width) = small.map_or((0, 0), Exemplar::shape);
        return Err(SolidError::ExemplarTooSmall {
            height,
            width,
            side: options.neighbourhood,
        });
    }
    match options.levels {
        Some(asked) if !(1..=most).contains(&asked) => Err(SolidError::Levels {
            asked,
            most,
            side: options.neighbourhood,
        }),
        Some(asked) => Ok(asked),
        None => Ok(levels_for(exemplars, options.neighbourhood, most)),
    }
}

/// The initial state of the solid at a level: only the fixed voxels have values.
fn field_at(domain: &Domain, number: usize, exemplars: &[Exemplar], level: &Level) -> Field {
    let step = 1_usize << number;
    let size = domain.size().map(|n| n.div_ceil(step));
    let n: usize = size.iter().product();
    let channels = exemplars[0].channels();
    let mut field = Field {
        size,
        periodic: domain.is_periodic(),
        values: vec![vec![0.0; n]; channels],
        sources: vec![0; n],
        matches: Vec::new(),
        gaps: Vec::new(),
        inside: None,
        fixed: Vec::new(),
        is_fixed: Vec::new(),
    };
    if let Some(mask) = domain.mask() {
        let mut inside = vec![false; n];
        for ((z, y, x), _) in mask.indexed_iter().filter(|(_, inside)| **inside) {
            inside[field.index([z / step, y / step, x / step])] = true;
        }
        field.inside = Some(inside);
    }
    if domain.fixed().is_empty() {
        return field;
    }
    // A coarse voxel gets the mean of the fixed voxels in it.
    let mut sums: std::collections::BTreeMap<u32, (Vec<f32>, f32)> = std::collections::BTreeMap::new();
    for (at, value) in domain.fixed() {
        let inner = inner_value(&exemplars[0], value);
        let voxel = numbered(field.index(at.map(|i| i / step)));
        let entry = sums.entry(voxel).or_insert_with(|| (vec![0.0; inner.len()], 0.0));
        entry.0.iter_mut().zip(&inner).for_each(|(sum, v)| *sum += v);
        entry.1 += 1.0;
    }
    field.is_fixed = vec![false; n];
    for (voxel, (sum, count)) in sums {
        let mut value: Vec<f32> = sum.iter().map(|sum| sum / count).collect();
        let place = nearest_place(level, &value);
        // Features of fixed voxels are those of the most similar pixel.
        value.extend((value.len()..channels).map(|channel| level.value(channel, place)));
        field.sources[voxel as usize] = place;
        field.is_fixed[voxel as usize] = true;
        field.fixed.push((voxel, value));
    }
    field
}

/// The value of a fixed voxel in the channels that are compared.
fn inner_value(exemplar: &Exemplar, value: &[f32]) -> Vec<f32> {
    match exemplar.phases() {
        None => value.to_vec(),
        Some([_, second]) => vec![f32::from(u8::from(is_phase(value[0], *second)))],
        Some(phases) => phases
            .iter()
            .map(|&phase| f32::from(u8::from(is_phase(value[0], phase))))
            .collect(),
    }
}

/// Whether this value is the number of the phase.
fn is_phase(value: f32, phase: u32) -> bool {
    #[allow(clippy::float_cmp, reason = "numbers of phases are whole")]
    let same = value == phase as f32;
    same
}

/// The place whose first channels are nearest to a value.
fn nearest_place(level: &Level, value: &[f32]) -> u32 {
    let distance = |place: u32| -> f32 {
        value
            .iter()
            .enumerate()
            .map(|(channel, v)| (v - level.value(channel, place)).powi(2))
            .sum()
    };
    let places = level.windows.iter().flatten().copied();
    let mut best = (f32::INFINITY, 0);
    for place in places {
        let d = distance(place);
        if d < best.0 {
            best = (d, place);
        }
    }
    best.1
}
