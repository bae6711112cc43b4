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
use stereology_unfold::{ProfileCounts, UnfoldOptions, profile_findings, unfold};

const LAWS: [&str; 8] = [
    "lognormal.3",
    "lognormal.5",
    "lognormal.8",
    "gamma2",
    "weibull1.5",
    "trimodal",
    "constant",
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

/// Codes of all warnings of a fit of spheres.
fn codes(sizes: &[f64], area: f64) -> Result<Vec<&'static str>, Box<dyn Error>> {
    let (profile_edges, spheres) = spheres(sizes, None)?;
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
                let sizes = law.profiles(expected, &mut rng);
                // Profiles, of mean area (2/3) π/4 <D³>/<D>, cover 40 % of it on average.
                let area = expected * PI / 6.0 * law.cube / law.mean / 0.4;
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
