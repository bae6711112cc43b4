//! What is not observed: edges of the image, fines lost at the rim, sizes and fractions that are not known.

use crate::experiment::{AREA, DISTRIBUTIONS, Design};
use crate::spheres;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;
use stereology_unfold::{
    Bootstrap, BoundingBox, EdgeRule, Kernel, Method, ProfileCounts, Resampling, SamplingWindow, SizeBins, UnfoldError,
    UnfoldOptions, capped_kernel, divided_edges, equal_edges, largest_size, likely_parameter, unfold,
    unknown_fractions,
};

fn sphere(x: f64) -> f64 {
    1.0 - (1.0 - x.min(1.0).powi(2)).sqrt()
}

/// N_A of discs of diameter 0.2 to 1 in windows three times as wide as the largest, by each rule: right within 1 %
/// (five standard errors of 0.15 %) for the three that are unbiased, too many by a third with all, too few without
/// those that touch.
#[test]
fn edge_rules_are_right_or_wrong_by_what_is_known() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (window, margin, windows, per_area) = (3.0, 1.0, 4000, 4.0);
    let side: f64 = window + 2.0 * margin;
    let rules = [
        (EdgeRule::MilesLantuejoul, 0.99..1.01),
        (EdgeRule::CountingFrame, 0.99..1.01),
        (EdgeRule::PlusSampling, 0.99..1.01),
        (EdgeRule::All, 1.3..1.6),
        (EdgeRule::Inside, 0.5..0.75),
    ];
    let mut counted = [0.0; 5];
    for _ in 0..windows {
        let discs: Vec<BoundingBox> = (0..100)
            .map(|_| {
                let (x, y) = (side * rng.random::<f64>() - margin, side * rng.random::<f64>() - margin);
                let radius = 0.1 + 0.4 * rng.random::<f64>();
                BoundingBox {
                    left: x - radius,
                    top: y - radius,
                    right: x + radius,
                    bottom: y + radius,
                }
            })
            .collect();
        for (sum, (rule, _)) in counted.iter_mut().zip(&rules) {
            *sum += SamplingWindow::continuous(window, window)
                .weigh(&discs, *rule)
                .weights
                .iter()
                .sum::<f64>();
        }
    }
    for (sum, (rule, right)) in counted.iter().zip(rules) {
        let ratio = sum / (f64::from(windows) * window * window * per_area);
        println!("{}: {ratio:.4}", rule.name());
        assert!(right.contains(&ratio), "{}: {ratio}", rule.name());
    }
}

/// Without a capping angle the kernel by sampling is the closed one.
#[test]
fn kernel_without_a_capping_angle_is_the_closed_one() {
    let (profiles, sizes) = (equal_edges(2.0, 20), equal_edges(2.0, 10));
    let sampled = capped_kernel(
        &sphere,
        1.0,
        0.0,
        &profiles,
        SizeBins::integrated(&sizes).unwrap(),
        PI / 6.0,
    )
    .unwrap();
    let closed = spheres::integrated(&profiles, &sizes);
    assert!((sampled.matrix() - closed.matrix()).amax() < 2e-3);
}

/// Profiles below D sin φ are lost; the angle comes back from the counts, and the density with it, within five standard
/// errors (.02 and 4 %).
#[test]
fn capping_angle_is_found_and_made_good() {
    let design = Design::new("single", 1200.0);
    let angle = 0.4_f64;
    let (edges, mut found, mut totals) = (equal_edges(1.0, 10), 0.0, 0.0);
    let seeds = 6;
    for seed in 0..seeds {
        let profiles: Vec<f64> = design
            .profiles_with_sizes(seed)
            .into_iter()
            .filter(|(profile, size)| *profile > size * angle.sin())
            .map(|(profile, _)| profile)
            .collect();
        let bins = divided_edges(&edges, 100, 0.0);
        let counts = ProfileCounts::from_sizes(&profiles, None, &bins, AREA).unwrap();
        let kernel = |angle: f64| {
            let sizes = SizeBins::integrated(&divided_edges(&edges, 40, 0.0)).map_err(|_| ());
            let sizes = sizes
                .and_then(|sizes| sizes.reported_in(&edges).map_err(|_| ()))
                .unwrap();
            capped_kernel(&sphere, 1.0, angle, &bins, sizes, PI / 6.0)
        };
        let options = UnfoldOptions::default();
        let likely = likely_parameter(&counts, &kernel, (0.0, 1.2), 0.9, &options).unwrap();
        assert!(likely.interval.lower <= likely.value && likely.value <= likely.interval.upper);
        assert!(!likely.unbounded);
        found += likely.value / seeds as f64;
        totals += unfold(&counts, &kernel(likely.value).unwrap(), &options)
            .unwrap()
            .total
            .value
            / seeds as f64;
    }
    let truth: f64 = design.densities(10).iter().sum();
    println!("angle {found:.3} for {angle}, total {:.3} of the truth", totals / truth);
    assert!((found - angle).abs() < 0.05, "{found}");
    assert!((totals / truth - 1.0).abs() < 0.08, "{}", totals / truth);
}

/// The largest size: by its order statistics and by likelihood nearer to the truth than the largest profile, on average
/// over samples whose sizes run evenly up to 1.
#[test]
fn largest_size_is_less_biased_than_the_largest_profile() {
    let design = Design::new("constant", 1300.0);
    let (mut observed, mut corrected, seeds) = (0.0, 0.0, 60);
    for seed in 0..seeds {
        let found = largest_size(&design.profiles(seed)).unwrap();
        assert!(found.value >= found.observed && found.observed <= 1.0);
        observed += (found.observed - 1.0) / seeds as f64;
        corrected += (found.value - 1.0) / seeds as f64;
    }
    println!("largest profile {observed:+.4}, corrected {corrected:+.4}");
    assert!(observed < 0.0 && corrected.abs() < 0.75 * observed.abs());
    assert_eq!(largest_size(&[0.5, 0.5]), None);
    assert_eq!(largest_size(&[]), None);
}

/// The scale, eq. (7): of particles that are all of one size, and of sizes that run evenly up to the largest, within 2
/// %; never below the largest profile.
#[test]
fn scale_comes_from_the_likelihood() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let truth = 0.83;
    let equal: Vec<f64> = (0..500)
        .map(|_| truth * (1.0 - rng.random::<f64>().powi(2)).sqrt())
        .collect();
    let bins = equal_edges(1.2, 480);
    let options = UnfoldOptions::default();
    let counts = ProfileCounts::from_sizes(&equal, None, &bins, 100.0).unwrap();
    let of_one_size = |scale: f64| Ok(spheres::upper_edge(&bins, &[0.0, scale]));
    let found = likely_parameter(&counts, &of_one_size, (0.6, 1.2), 0.9, &options).unwrap();
    println!(
        "one size: {} ({} to {})",
        found.value, found.interval.lower, found.interval.upper
    );
    assert!((found.value / truth - 1.0).abs() < 0.02, "{}", found.value);

    let even = Design::new("constant", 1300.0).profiles(2);
    let counts = ProfileCounts::from_sizes(&even, None, &bins, AREA).unwrap();
    let spread = |scale: f64| Ok(spheres::integrated(&bins, &equal_edges(scale, 40)));
    let found = likely_parameter(&counts, &spread, (0.8, 1.2), 0.9, &options).unwrap();
    println!(
        "even sizes: {} ({} to {})",
        found.value, found.interval.lower, found.interval.upper
    );
    assert!((found.value - 1.0).abs() < 0.02, "{}", found.value);
    assert!(matches!(
        likely_parameter(&counts, &spread, (0.1, 0.2), 0.9, &options),
        Err(UnfoldError::Range { .. })
    ));
}

/// Types whose profiles are very different are distinguished; types whose profiles are alike are not, and that is said.
#[test]
fn unknown_fractions_are_found_or_refused() {
    let edges = equal_edges(1.0, 5);
    let bins = divided_edges(&edges, 50, 0.0);
    let kernel = |law: &dyn Fn(f64) -> f64| -> Kernel {
        let sizes = SizeBins::integrated(&divided_edges(&edges, 40, 0.0))
            .unwrap()
            .reported_in(&edges)
            .unwrap();
        capped_kernel(law, 1.0, 0.0, &bins, sizes, 0.5).unwrap()
    };
    // Bodies that show nearly always their largest section, and bodies that hardly ever do.
    let stout = kernel(&|x: f64| x.clamp(0.0, 1.0).powi(40));
    let slender = kernel(&|x: f64| 1.0 - (1.0 - x.clamp(0.0, 1.0)).powi(6));
    let truth = Kernel::mix(&[stout.clone(), slender.clone()], &[0.3, 0.7]).unwrap();
    // All particles of one size: a single column.
    let counts: Vec<f64> = truth.matrix().column(33).iter().map(|k| (k * 4000.0).round()).collect();
    let counts = ProfileCounts::from_counts(&counts, &bins, 100.0).unwrap();
    let options = UnfoldOptions::default();
    let found = unknown_fractions(&counts, &[stout, slender], 0.9, &options).unwrap();
    println!("{found:?}");
    assert!((found.fractions[0] - 0.3).abs() < 0.1 && (found.fractions.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    let alike = [kernel(&sphere), kernel(&|x: f64| sphere(x).powf(1.1))];
    let spread = ProfileCounts::from_sizes(&Design::new("lognormal", 1150.0).profiles(1), None, &bins, AREA).unwrap();
    assert!(matches!(
        unknown_fractions(&spread, &alike, 0.9, &options),
        Err(UnfoldError::FractionsUnknowable { condition_number, .. }) if condition_number > 5.0
    ));
    assert!(unknown_fractions(&spread, &alike[..1], 0.9, &options).is_err());
}

/// Slices with few and many profiles by turns vary far more than Poisson's counts: only drawing slices shows it.
#[test]
fn slices_that_differ_widen_their_bootstrap() {
    let all = Design::new(DISTRIBUTIONS[0].0, 2400.0).profiles(8);
    let slices: Vec<usize> = (0..all.len())
        .map(|i| if i % 4 == 0 { i / 4 % 6 } else { 6 + i % 6 })
        .collect();
    let (kernel, bins) = spheres::fine(&equal_edges(1.0, 10));
    let counts = ProfileCounts::from_slices(&all, None, &slices, &bins, AREA).unwrap();
    assert_eq!(counts.slices(), Some(12));
    let width = |resampling: Resampling| {
        let bootstrap = Bootstrap {
            replicates: 100,
            resampling,
            ..Bootstrap::default()
        };
        let found = unfold(&counts, &kernel, &UnfoldOptions::default().with_bootstrap(bootstrap)).unwrap();
        let interval = found.total.interval.unwrap();
        interval.upper - interval.lower
    };
    let ratio = width(Resampling::Slices) / width(Resampling::Counts);
    assert!(ratio > 2.0, "{ratio}");
    let lone = ProfileCounts::from_sizes(&all, None, &bins, AREA).unwrap();
    let asked = UnfoldOptions::default().with_bootstrap(Bootstrap {
        resampling: Resampling::Slices,
        ..Bootstrap::default()
    });
    assert_eq!(unfold(&lone, &kernel, &asked), Err(UnfoldError::TooFewSlices(0)));
}

/// Slender spheroids: the inverse fails, the smooth estimate does not; and a threshold adds nothing below itself.
#[test]
fn totals_are_not_extrapolated_below_the_threshold() {
    let edges = equal_edges(1.0, 10);
    let design = Design::new("lognormal", 1150.0);
    let truth: f64 = design.densities(10)[2..].iter().sum();
    let (mut mean, seeds) = (0.0, 20);
    for seed in 0..seeds {
        let seen: Vec<f64> = design.profiles(seed).into_iter().filter(|size| *size > 0.2).collect();
        let (kernel, bins) = spheres::fine(&edges);
        let counts = ProfileCounts::from_sizes(&seen, None, &bins, AREA).unwrap();
        let options = UnfoldOptions::default().with_min_size(0.2).with_method(Method::Auto);
        let found = unfold(&counts, &kernel, &options).unwrap();
        assert_eq!(found.number_density[..2], [None, None]);
        assert!((found.profiles_per_area.expected / found.profiles_per_area.observed - 1.0).abs() < 0.02);
        mean += found.total.value / truth / seeds as f64;
    }
    println!("total above the threshold: {mean:.3} of the truth");
    assert!((mean - 1.0).abs() < 0.06, "{mean}");
}
