//! How often warnings are raised: data that follow the model, and data that were altered. Spheres, sections simulated
//! exactly.
//!
//! `cargo run --release -p stereology-unfold --example misfits -- [REPEATS [PROFILES,... [LAW,...|all]]]`
//!
//! One row per distribution and number of profiles; the columns are percentages of samples with a warning that concerns
//! the kind of alteration ("none": any warning of bad data).
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
use stereology_unfold::{
    ProfileCounts, SizeBins, UnfoldOptions, capped_kernel, equal_edges, fitting_edges, fitting_profile_edges,
    profile_findings, unfold,
};

const LAWS: [&str; 8] = [
    "lognormal.3",
    "lognormal.5",
    "lognormal.8",
    "gamma2",
    "weibull1.5",
    "trimodal",
    "uniform",
    "fines",
];

/// Warnings of bad data.
const BAD: [&str; 6] = [
    "poor-fit",
    "missing-fines",
    "outlier",
    "rounded-sizes",
    "duplicate-rows",
    "impossible-area",
];

/// An alteration of sizes and area.
type Alteration = fn(&mut Vec<f64>, &mut f64);

/// Name, alteration, and the warnings that concern it.
const ALTERATIONS: [(&str, Alteration, &[&str]); 13] = [
    ("none", |_, _| {}, &BAD),
    (
        "x 100",
        |sizes, area| (outlier(sizes, 100.0), *area *= 1e6).0,
        &["outlier", "poor-fit"],
    ),
    (
        "x 10",
        |sizes, area| (outlier(sizes, 10.0), *area *= 1e3).0,
        &["outlier", "poor-fit"],
    ),
    (
        "x 3",
        |sizes, area| (outlier(sizes, 3.0), *area *= 1e2).0,
        &["outlier", "poor-fit"],
    ),
    (
        "to .25",
        |sizes, _| rounded(sizes, 0.25),
        &["rounded-sizes", "poor-fit"],
    ),
    (
        "to .05",
        |sizes, _| rounded(sizes, 0.05),
        &["rounded-sizes", "poor-fit"],
    ),
    ("pixels", |sizes, _| in_pixels(sizes), &["rounded-sizes", "poor-fit"]),
    (
        "twice",
        |sizes, area| (repeat(sizes, 1), *area *= 2.0).0,
        &["duplicate-rows"],
    ),
    ("a fifth twice", |sizes, _| repeat(sizes, 5), &["duplicate-rows"]),
    ("> .1 mean", |sizes, _| cut(sizes, 0.1), &["missing-fines", "poor-fit"]),
    ("> .3 mean", |sizes, _| cut(sizes, 0.3), &["missing-fines", "poor-fit"]),
    (
        "> .75 mean",
        |sizes, _| cut(sizes, 0.75),
        &["missing-fines", "poor-fit"],
    ),
    (
        "area .8",
        |sizes, area| *area = 0.8 * covered(sizes),
        &["impossible-area"],
    ),
];

fn outlier(sizes: &mut Vec<f64>, factor: f64) {
    sizes.push(factor * sizes.iter().copied().fold(0.0, f64::max));
}

fn rounded(sizes: &mut [f64], step: f64) {
    sizes
        .iter_mut()
        .for_each(|size| *size = step * (*size / step).round().max(1.0));
}

/// In pixels of which the mean profile has twenty.
fn in_pixels(sizes: &mut [f64]) {
    let pixel = mean(sizes) / 20.0;
    rounded(sizes, pixel);
}

/// Every size of index 0, `every`, ... a second time.
fn repeat(sizes: &mut Vec<f64>, every: usize) {
    let repeated: Vec<f64> = sizes.iter().copied().step_by(every).collect();
    sizes.extend(repeated);
}

fn mean(sizes: &[f64]) -> f64 {
    sizes.iter().sum::<f64>() / sizes.len() as f64
}

/// Sizes above a fraction of the mean profile.
fn cut(sizes: &mut Vec<f64>, fraction: f64) {
    let smallest = fraction * mean(sizes);
    sizes.retain(|size| *size > smallest);
}

fn covered(sizes: &[f64]) -> f64 {
    sizes.iter().map(|size| 0.25 * PI * size * size).sum()
}

/// One size of a distribution.
fn size(law: &str, rng: &mut ChaCha8Rng) -> f64 {
    let normal: f64 = StandardNormal.sample(rng);
    let uniform: f64 = rng.random();
    match law {
        "lognormal.5" => (0.5 * normal).exp(),
        "lognormal.8" => (0.8 * normal).exp(),
        "gamma2" => Gamma::new(2.0, 0.5).map_or(1.0, |law| law.sample(rng)),
        "weibull1.5" => Weibull::new(1.0, 1.5).map_or(1.0, |law| law.sample(rng)),
        "trimodal" => {
            [0.3, 0.3, 0.3, 0.3, 0.3, 0.6, 0.6, 0.6, 1.0, 1.0][(10.0 * uniform) as usize] * (1.0 + 0.05 * normal)
        }
        "uniform" => uniform,
        "fines" if uniform < 0.7 => 0.1 * (0.3 * normal).exp(),
        "fines" => (0.2 * normal).exp(),
        _ => (0.3 * normal).exp(),
    }
}

/// A distribution: sizes drawn from it, and their running sum.
struct Law {
    drawn: Vec<f64>,
    running: Vec<f64>,
}

impl Law {
    fn new(name: &str) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let drawn: Vec<f64> = (0..1_000_000).map(|_| size(name, &mut rng)).collect();
        let running = drawn.iter().scan(0.0, |sum, size| {
            *sum += size;
            Some(*sum)
        });
        Self {
            running: running.collect(),
            drawn,
        }
    }

    /// A Poisson number of profiles, and an area that they cover to 40 % on average.
    fn profiles(&self, expected: f64, rng: &mut ChaCha8Rng) -> (Vec<f64>, f64) {
        let count = Poisson::new(expected).map_or(0.0, |law| law.sample(rng)) as usize;
        let whole = self.running[self.running.len() - 1];
        let profiles = (0..count).map(|_| {
            let share = whole * rng.random::<f64>();
            let at = self.running.partition_point(|&sum| sum < share);
            let depth: f64 = rng.random();
            self.drawn[at] * (1.0 - depth * depth).sqrt()
        });
        let cubes: f64 = self.drawn.iter().map(|size| size.powi(3)).sum();
        // Mean area of a profile: (2/3) π/4 <D³>/<D>.
        (profiles.collect(), expected * PI / 6.0 * cubes / whole / 0.4)
    }
}

/// Codes of all warnings of a fit of spheres.
fn codes(sizes: &[f64], area: f64) -> Result<Vec<&'static str>, Box<dyn Error>> {
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let smallest = sizes.iter().copied().fold(largest, f64::min);
    let edges = equal_edges(largest, 10);
    let bins = SizeBins::integrated(&fitting_edges(&edges, smallest, 0.0, 0.0))?.reported_in(&edges)?;
    let profile_edges = fitting_profile_edges(&edges, 100, smallest, 0.0, 0.0);
    let law = |x: f64| 1.0 - (1.0 - x.min(1.0).powi(2)).sqrt();
    let spheres = capped_kernel(&law, 1.0, 0.0, &profile_edges, bins, PI / 6.0)?;
    let counts = ProfileCounts::from_sizes(sizes, None, &profile_edges, area)?;
    let found = unfold(&counts, &spheres, &UnfoldOptions::default())?;
    let findings = found.findings.into_iter().chain(profile_findings(sizes, None, area));
    Ok(findings.map(|of| of.code).collect())
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let repeats: u64 = arguments.next().map_or(Ok(40), |text| text.parse())?;
    let profiles = arguments.next().unwrap_or_else(|| "50,200,600,5000".to_owned());
    let wanted = arguments.next().filter(|laws| laws != "all");
    let names: Vec<&str> = ALTERATIONS.iter().map(|of| of.0).collect();
    println!("| sizes | profiles | {} |", names.join(" | "));
    println!("|---|---|{}", "---|".repeat(names.len()));
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
            let mut raised = [0_u32; ALTERATIONS.len()];
            for repeat in 0..repeats {
                let mut rng = ChaCha8Rng::seed_from_u64(31 + 1000 * repeat);
                rng.set_stream(expected as u64);
                let (sizes, area) = law.profiles(expected, &mut rng);
                for (raised, (_, alter, concerning)) in raised.iter_mut().zip(&ALTERATIONS) {
                    let (mut sizes, mut area) = (sizes.clone(), area);
                    alter(&mut sizes, &mut area);
                    let codes = codes(&sizes, area)?;
                    *raised += u32::from(codes.iter().any(|code| concerning.contains(code)));
                }
            }
            let shares = raised.map(|of| format!("{:.0}", 100.0 * f64::from(of) / repeats as f64));
            println!("| {name} | {expected} | {} |", shares.join(" | "));
        }
    }
    Ok(())
}
