//! What must hold exactly, whatever the body.

use crate::meshes::{angle, body, cubes, hollow_cube, jack, placed, torus};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use proptest::prelude::*;
use stereology_kmatrix::{
    Counting, SectionLaw, SectionLawError, SectionOptions, Sizes, SphereKernel, profiles_per_area,
};
use stereology_shape::{Body, TriangleMesh};

fn law(body: &Body, directions: usize) -> SectionLaw {
    SectionLaw::of_body(body, &SectionOptions::default().with_directions(directions)).unwrap()
}

/// Six and a tenth standard errors of 32 rotations are a false-alarm rate of one in a million (Student's t).
const ALARM: f64 = 6.1;

#[test]
fn alarm_is_one_in_a_million() {
    let quantile = law(&Body::cuboid([1.0; 3]).unwrap(), 32).error_quantile(1.0 - 1e-6);
    assert!((quantile - ALARM).abs() < 0.05, "{quantile}");
}

/// A finely tessellated sphere has the sphere's kernel, eq. (3), but for the tessellation (2e-3 at 5,120 triangles).
#[test]
fn sphere_mesh_tends_to_saltikov() {
    let law = law(&body(TriangleMesh::icosphere(1.0, 4)), 32);
    let exact = SphereKernel::new(10).unwrap();
    assert!((law.k_matrix(10) - exact.matrix()).amax() < 4e-3);
    assert_relative_eq!(law.caliper_effective(), 1.0, max_relative = 2e-3);
    assert_relative_eq!(law.profiles_per_hit(), 1.0, epsilon = 1e-12);
}

/// A stretched sphere mesh has the ellipsoid's law.
#[test]
fn stretched_sphere_mesh_tends_to_the_ellipsoid() {
    let axes = [0.5, 0.8, 1.5];
    let triangles = Body::ellipsoid(axes).unwrap().to_triangles(4);
    let mesh = law(&body(triangles), 32 * 24);
    let exact = SectionLaw::ellipsoid(axes).unwrap().k_matrix(10);
    let error = mesh.standard_error(10);
    assert!((mesh.k_matrix(10) - exact).amax() < ALARM * error + 4e-3, "{error}");
    assert!(error < 5e-3);
}

/// The volume of a body is the integral of its section areas over offsets, for every direction: so V = H_eff A_max ∫ x²
/// dF.
#[test]
fn mean_profile_area_is_volume_over_effective_caliper() {
    for triangles in [
        TriangleMesh::cuboid([1.0, 2.0, 3.0]),
        torus(),
        jack(),
        angle(),
        hollow_cube(),
    ] {
        let body = body(triangles);
        let law = law(&body, 32 * 16);
        let steps = 20_000;
        let mean: f64 = (0..steps)
            .map(|k| (f64::from(k) + 0.5) / f64::from(steps))
            .map(|x| 2.0 * x * (1.0 - law.cdf(x)))
            .sum();
        let mean = mean / f64::from(steps) * law.max_area();
        assert_relative_eq!(mean, law.mean_profile_area(), max_relative = 0.02);
    }
}

/// A smooth torus has H_chi = π R and the hull's mean width 2 r + π R / 2.
#[test]
fn torus_has_its_known_lengths() {
    let law = law(&body(TriangleMesh::torus(2.0, 0.5, 96, 32)), 32 * 8);
    assert_relative_eq!(law.caliper_chi(), std::f64::consts::PI, max_relative = 3e-3);
    assert_relative_eq!(
        law.caliper_hull(),
        0.5 + std::f64::consts::FRAC_PI_2,
        max_relative = 3e-3
    );
    assert!(law.caliper_holes() > 0.0);
}

/// The sweep's own count of profiles minus holes is the signed mean width, whatever the topology; not where a mesh cuts
/// through itself.
#[test]
fn swept_profiles_minus_holes_are_the_signed_mean_width() {
    for triangles in [
        TriangleMesh::cuboid([1.0, 2.0, 3.0]),
        torus(),
        jack(),
        angle(),
        hollow_cube(),
    ] {
        let law = law(&body(triangles), 32 * 16);
        assert!(law.chi_discrepancy() < ALARM, "{}", law.chi_discrepancy());
    }
}

/// Profiles per hit, counted: torus 1.4, six-armed jack 1.6, L 1.1.
#[test]
fn bodies_with_arms_show_several_profiles_a_hit() {
    let torus = law(&body(torus()), 512);
    assert!(
        (1.2..1.5).contains(&torus.profiles_per_hit()),
        "torus {}",
        torus.profiles_per_hit()
    );
    let jack = law(&body(jack()), 512);
    assert!(
        (1.4..2.0).contains(&jack.profiles_per_hit()),
        "jack {}",
        jack.profiles_per_hit()
    );
    let angle = law(&body(angle()), 512);
    assert!(
        (1.02..1.2).contains(&angle.profiles_per_hit()),
        "L {}",
        angle.profiles_per_hit()
    );
    // The paper's normalisation loses the count.
    let edges = [0.0, 0.5, 1.0];
    let lost = jack
        .kernel_counting(&edges, &edges, Sizes::UpperEdge, Counting::Paper)
        .unwrap()
        * jack.profiles_per_hit();
    assert_relative_eq!(
        jack.kernel(&edges, &edges, Sizes::UpperEdge).unwrap(),
        lost,
        max_relative = 1e-12
    );
}

/// A void inside is a hole of every section through it: as wide, on average, as the void itself. H_chi counts it with a
/// minus sign.
#[test]
fn holes_of_an_inner_void_are_its_mean_width() {
    let law = law(&body(hollow_cube()), 32 * 32);
    assert_relative_eq!(law.caliper_hull(), 4.5, max_relative = 1e-9);
    assert_relative_eq!(law.caliper_chi(), 3.0, max_relative = 1e-9);
    let error = law.caliper_effective_standard_error();
    assert_abs_diff_eq!(law.caliper_holes(), 1.5, epsilon = ALARM * error + 1e-6);
    assert_abs_diff_eq!(law.caliper_effective(), 4.5, epsilon = ALARM * error + 1e-6);
    assert!(error < 0.01);
}

/// Two bodies in one mesh are one particle that shows the profiles of both.
#[test]
fn disjoint_bodies_add_up() {
    let one = TriangleMesh::cuboid([1.0; 3]);
    let two = one.clone().with(&placed(&one, [0.3, 0.2, 0.1], 1.0, [5.0, 1.0, 0.0]));
    let (single, double) = (law(&body(one), 32 * 16), law(&body(two), 32 * 16));
    assert_relative_eq!(double.caliper_effective(), 3.0, max_relative = 1e-6);
    let error = single.standard_error(10).hypot(double.standard_error(10));
    assert!((single.k_matrix(10) - double.k_matrix(10)).amax() < ALARM * error + 1e-6);
}

#[test]
fn one_bin_is_the_fundamental_relationship() {
    let law = law(&body(jack()), 64);
    assert_relative_eq!(law.k_matrix(1)[(0, 0)], 1.0, epsilon = 1e-12);
    let kernel = law
        .kernel(&[0.0, law.size()], &[0.0, law.size()], Sizes::UpperEdge)
        .unwrap();
    assert_relative_eq!(
        kernel[(0, 0)] * 2.0,
        profiles_per_area(law.caliper_effective(), 2.0),
        max_relative = 1e-12
    );
}

#[test]
fn tolerance_is_kept_and_nonsense_refused() {
    let rock = Body::rock(11);
    let reached = SectionLaw::of_body(&rock, &SectionOptions::default().with_tolerance(2e-3)).unwrap();
    assert!(reached.standard_error(10) <= 2e-3 && reached.rotations() == 32);
    for tolerance in [0.0, -1.0, f64::NAN] {
        let refused = SectionLaw::of_body(&rock, &SectionOptions::default().with_tolerance(tolerance));
        assert!(matches!(refused, Err(SectionLawError::Tolerance(_))));
    }
    assert!(SectionLaw::of_body(&rock, &SectionOptions::default().with_directions(0)).is_err());
    let cancelled =
        SectionLaw::of_body_with_progress(&rock, &SectionOptions::default(), &|_| std::ops::ControlFlow::Break(()));
    assert_eq!(cancelled.unwrap_err(), SectionLawError::Cancelled);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    /// Columns sum to j / n to rounding, for any body and number of bins: eq. (6).
    #[test]
    fn columns_sum_to_relative_size(seed in 0_u64..1000, bins in 1_usize..30) {
        let matrix = law(&Body::rock(seed), 32).k_matrix(bins);
        for j in 0..bins {
            assert_abs_diff_eq!(matrix.column(j).sum(), (j + 1) as f64 / bins as f64, epsilon = 1e-12);
        }
    }

    /// Where a body lies, how it is turned and how large it is changes nothing but lengths.
    #[test]
    fn law_is_invariant(turn in prop::array::uniform3(-3.0..3.0_f64), scale in 0.01..100.0_f64, shift in prop::array::uniform3(-50.0..50.0_f64)) {
        let here = law(&body(angle()), 32 * 16);
        let there = law(&body(placed(&angle(), turn, scale, shift)), 32 * 16);
        let error = here.standard_error(10).hypot(there.standard_error(10));
        prop_assert!((here.k_matrix(10) - there.k_matrix(10)).amax() < ALARM * error);
        prop_assert!((there.caliper_effective() / scale / here.caliper_effective() - 1.0).abs() < 1e-6);
    }

    /// Cutting the faces finer changes nothing: the same directions give the same law to rounding of the heights.
    #[test]
    fn coplanar_triangles_change_nothing(longer in 2_i32..5) {
        let cells: Vec<[i32; 3]> = (0..longer).map(|x| [x, 0, 0]).collect();
        // The same bar of many cells and of one box.
        let fine = law(&body(cubes(&cells)), 64);
        let half = f64::from(longer) / 2.0;
        let coarse = law(&body(placed(&TriangleMesh::cuboid([f64::from(longer), 1.0, 1.0]), [0.0; 3], 1.0, [half, 0.5, 0.5])), 64);
        prop_assert!((fine.k_matrix(10) - coarse.k_matrix(10)).amax() < 1e-6);
    }
}

#[test]
fn same_bits_at_any_number_of_threads() {
    let compute = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| law(&body(angle()), 128))
    };
    assert_eq!(compute(1), compute(3));
}
