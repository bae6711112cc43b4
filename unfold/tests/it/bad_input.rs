//! Wrong input is an error; little data are unfolded with a warning.

use crate::spheres;
use stereology_unfold::{Bootstrap, Method, ProfileCounts, UnfoldError, UnfoldOptions, equal_edges, unfold};

fn counts(sizes: &[f64], bins: usize) -> ProfileCounts {
    ProfileCounts::from_sizes(sizes, None, &equal_edges(1.0, bins), 100.0).unwrap()
}

#[test]
fn one_profile_and_equal_profiles_are_unfolded_with_a_warning() {
    let edges = equal_edges(1.0, 10);
    let kernel = spheres::upper_edge(&edges, &edges);
    for method in [
        Method::Auto,
        Method::Penalised,
        Method::Sparse,
        Method::Em,
        Method::Ems,
        Method::Nnls,
        Method::Paper,
    ] {
        let options = UnfoldOptions::default().with_method(method);
        let one = unfold(&counts(&[0.55], 10), &kernel, &options).unwrap();
        assert!(one.total.value > 0.0 && one.total.value.is_finite());
        assert!(one.findings.iter().any(|finding| finding.code == "few-profiles-in-bin"));
        let equal = unfold(&counts(&[0.55; 50], 10), &kernel, &options).unwrap();
        assert!(equal.total.value > 0.0 && equal.mean_size.value <= 1.0 && equal.mean_size.value > 0.0);
    }
}

/// With one profile intervals are wide, but the mean size does not exceed the largest size, nor a cumulative fraction
/// 1.
#[test]
fn intervals_stay_where_values_can_be() {
    let (kernel, edges) = spheres::fine(&equal_edges(0.5, 1));
    let lone = ProfileCounts::from_sizes(&[0.5], None, &edges, 0.2).unwrap();
    let options = UnfoldOptions::default().with_bootstrap(Bootstrap::default());
    let found = unfold(&lone, &kernel, &options).unwrap();
    assert!(found.mean_size.interval.unwrap().upper <= 0.5);
    assert!(
        found
            .distribution
            .passing
            .iter()
            .all(|of| of.interval.unwrap().upper <= 1.0 + 1e-12)
    );
    assert!(
        found
            .distribution
            .by_volume
            .percentiles
            .iter()
            .all(|of| of.interval.unwrap().upper <= 0.5 + 1e-12)
    );
}

#[test]
fn what_does_not_fit_is_refused() {
    let edges = equal_edges(1.0, 5);
    let kernel = spheres::upper_edge(&edges, &edges);
    let options = UnfoldOptions::default();
    let some = counts(&[0.3, 0.7], 5);
    assert_eq!(
        unfold(&counts(&[0.5], 4), &kernel, &options),
        Err(UnfoldError::Rows { counts: 4, rows: 5 })
    );
    for threshold in [-1.0, f64::NAN, 0.9, 2.0] {
        assert!(matches!(
            unfold(&some, &kernel, &options.with_min_size(threshold)),
            Err(UnfoldError::Threshold(_))
        ));
    }
    for (replicates, level) in [(1, 0.9), (100, 0.0), (100, 1.0), (100, f64::NAN)] {
        let bootstrap = Bootstrap {
            replicates,
            level,
            ..Bootstrap::default()
        };
        assert!(matches!(
            unfold(&some, &kernel, &options.with_bootstrap(bootstrap)),
            Err(UnfoldError::Bootstrap { .. })
        ));
    }
    assert!(matches!(
        unfold(&some, &kernel, &options.with_tolerance(f64::NAN)),
        Err(UnfoldError::Tolerance(_))
    ));
}

/// Profiles larger than any particle of the kernel cannot be explained.
#[test]
fn unexplained_profiles_are_refused() {
    let kernel = spheres::upper_edge(&equal_edges(1.0, 5), &equal_edges(0.6, 3));
    let refused = unfold(&counts(&[0.3, 0.9], 5), &kernel, &UnfoldOptions::default());
    assert_eq!(refused, Err(UnfoldError::Unexplained { bin: 4 }));
    assert!(refused.unwrap_err().to_string().contains("profile bin 5"));
}
