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

#[path = "designs/laws.rs"]
mod laws;
#[path = "designs/spheres.rs"]
mod spheres;

use laws::Law;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use spheres::spheres;
use std::error::Error;
use std::f64::consts::PI;
use std::time::Instant;
use stereology_unfold::{
    Bootstrap, Estimate, Method, ProfileCounts, UnfoldOptions, Unfolding, profile_findings, unfold,
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

/// Fractions of sorted sizes in bins; the last holds larger ones too.
fn fractions(sorted: &[f64], edges: &[f64]) -> Vec<f64> {
    let below = |size: f64| sorted.partition_point(|&of| of <= size) as f64;
    let last = edges.len() - 1;
    let upper = |k: usize| if k == last { f64::INFINITY } else { edges[k] };
    (0..last)
        .map(|k| (below(upper(k + 1)) - below(edges[k])) / sorted.len() as f64)
        .collect()
}

/// How samples are fitted.
#[derive(Clone, Copy)]
struct Fitting {
    method: Method,
    replicates: usize,
    largest: Option<f64>,
}

fn fit(profiles: &[f64], area: f64, seed: u64, of: Fitting) -> Result<Unfolding, Box<dyn Error>> {
    let (profile_edges, spheres) = spheres(profiles, of.largest)?;
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
        let mut sorted = law.drawn.clone();
        sorted.sort_by(f64::total_cmp);
        for expected in profiles.split(',') {
            let expected: f64 = expected.parse()?;
            let (mut total, mut mean, mut volume) = (Tally::default(), Tally::default(), Tally::default());
            let (mut bins_held, mut bins, mut sparse, mut seconds) = (0_u32, 0_u32, 0_usize, 0.0);
            let (mut distance, mut area_fraction, mut alarms) = (0.0, 0.0, 0_usize);
            for repeat in 0..repeats {
                let mut rng = ChaCha8Rng::seed_from_u64(seed + 1000 * repeat);
                rng.set_stream(expected as u64);
                let sizes = law.profiles(expected, &mut rng);
                // One sphere per unit volume.
                let area = expected / law.mean;
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
                let truth = fractions(&sorted, &found.edges);
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
                name,
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
