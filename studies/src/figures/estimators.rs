//! Tables of the estimators on figure 7's distributions: errors, coverage of the intervals, and times.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use rayon::prelude::*;
use stereology::kmatrix::Sizes;
use stereology::pipeline::{ParticleTypes, UnfoldingBins};
use stereology::unfold::{
    Bootstrap, Estimate, Interval, Kernel, Method, ProfileCounts, Resampling, UnfoldOptions, Unfolding, equal_edges,
    unfold,
};

use super::grain_size_tools::saltykov;
use super::sphere_samples::{AREA, BAND_ON_MODE, Diameters, FEW, FIGURE_7, Population, Profiles, TWO_BANDS, scores};

const BINS: usize = 10;
const SEEDS: u64 = 200;
/// Size of the smallest of so many profiles, about.
const SMALLEST: f64 = 0.02;

/// An estimator and its bins.
struct Estimator {
    name: &'static str,
    method: Method,
    sizes: Sizes,
    profile_edges: Vec<f64>,
    kernel: Kernel,
}

impl Estimator {
    fn new(name: &'static str, method: Method, sizes: Sizes, profile_bins: Option<usize>) -> Result<Self> {
        let edges = equal_edges(1.0, BINS);
        let mut bins = UnfoldingBins::for_profiles(&edges, SMALLEST, 0.0, 1.0, method, sizes);
        if let Some(profile_bins) = profile_bins {
            bins.profile_edges = equal_edges(1.0, profile_bins);
        }
        let types = ParticleTypes::parse(&["sphere"])?;
        let kernel = types
            .kernel(&bins.profile_edges, &bins.size_edges, sizes)?
            .reported_in(&edges)?;
        Ok(Self {
            name,
            method,
            sizes,
            profile_edges: bins.profile_edges,
            kernel,
        })
    }

    fn unfold(&self, profiles: &Profiles, bootstrap: Option<Bootstrap>) -> Result<Unfolding> {
        let Profiles { sizes, planes, .. } = profiles;
        let counts = ProfileCounts::from_slices(sizes, None, planes, &self.profile_edges, AREA)?;
        let options = UnfoldOptions {
            method: self.method,
            bootstrap,
            ..UnfoldOptions::default()
        };
        Ok(unfold(&counts, &self.kernel, &options)?)
    }
}

fn densities(found: &Unfolding) -> Vec<f64> {
    found.number_density.iter().map(|n| n.unwrap_or(0.0)).collect()
}

/// Mean scores over samples.
fn mean(all: &[[f64; 3]]) -> String {
    let of = |k: usize| all.iter().map(|score| score[k]).sum::<f64>() / all.len() as f64;
    format!("{:.3},{:.3},{:.3}", of(0), of(1), of(2))
}

/// The table of errors: |error of the total|, L1 by number, L1 by volume, mean of 200 samples.
pub fn draw_errors(folder: &Path) -> Result<()> {
    let estimators = [
        Estimator::new("the paper's inverse", Method::Paper, Sizes::UpperEdge, None)?,
        Estimator::new("least squares", Method::Nnls, Sizes::UpperEdge, Some(BINS))?,
        Estimator::new("em with ten profile bins", Method::Em, Sizes::Integrated, Some(BINS))?,
        Estimator::new("em", Method::Em, Sizes::Integrated, None)?,
        Estimator::new("ems", Method::Ems, Sizes::Integrated, None)?,
        Estimator::new("penalised", Method::Penalised, Sizes::Integrated, None)?,
        Estimator::new("sparse", Method::Sparse, Sizes::Integrated, None)?,
        Estimator::new("auto", Method::Auto, Sizes::Integrated, None)?,
    ];
    let mut text = String::from("distribution,estimator,total,l1_number,l1_volume,sparse_chosen\n");
    for of in FIGURE_7.iter().chain([&TWO_BANDS, &BAND_ON_MODE, &FEW]) {
        let population = of.population();
        let truth = population.densities(BINS);
        for estimator in &estimators {
            let found = (0..SEEDS)
                .into_par_iter()
                .map(|seed| estimator.unfold(&population.profiles(seed), None))
                .collect::<Result<Vec<_>>>()?;
            let all: Vec<[f64; 3]> = found.iter().map(|found| scores(&densities(found), &truth)).collect();
            let sparse = found.iter().filter(|found| found.method == Method::Sparse).count();
            let kernel = if estimator.sizes == Sizes::UpperEdge {
                "upper edge"
            } else {
                "integrated"
            };
            writeln!(
                text,
                "{},{} ({kernel}),{},{sparse}",
                of.name,
                estimator.name,
                mean(&all)
            )?;
        }
        let all: Vec<[f64; 3]> = (0..SEEDS)
            .map(|seed| {
                // On common classes, although the program itself ends them at the largest profile. It estimates no
                // total.
                scores(&saltykov(&population.profiles(seed).sizes, 1.0, BINS), &truth)
            })
            .collect();
        let line = mean(&all);
        let rest = line.split_once(',').map_or("", |(_, rest)| rest);
        writeln!(text, "{},GrainSizeTools,,{rest},0", of.name)?;
        let floor: Vec<[f64; 3]> = (0..SEEDS)
            .map(|seed| scores(&by_cut_spheres(&population, seed), &truth))
            .collect();
        writeln!(
            text,
            "{},diameters of the cut spheres known,{},0",
            of.name,
            mean(&floor)
        )?;
    }
    print!("{text}");
    Ok(fs::write(folder.join("estimators.csv"), text)?)
}

/// The least possible error: every profile with the diameter of its sphere, weighted by 1 / D.
fn by_cut_spheres(population: &Population, seed: u64) -> Vec<f64> {
    let mut found = vec![0.0; BINS];
    for diameter in population.profiles(seed).cut {
        let bin = ((diameter * BINS as f64).ceil() as usize).clamp(1, BINS) - 1;
        found[bin] += 1.0 / (AREA * diameter);
    }
    found
}

/// Which intervals contain the true value.
#[derive(Clone, Copy, Default)]
struct Held {
    total: f64,
    mean_size: f64,
    volume_fraction: f64,
    bins: f64,
    worst_bin: [f64; BINS],
}

fn holds(interval: Option<Interval>, truth: f64) -> f64 {
    f64::from(u8::from(
        interval.is_some_and(|of| of.lower <= truth && truth <= of.upper),
    ))
}

/// The table of coverage: how often nominal 90 % intervals of 200 replicates contain the true value, 200 samples per
/// distribution.
pub fn draw_coverage(folder: &Path) -> Result<()> {
    let auto = Estimator::new("auto", Method::Auto, Sizes::Integrated, None)?;
    let mut text = String::from("drawn,distribution,total,mean_size,volume_fraction,bins,worst_bin,width_of_total\n");
    for (drawn, resampling) in [("counts", Resampling::Counts), ("slices", Resampling::Slices)] {
        let mut pooled = [0.0; 4];
        for (index, of) in FIGURE_7.iter().chain([&TWO_BANDS]).enumerate() {
            let (held, width) = coverage(&auto, of, 10_000 * (index as u64 + 1), resampling)?;
            let worst = held.worst_bin.iter().copied().fold(1.0, f64::min);
            let values = [held.total, held.mean_size, held.volume_fraction, held.bins];
            if index < FIGURE_7.len() {
                pooled
                    .iter_mut()
                    .zip(values)
                    .for_each(|(sum, value)| *sum += value / FIGURE_7.len() as f64);
            }
            writeln!(
                text,
                "{drawn},{},{:.3},{:.3},{:.3},{:.3},{worst:.3},{width:.3}",
                of.name, values[0], values[1], values[2], values[3]
            )?;
            if index + 1 == FIGURE_7.len() {
                writeln!(
                    text,
                    "{drawn},the four pooled,{:.3},{:.3},{:.3},{:.3},,",
                    pooled[0], pooled[1], pooled[2], pooled[3]
                )?;
            }
        }
    }
    print!("{text}");
    Ok(fs::write(folder.join("coverage.csv"), text)?)
}

fn coverage(estimator: &Estimator, of: &Diameters, first_seed: u64, resampling: Resampling) -> Result<(Held, f64)> {
    let population = of.population();
    let truth = population.densities(BINS);
    let all = (0..SEEDS)
        .into_par_iter()
        .map(|seed| {
            let bootstrap = Bootstrap {
                seed,
                resampling,
                ..Bootstrap::default()
            };
            estimator.unfold(&population.profiles(first_seed + seed), Some(bootstrap))
        })
        .collect::<Result<Vec<_>>>()?;
    let (mut held, mut width) = (Held::default(), 0.0);
    let share = 1.0 / SEEDS as f64;
    for found in &all {
        let held_by = |estimate: Estimate, truth: f64| share * holds(estimate.interval, truth);
        held.total += held_by(found.total, population.number_density);
        held.mean_size += held_by(found.mean_size, population.mean);
        held.volume_fraction += held_by(found.volume_fraction, population.volume_fraction);
        for (j, interval) in found.intervals.iter().flatten().enumerate() {
            let yes = share * holds(*interval, truth[j]);
            held.bins += yes / BINS as f64;
            held.worst_bin[j] += yes;
        }
        width += found.total.interval.map_or(0.0, |of| of.upper - of.lower) / population.number_density * share;
    }
    Ok((held, width))
}

/// Number of samples over which a time is averaged.
const TIMED: u64 = 20;
/// Seconds to fill with runs, as CPU time is counted in hundredths of a second.
const LONG_ENOUGH: f64 = 0.5;

/// CPU seconds of this process as Linux counts them, which other work on the machine changes little; wall time on other
/// systems.
fn processor_seconds(since: Instant) -> f64 {
    let ticks = fs::read_to_string("/proc/self/stat").ok().and_then(|stat| {
        // After the name in brackets, the state is the first field and the user time the twelfth.
        stat.rsplit_once(')')?.1.split_whitespace().nth(11)?.parse::<f64>().ok()
    });
    ticks.map_or_else(|| since.elapsed().as_secs_f64(), |ticks| 0.01 * ticks)
}

/// The table of times on one thread: a default fit, one with 200 replicates, and a million profiles counted and fitted;
/// milliseconds of CPU time.
pub fn draw_speed(folder: &Path) -> Result<()> {
    let auto = Estimator::new("auto", Method::Auto, Sizes::Integrated, None)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let clock = Instant::now();
    // The samples in turn, until the time is long enough; then the mean.
    let mean = |samples: &[Profiles], bootstrap: Option<Bootstrap>| -> Result<f64> {
        let start = processor_seconds(clock);
        let mut runs = 0.0;
        loop {
            for of in samples {
                pool.install(|| auto.unfold(of, bootstrap))?;
                runs += 1.0;
            }
            let spent = processor_seconds(clock) - start;
            if spent > LONG_ENOUGH {
                return Ok(1e3 * spent / runs);
            }
        }
    };
    let mut text = String::from("distribution,fit_ms,fit_with_200_replicates_ms\n");
    for of in FIGURE_7.iter().chain([&TWO_BANDS, &BAND_ON_MODE]) {
        let population = of.population();
        let samples: Vec<Profiles> = (0..TIMED).map(|seed| population.profiles(seed)).collect();
        let (fit, replicated) = (mean(&samples, None)?, mean(&samples[..4], Some(Bootstrap::default()))?);
        writeln!(text, "{},{fit:.2},{replicated:.1}", of.name)?;
    }
    let million = Profiles {
        sizes: (1..=1_000_000).map(|k| f64::from(k) / 1e6).collect(),
        planes: (0..1_000_000).map(|k| k % 10).collect(),
        cut: Vec::new(),
    };
    writeln!(text, "a million profiles,{:.1},", mean(&[million], None)?)?;
    print!("{text}");
    Ok(fs::write(folder.join("speed.csv"), text)?)
}
