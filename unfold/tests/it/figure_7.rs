//! Rows of the table of estimators on the experiment of figure 7.

use crate::experiment::{AREA, DISTRIBUTIONS, Design, TWO_BANDS, scores};
use crate::spheres;
use stereology_unfold::{Kernel, Method, ProfileCounts, UnfoldOptions, equal_edges, unfold};

const SEEDS: u64 = 200;

/// Mean and standard error of the three scores over seeds.
fn mean_scores(
    method: Method,
    kernel: &Kernel,
    profile_edges: &[f64],
    design: &Design,
    seeds: u64,
) -> ([f64; 3], [f64; 3]) {
    let truth = design.densities(10);
    let options = UnfoldOptions::default().with_method(method);
    let all: Vec<[f64; 3]> = (0..seeds)
        .map(|seed| {
            let counts = ProfileCounts::from_sizes(&design.profiles(seed), None, profile_edges, AREA).unwrap();
            let found = unfold(&counts, kernel, &options).unwrap();
            let densities: Vec<f64> = found.number_density.iter().map(|density| density.unwrap()).collect();
            scores(&densities, &truth, &found.edges)
        })
        .collect();
    let n = seeds as f64;
    let mean = [0, 1, 2].map(|k| all.iter().map(|score| score[k]).sum::<f64>() / n);
    let error =
        [0, 1, 2].map(|k| (all.iter().map(|score| (score[k] - mean[k]).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt());
    (mean, error)
}

/// The table's rows are means of 200 other samples: ours agree within 5 standard errors of the difference (false alarm
/// below 1e-6 each).
fn agrees(method: Method, kernel: &Kernel, profile_edges: &[f64], table: [[f64; 3]; 4]) {
    for ((name, profiles), expected) in DISTRIBUTIONS.into_iter().zip(table) {
        let (mean, error) = mean_scores(method, kernel, profile_edges, &Design::new(name, profiles), SEEDS);
        println!("{} {name}: {mean:.3?} ± {error:.3?}, table {expected:?}", method.name());
        for k in 0..3 {
            let allowed = 5.0 * error[k] * (1.0 + SEEDS as f64 / 200.0).sqrt() + 5e-4;
            assert!(
                (mean[k] - expected[k]).abs() < allowed,
                "{} {name} {k}: {} not {}",
                method.name(),
                mean[k],
                expected[k]
            );
        }
    }
}

/// K⁻¹ with the upper-edge kernel, negative densities set to zero, ten bins: the paper.
#[test]
fn paper() {
    let edges = equal_edges(1.0, 10);
    let table = [
        [0.029, 0.229, 0.166],
        [0.036, 0.309, 0.255],
        [0.052, 0.226, 0.161],
        [0.084, 0.183, 0.187],
    ];
    agrees(Method::Paper, &spheres::upper_edge(&edges, &edges), &edges, table);
}

/// Non-negative least squares with the same kernel.
#[test]
fn nnls() {
    let edges = equal_edges(1.0, 10);
    let table = [
        [0.029, 0.228, 0.166],
        [0.036, 0.309, 0.255],
        [0.052, 0.226, 0.161],
        [0.084, 0.183, 0.187],
    ];
    agrees(Method::Nnls, &spheres::upper_edge(&edges, &edges), &edges, table);
}

/// Converged expectation-maximisation with the bin-integrated kernel.
#[test]
fn em() {
    let edges = equal_edges(1.0, 10);
    let table = [
        [0.033, 0.204, 0.146],
        [0.034, 0.228, 0.161],
        [0.033, 0.152, 0.196],
        [0.040, 0.264, 0.157],
    ];
    agrees(Method::Em, &spheres::integrated(&edges, &edges), &edges, table);
}

/// EM with smoothing of .02 after every step, 100 profile bins, the ends of the distribution keeping what smoothing
/// would move out: nowhere worse than the table, whose ends lose it.
#[test]
fn ems() {
    let (sizes, profiles) = (equal_edges(1.0, 10), equal_edges(1.0, 100));
    let table = [0.134, 0.142, 0.119, 0.172];
    let kernel = spheres::integrated(&profiles, &sizes);
    for ((name, number), table) in DISTRIBUTIONS.into_iter().zip(table) {
        let (mean, error) = mean_scores(Method::Ems, &kernel, &profiles, &Design::new(name, number), 100);
        println!("ems {name}: {mean:.3?} ± {error:.3?}, table {table}");
        assert!(mean[1] < table + 7.0 * error[1], "{name}: {}", mean[1]);
    }
}

/// The default: smooth data within the targets (200 other samples: .065, .13, .11, .03 by number), two narrow bands
/// within .12. Allowed are five standard errors above what was measured on 200 samples.
#[test]
fn auto() {
    let (kernel, profile_edges) = spheres::fine(&equal_edges(1.0, 10));
    let measured = [0.056, 0.119, 0.088, 0.022, 0.031];
    for ((name, profiles), measured) in DISTRIBUTIONS.into_iter().chain([TWO_BANDS]).zip(measured) {
        let (mean, error) = mean_scores(Method::Auto, &kernel, &profile_edges, &Design::new(name, profiles), 50);
        println!("auto {name}: {mean:.3?} ± {error:.3?}");
        assert!(mean[1] < measured + 5.0 * error[1] + 1e-3, "{name}: {}", mean[1]);
        assert!(mean[0] < 0.06, "{name}: {}", mean[0]);
    }
}

/// The default on all grids: within five standard errors of what was measured on 200 other samples.
#[test]
fn auto_on_all_grids() {
    let (kernel, profile_edges) = spheres::on_grids(&equal_edges(1.0, 10), 0.02);
    let measured = [0.063, 0.113, 0.081, 0.027, 0.035];
    for ((name, profiles), measured) in DISTRIBUTIONS.into_iter().chain([TWO_BANDS]).zip(measured) {
        let (mean, error) = mean_scores(Method::Auto, &kernel, &profile_edges, &Design::new(name, profiles), 30);
        println!("auto on grids {name}: {mean:.4?} ± {error:.4?}");
        assert!(mean[1] < measured + 5.0 * error[1] + 1e-3, "{name}: {}", mean[1]);
        assert!(mean[0] < 0.06, "{name}: {}", mean[0]);
    }
}
