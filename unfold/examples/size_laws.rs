//! Bias and coverage of `unfold` for size distributions of known truth: spheres, sections simulated exactly.
//!
//! `cargo run --release -p stereology-unfold --example size_laws -- [REPEATS [PROFILES,... [LAW,...|all [METHOD
//! [REPLICATES [SEED [LARGEST]]]]]]]`
//!
//! One row per distribution and number of profiles: bias, standard deviation and coverage (nominal 90 %) of the
//! total, the mean size and the volume fraction, coverage of the bins on average, the mean |error| of the total, the
//! L1 distance of the histograms normalised by number, and milliseconds per fit. The largest size is that of the
//! largest profile, or LARGEST. No intervals are computed if REPLICATES is 0.
#![allow(
    clippy::print_stdout,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a study prints its table; counts are far below 2^53"
)]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Gamma, Poisson, StandardNormal, Weibull};
use std::error::Error;
use std::f64::consts::PI;
use std::time::Instant;
use stereology_unfold::{
    Bootstrap, Estimate, Method, ProfileCounts, SizeBins, UnfoldOptions, Unfolding, capped_kernel, equal_edges,
    fitting_edges, fitting_profile_edges, profile_findings, smallest_size, unfold,
};

const LAWS: [&str; 18] = [
    "lognormal.3",
    "lognormal.5",
    "lognormal.8",
    "lognormal1",
    "gamma1.5",
    "gamma2",
    "weibull1.5",
    "power",
    "trimodal",
    "spike+tail",
    "monodisperse",
    "fines",
    "constant",
    "single",
    "bimodal",
    "lognormal.45",
    "two bands",
    "band+mode",
];

/// One size of a distribution.
fn size(law: &str, rng: &mut ChaCha8Rng) -> f64 {
    let normal: f64 = StandardNormal.sample(rng);
    let uniform: f64 = rng.random();
    let gamma = |shape: f64, rng: &mut ChaCha8Rng| Gamma::new(shape, 1.0 / shape).map_or(1.0, |law| law.sample(rng));
    match law {
        "lognormal.3" => (0.3 * normal).exp(),
        "lognormal.5" => (0.5 * normal).exp(),
        "lognormal.8" => (0.8 * normal).exp(),
        "lognormal1" => normal.exp(),
        "gamma1.5" => gamma(1.5, rng),
        "gamma2" => gamma(2.0, rng),
        "weibull1.5" => Weibull::new(1.0, 1.5).map_or(1.0, |law| law.sample(rng)),
        // Density as D^-2.5 from 0.1 to 1.
        "power" => (0.1_f64.powf(-1.5) + uniform * (1.0 - 0.1_f64.powf(-1.5))).powf(-1.0 / 1.5),
        "trimodal" => {
            let middle = if uniform < 0.5 {
                0.3
            } else if uniform < 0.8 {
                0.6
            } else {
                1.0
            };
            middle * (1.0 + 0.05 * normal)
        }
        "spike+tail" => {
            if uniform < 0.6 {
                0.5 * (1.0 + 0.02 * normal)
            } else {
                0.5 * (0.4 * normal).exp()
            }
        }
        "fines" => {
            if uniform < 0.7 {
                0.1 * (0.3 * normal).exp()
            } else {
                (0.2 * normal).exp()
            }
        }
        // Those of figure 7, and a narrow band on a broad mode.
        "constant" => uniform,
        "single" => within(0.55 + 0.15 * normal, rng, law),
        "bimodal" => within(if uniform < 0.5 { 0.3 } else { 0.75 } + 0.08 * normal, rng, law),
        "lognormal.45" => within(0.3 * (0.45 * normal).exp(), rng, law),
        "two bands" => 0.1 * (uniform + if rng.random::<f64>() < 0.5 { 3.0 } else { 7.0 }),
        "band+mode" if uniform < 0.3 => 0.7 + 0.05 * rng.random::<f64>(),
        "band+mode" => within(0.5 + 0.15 * normal, rng, law),
        _ => 0.5,
    }
}

/// The size if it lies in (0, 1], else another one.
fn within(drawn: f64, rng: &mut ChaCha8Rng, law: &str) -> f64 {
    if drawn > 0.0 && drawn <= 1.0 {
        drawn
    } else {
        size(law, rng)
    }
}

/// A distribution, its moments, and a table of sizes drawn in proportion to the size.
struct Law {
    name: &'static str,
    mean: f64,
    cube: f64,
    /// Sizes, and their running sum.
    drawn: Vec<f64>,
    running: Vec<f64>,
    sorted: Vec<f64>,
}

impl Law {
    fn new(name: &'static str) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let drawn: Vec<f64> = (0..2_000_000).map(|_| size(name, &mut rng)).collect();
        let mut sum = 0.0;
        let running: Vec<f64> = drawn
            .iter()
            .map(|d| {
                sum += d;
                sum
            })
            .collect();
        let count = drawn.len() as f64;
        let mut sorted = drawn.clone();
        sorted.sort_by(f64::total_cmp);
        Self {
            name,
            mean: sum / count,
            cube: drawn.iter().map(|d| d.powi(3)).sum::<f64>() / count,
            sorted,
            drawn,
            running,
        }
    }

    /// A Poisson number of profiles of one sphere per unit volume, and the area they lie on.
    fn profiles(&self, expected: f64, rng: &mut ChaCha8Rng) -> (Vec<f64>, f64) {
        let count = Poisson::new(expected).map_or(0.0, |law| law.sample(rng)) as usize;
        let whole = self.running[self.running.len() - 1];
        let profiles = (0..count).map(|_| {
            let share = whole * rng.random::<f64>();
            let at = self.running.partition_point(|&sum| sum < share);
            let depth: f64 = rng.random();
            self.drawn[at] * (1.0 - depth * depth).sqrt()
        });
        (profiles.collect(), expected / self.mean)
    }

    /// Fractions of the particles in bins; the last holds larger ones too.
    fn fractions(&self, edges: &[f64]) -> Vec<f64> {
        let below = |size: f64| self.sorted.partition_point(|&of| of <= size) as f64;
        let last = edges.len() - 1;
        let upper = |k: usize| if k == last { f64::INFINITY } else { edges[k] };
        (0..last)
            .map(|k| (below(upper(k + 1)) - below(edges[k])) / self.sorted.len() as f64)
            .collect()
    }
}

/// How samples are fitted.
#[derive(Clone, Copy)]
struct Fitting {
    method: Method,
    replicates: usize,
    largest: Option<f64>,
}

fn fit(profiles: &[f64], area: f64, seed: u64, of: Fitting) -> Result<Unfolding, Box<dyn Error>> {
    let observed = profiles.iter().copied().fold(0.0, f64::max);
    let largest = of.largest.unwrap_or(observed);
    let edges = equal_edges(largest, 10);
    let smallest = smallest_size(profiles);
    let top = of.largest.unwrap_or(1.5 * largest);
    let bins = SizeBins::integrated(&fitting_edges(&edges, smallest, 0.0, top))?.reported_in(&edges)?;
    let profile_edges = fitting_profile_edges(&edges, 100, smallest, 0.0, top);
    let law = |x: f64| 1.0 - (1.0 - x.min(1.0).powi(2)).sqrt();
    let spheres = capped_kernel(&law, 1.0, 0.0, &profile_edges, bins, PI / 6.0)?.with_profile_law(law);
    let counts = ProfileCounts::from_sizes(profiles, None, &profile_edges, area)?;
    let mut options = UnfoldOptions::default().with_method(of.method);
    if of.replicates > 0 {
        options = options.with_bootstrap(Bootstrap {
            seed,
            replicates: of.replicates,
            ..Bootstrap::default()
        });
    }
    Ok(unfold(&counts, &spheres, &options)?)
}

#[derive(Default)]
struct Tally {
    errors: Vec<f64>,
    covered: usize,
}

impl Tally {
    fn add(&mut self, estimate: Estimate, truth: f64) {
        self.errors.push(estimate.value / truth - 1.0);
        let holds = estimate
            .interval
            .is_some_and(|of| of.lower <= truth && truth <= of.upper);
        self.covered += usize::from(holds);
    }

    fn show(&self) -> String {
        let n = self.errors.len() as f64;
        let mean = self.errors.iter().sum::<f64>() / n;
        let spread = (self.errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        format!(
            "{:+6.1} {:5.1} {:.2}",
            100.0 * mean,
            100.0 * spread,
            self.covered as f64 / n
        )
    }

    fn mean_absolute(&self) -> f64 {
        self.errors.iter().map(|error| error.abs()).sum::<f64>() / self.errors.len() as f64
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let repeats: u64 = arguments.next().map_or(Ok(40), |text| text.parse())?;
    let profiles = arguments.next().unwrap_or_else(|| "50,200,1000,5000".to_owned());
    let wanted = arguments.next().filter(|laws| laws != "all");
    let method = match arguments.next().as_deref() {
        None | Some("auto") => Method::Auto,
        Some("em") => Method::Em,
        Some("penalised") => Method::Penalised,
        Some(other) => return Err(format!("no method {other}").into()),
    };
    let replicates = arguments.next().map_or(Ok(200), |text| text.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(11), |text| text.parse())?;
    let largest = arguments.next().map(|text| text.parse()).transpose()?;
    let how = Fitting {
        method,
        replicates,
        largest,
    };
    println!(
        "law           profiles |   total          |   mean size      |   volume frac.   |  A_A   | bins    L1  sparse alarms ms"
    );
    for name in LAWS {
        if wanted
            .as_ref()
            .is_some_and(|wanted| !wanted.split(',').any(|one| one == name))
        {
            continue;
        }
        let law = Law::new(name);
        for expected in profiles.split(',') {
            let expected: f64 = expected.parse()?;
            let (mut total, mut mean, mut volume) = (Tally::default(), Tally::default(), Tally::default());
            let (mut bins_held, mut bins, mut sparse, mut seconds) = (0_u32, 0_u32, 0_usize, 0.0);
            let (mut distance, mut area_fraction, mut alarms) = (0.0, 0.0, 0_usize);
            for repeat in 0..repeats {
                let mut rng = ChaCha8Rng::seed_from_u64(seed + 1000 * repeat);
                rng.set_stream(expected as u64);
                let (sizes, area) = law.profiles(expected, &mut rng);
                let start = Instant::now();
                let found = fit(&sizes, area, repeat, how)?;
                seconds += start.elapsed().as_secs_f64();
                total.add(found.total, 1.0);
                mean.add(found.mean_size, law.mean);
                volume.add(found.volume_fraction, PI / 6.0 * law.cube);
                area_fraction += found.area_fraction.observed / (PI / 6.0 * law.cube) - 1.0;
                // Findings that something is wrong with data or model. V_V is above 1 for some distributions by
                // construction.
                let wrong = [
                    "poor-fit",
                    "missing-fines",
                    "outlier",
                    "rounded-sizes",
                    "duplicate-rows",
                ];
                let data = profile_findings(&sizes, None, f64::MAX);
                alarms += usize::from(found.findings.iter().chain(&data).any(|of| wrong.contains(&of.code)));
                sparse += usize::from(found.method.name() == "sparse");
                let truth = law.fractions(&found.edges);
                for (density, truth) in found.number_density.iter().zip(&truth) {
                    distance += (density.unwrap_or(0.0) / found.total.value - truth).abs();
                }
                for (interval, &truth) in found.intervals.iter().flatten().zip(&truth) {
                    if let Some(of) = interval
                        && truth > 0.0
                    {
                        bins += 1;
                        bins_held += u32::from(of.lower <= truth && truth <= of.upper);
                    }
                }
            }
            println!(
                "{:13} {:8} | {} | {} | {} | {:+6.1} | {:.2} {:.4} {:.4} {sparse:3}/{repeats:3} {alarms:3} {:.1}",
                law.name,
                expected,
                total.show(),
                mean.show(),
                volume.show(),
                100.0 * area_fraction / repeats as f64,
                f64::from(bins_held) / f64::from(bins.max(1)),
                total.mean_absolute(),
                distance / repeats as f64,
                1e3 * seconds / repeats as f64
            );
        }
    }
    Ok(())
}
