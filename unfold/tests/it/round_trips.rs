//! Exact counts in, exact densities out; and what scaling and shuffling must not change.

use crate::experiment::{AREA, Design};
use crate::spheres;
use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use std::f64::consts::PI;
use stereology_unfold::{
    Kernel, Method, ProfileCounts, SizeBins, UnfoldError, UnfoldOptions, Unfolding, equal_edges, unfold, unfold_types,
};

/// Those that answer exact counts with exact densities.
const METHODS: [Method; 3] = [Method::Paper, Method::Nnls, Method::Em];

fn with(method: Method) -> UnfoldOptions {
    UnfoldOptions::default().with_method(method).with_tolerance(1e-9)
}

fn values(found: &Unfolding) -> Vec<f64> {
    found
        .number_density
        .iter()
        .map(|density| density.unwrap_or(0.0))
        .collect()
}

/// Expected counts on an area.
fn expected(kernel: &Kernel, densities: &[f64], edges: &[f64], area: f64) -> ProfileCounts {
    let counts = kernel.matrix() * DVector::from_column_slice(densities) * area;
    ProfileCounts::from_counts(counts.as_slice(), edges, area).unwrap()
}

fn densities() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(0.05..1.0_f64, 2..9)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Expected counts of known densities unfold to these densities, by every method and kernel; deviance is zero, the
    /// total is eq. (1)'s.
    #[test]
    fn exact_counts_give_exact_densities(truth in densities(), largest in 0.1..50.0_f64, area in 1e2..1e6_f64) {
        let edges = equal_edges(largest, truth.len());
        for kernel in [spheres::upper_edge(&edges, &edges), spheres::integrated(&edges, &edges)] {
            let counts = expected(&kernel, &truth, &edges, area);
            for method in METHODS {
                let found = unfold(&counts, &kernel, &with(method)).unwrap();
                let tolerance = if method == Method::Em { 0.02 } else { 1e-8 };
                for (found, truth) in values(&found).iter().zip(&truth) {
                    prop_assert!((found - truth).abs() <= tolerance, "{method:?}: {found} not {truth}");
                }
                prop_assert!(found.deviance.abs() < 1e-6 * counts.profiles() as f64 + 1e-6);
                prop_assert!(found.clamped_bins.is_empty());
                // Eq. (1), summed: N_A = ⟨D⟩ N_V.
                let per_area: f64 = found.observed.iter().sum();
                prop_assert!((per_area - found.mean_size.value * found.total.value).abs() < 1e-6 * per_area);
            }
        }
    }

    /// In other units of length the densities are the same particles: n / L³.
    #[test]
    fn unfolding_scales(seed in 0_u64..100, unit in 0.01..100.0_f64) {
        let sizes = Design::new("lognormal", 1150.0).profiles(seed);
        let scaled: Vec<f64> = sizes.iter().map(|size| size * unit).collect();
        for method in METHODS {
            let run = |sizes: &[f64], unit: f64| {
                // Half a bin beyond the largest, so that rounding of products moves no profile over an edge.
                let edges = equal_edges(1.000_001 * unit, 10);
                let counts = ProfileCounts::from_sizes(sizes, None, &edges, AREA * unit * unit).unwrap();
                unfold(&counts, &spheres::upper_edge(&edges, &edges), &UnfoldOptions::default().with_method(method)).unwrap()
            };
            let (here, there) = (run(&sizes, 1.0), run(&scaled, unit));
            assert_relative_eq!(here.total.value, there.total.value * unit.powi(3), max_relative = 1e-6);
            assert_relative_eq!(here.mean_size.value * unit, there.mean_size.value, max_relative = 1e-6);
            assert_relative_eq!(here.volume_fraction.value, there.volume_fraction.value, max_relative = 1e-6);
        }
    }

    /// Nor does the unit of length matter to the smooth estimate and the choice between it and the sparse one, bin by
    /// bin.
    #[test]
    fn smooth_unfolding_scales(seed in 0_u64..20, unit in 0.01..100.0_f64) {
        let sizes = Design::new("single", 1200.0).profiles(seed);
        let run = |unit: f64| {
            let (kernel, edges) = spheres::fine(&equal_edges(1.000_001 * unit, 10));
            let scaled: Vec<f64> = sizes.iter().map(|size| size * unit).collect();
            let counts = ProfileCounts::from_sizes(&scaled, None, &edges, AREA * unit * unit).unwrap();
            unfold(&counts, &kernel, &UnfoldOptions::default()).unwrap()
        };
        let (here, there) = (run(1.0), run(unit));
        prop_assert_eq!(here.method, there.method);
        for (here, there) in values(&here).iter().zip(values(&there)) {
            assert_relative_eq!(*here, there * unit.powi(3), max_relative = 1e-4);
        }
    }

    /// The order of profiles says nothing.
    #[test]
    fn order_of_profiles_is_nothing(seed in 0_u64..100) {
        let sizes = Design::new("single", 300.0).profiles(seed);
        let reversed: Vec<f64> = sizes.iter().rev().copied().collect();
        let edges = equal_edges(1.0, 8);
        let count = |sizes: &[f64]| ProfileCounts::from_sizes(sizes, None, &edges, AREA).unwrap();
        let (here, there) = (count(&sizes), count(&reversed));
        prop_assert_eq!(here.counts(), there.counts());
        for (here, there) in here.area_fractions().iter().zip(there.area_fractions()) {
            prop_assert!((here - there).abs() <= 1e-12 * here);
        }
    }
}

/// A threshold on an edge leaves the bins above untouched when counts are exact, says nothing below, and never
/// extrapolates a total.
#[test]
fn threshold_drops_rows_and_says_nothing_below() {
    let edges = equal_edges(1.0, 5);
    let truth = [4.0, 3.0, 2.0, 1.0, 0.5];
    let kernel = spheres::upper_edge(&edges, &edges);
    let mut counts: Vec<f64> = expected(&kernel, &truth, &edges, 1e3).counts().to_vec();
    counts[0] = 0.0; // missing fines
    counts[1] = 0.0;
    let counts = ProfileCounts::from_counts(&counts, &edges, 1e3).unwrap();
    for method in METHODS {
        let found = unfold(&counts, &kernel, &with(method).with_min_size(0.4)).unwrap();
        assert_eq!(found.number_density[..2], [None, None]);
        for (found, truth) in found.number_density.iter().zip(truth).skip(2) {
            assert_relative_eq!(found.unwrap(), truth, epsilon = 0.01);
        }
        assert_relative_eq!(found.total.value, 3.5, epsilon = 0.02);
        assert_eq!(found.threshold, 0.4);
        assert!(found.findings.iter().all(|finding| finding.code != "threshold-moved"));
        // Inside a bin the whole bin goes, and it is said.
        let moved = unfold(&counts, &kernel, &with(method).with_min_size(0.41)).unwrap();
        assert_eq!(
            (moved.threshold, moved.number_density[2]),
            (equal_edges(1.0, 5)[3], None)
        );
        assert!(moved.findings.iter().any(|finding| finding.code == "threshold-moved"));
    }
}

/// Without the threshold the paper's method answers missing fines with negative densities, clamps them, and says so
/// (section 5.2).
#[test]
fn missing_fines_come_out_negative_and_are_reported() {
    let edges = equal_edges(1.0, 5);
    let kernel = spheres::upper_edge(&edges, &edges);
    let mut counts: Vec<f64> = expected(&kernel, &[4.0, 3.0, 2.0, 1.0, 0.5], &edges, 1e3)
        .counts()
        .to_vec();
    counts[0] = 0.0;
    let counts = ProfileCounts::from_counts(&counts, &edges, 1e3).unwrap();
    let found = unfold(&counts, &kernel, &with(Method::Paper)).unwrap();
    assert_eq!(found.clamped_bins, [0]);
    assert_eq!(found.number_density[0], Some(0.0));
    assert_eq!(found.findings[0].code, "negative-bins");
}

/// Labelled types, eq. (9): each type comes out with its own densities, and the refolded sum is the observed one.
#[test]
fn labelled_types_are_unfolded_together() {
    let edges = equal_edges(1.0, 4);
    let kernel = spheres::integrated(&edges, &edges);
    let flat = Kernel::new(kernel.matrix() * 1.3, kernel.sizes().clone(), 0.3).unwrap();
    let (first, second) = ([1.0, 2.0, 3.0, 4.0], [4.0, 3.0, 2.0, 1.0]);
    let types = [
        (expected(&kernel, &first, &edges, 1e4), kernel.clone()),
        (expected(&flat, &second, &edges, 1e4), flat.clone()),
    ];
    let found = unfold_types(&types, &with(Method::Nnls)).unwrap();
    for j in 0..4 {
        assert_relative_eq!(found.types[0].number_density[j].unwrap(), first[j], epsilon = 1e-6);
        assert_relative_eq!(found.types[1].number_density[j].unwrap(), second[j], epsilon = 1e-6);
        assert_relative_eq!(found.number_density[j].unwrap(), 5.0, epsilon = 1e-6);
        assert_relative_eq!(found.refolded[j], found.observed[j], max_relative = 1e-6);
    }
    let volumes: f64 = found.types.iter().map(|part| part.volume_fraction.value).sum();
    assert_relative_eq!(found.volume_fraction.value, volumes, max_relative = 1e-12);
    assert!(matches!(
        unfold_types(&[], &with(Method::Em)),
        Err(UnfoldError::Bins { index: 0 })
    ));
}

/// Unlabelled types with given fractions and one size distribution, eqs. (10)-(12).
#[test]
fn mixed_types_share_a_distribution() {
    let edges = equal_edges(1.0, 4);
    let spheres = spheres::integrated(&edges, &edges);
    let long = Kernel::new(spheres.matrix() * 1.5, spheres.sizes().clone(), 0.2).unwrap();
    let mixed = Kernel::mix(&[spheres, long], &[0.25, 0.75]).unwrap();
    let truth = [1.0, 2.0, 1.5, 0.5];
    let found = unfold(&expected(&mixed, &truth, &edges, 1e3), &mixed, &with(Method::Paper)).unwrap();
    for (found, truth) in values(&found).iter().zip(truth) {
        assert_relative_eq!(*found, truth, epsilon = 1e-9);
    }
    assert_relative_eq!(mixed.unit_volume(), 0.25 * PI / 6.0 + 0.75 * 0.2, epsilon = 1e-12);
}

/// More profile bins than size bins: least squares and likelihood take them, the inverse says why not.
#[test]
fn rectangular_kernels() {
    let (fine, coarse) = (equal_edges(1.0, 40), equal_edges(1.0, 8));
    let kernel = spheres::integrated(&fine, &coarse);
    let truth = [1.0; 8];
    let counts = expected(&kernel, &truth, &fine, 1e4);
    assert_eq!(
        unfold(&counts, &kernel, &with(Method::Paper)),
        Err(UnfoldError::NotSquare { rows: 40, columns: 8 })
    );
    for method in [Method::Nnls, Method::Em] {
        let found = unfold(&counts, &kernel, &with(method)).unwrap();
        assert_eq!(found.degrees_of_freedom, 32);
        assert_relative_eq!(found.total.value, 8.0, epsilon = 1e-3);
    }
}

/// A kernel that is not triangular is solved all the same; one without an inverse is refused.
#[test]
fn full_kernels_are_solved_and_singular_ones_refused() {
    let sizes = SizeBins::upper_edge(&[0.0, 1.0, 2.0]).unwrap();
    let edges = [0.0, 1.0, 2.0];
    let kernel = |entries: [f64; 4]| Kernel::new(DMatrix::from_row_slice(2, 2, &entries), sizes.clone(), 1.0).unwrap();
    let full = kernel([1.0, 0.5, 0.25, 1.5]);
    let found = unfold(&expected(&full, &[2.0, 3.0], &edges, 10.0), &full, &with(Method::Paper)).unwrap();
    assert_relative_eq!(found.number_density[1].unwrap(), 3.0, epsilon = 1e-12);
    let counts = ProfileCounts::from_counts(&[1.0, 1.0], &edges, 1.0).unwrap();
    assert_eq!(
        unfold(&counts, &kernel([1.0, 1.0, 1.0, 1.0]), &with(Method::Paper)),
        Err(UnfoldError::Singular)
    );
}

/// The condition number of ten bins of spheres, integrated: 14.
#[test]
fn condition_number_of_spheres() {
    let edges = equal_edges(1.0, 10);
    let condition = spheres::integrated(&edges, &edges).condition_number();
    assert!((12.0..16.0).contains(&condition), "{condition}");
}
