//! Data that contradict the model raise a finding; data that follow it do not.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::PI;
use stereology_unfold::{
    Finding, ProfileCounts, SizeBins, UnfoldOptions, capped_kernel, equal_edges, fitting_edges, fitting_profile_edges,
    profile_findings, unfold,
};

/// Profiles of spheres with lognormal sizes (σ = 0.3), one sphere per unit volume on average, and the area they are on.
fn profiles(seed: u64, count: u32) -> (Vec<f64>, f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // Spheres are cut in proportion to their diameter, which shifts a lognormal distribution by σ².
    let size = |rng: &mut ChaCha8Rng| {
        let normal: f64 = StandardNormal.sample(rng);
        let depth: f64 = rng.random();
        (0.3 * normal + 0.09).exp() * (1.0 - depth * depth).sqrt()
    };
    let sizes = (0..count).map(|_| size(&mut rng)).collect();
    (sizes, f64::from(count) / 0.045_f64.exp())
}

fn findings(sizes: &[f64], area: f64) -> Vec<Finding> {
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let smallest = sizes.iter().copied().fold(largest, f64::min);
    let edges = equal_edges(largest, 10);
    let bins = SizeBins::integrated(&fitting_edges(&edges, smallest, 0.0, 0.0)).unwrap();
    let profile_edges = fitting_profile_edges(&edges, 100, smallest, 0.0, 0.0);
    let law = |x: f64| 1.0 - (1.0 - x.min(1.0).powi(2)).sqrt();
    let bins = bins.reported_in(&edges).unwrap();
    let kernel = capped_kernel(&law, 1.0, 0.0, &profile_edges, bins, PI / 6.0).unwrap();
    let counts = ProfileCounts::from_sizes(sizes, None, &profile_edges, area).unwrap();
    let mut findings = unfold(&counts, &kernel, &UnfoldOptions::default()).unwrap().findings;
    findings.extend(profile_findings(sizes, None, area));
    findings
}

fn has(findings: &[Finding], code: &str) -> bool {
    findings.iter().any(|finding| finding.code == code)
}

#[test]
fn good_data_raise_no_alarm() {
    for seed in 0..20 {
        let (sizes, area) = profiles(seed, 600);
        let found = findings(&sizes, area);
        for code in [
            "poor-fit",
            "outlier",
            "rounded-sizes",
            "duplicate-rows",
            "missing-fines",
            "impossible-area",
        ] {
            assert!(!has(&found, code), "{seed}: {found:?}");
        }
    }
}

#[test]
fn altered_data_are_found() {
    for seed in 0..5 {
        let (sizes, area) = profiles(seed, 600);
        let largest = sizes.iter().copied().fold(0.0, f64::max);
        let with_outlier: Vec<f64> = sizes.iter().copied().chain([100.0 * largest]).collect();
        assert!(has(&findings(&with_outlier, 1e6 * area), "outlier"));
        let rounded: Vec<f64> = sizes.iter().map(|d| (0.25 * (4.0 * d).round()).max(0.25)).collect();
        assert!(has(&findings(&rounded, area), "rounded-sizes"));
        let twice: Vec<f64> = sizes.iter().flat_map(|d| [*d; 2]).collect();
        assert!(has(&findings(&twice, 2.0 * area), "duplicate-rows"));
        let without_fines: Vec<f64> = sizes.iter().copied().filter(|d| *d > 0.75).collect();
        let found = findings(&without_fines, area);
        assert!(has(&found, "missing-fines") || has(&found, "poor-fit"), "{found:?}");
        assert!(has(&findings(&sizes, 0.5 * area), "impossible-area"));
    }
}
