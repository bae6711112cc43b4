//! The built-in sample: what was put into its solid comes out of its photograph.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::OnceLock;

use stereology::pipeline::{
    DensityOptions, Extent, ParticleDensities, ParticleTypes, SynthesisOptions, measured_profiles, synthesize,
    unfold_profiles,
};
use stereology::pyramid::{Mode, TextureOptions};
use stereology::sample::{self, TrueCategory, Truth};
use stereology::segment::{SegmentOptions, Segmentation, segment};
use stereology::shape::Body;

fn truth() -> Truth {
    sample::truth().unwrap()
}

fn types() -> ParticleTypes {
    let bodies = truth()
        .shapes
        .into_iter()
        .map(|of| (of.shape.clone(), Body::parse(&of.shape).unwrap(), of.share));
    ParticleTypes::new(bodies.collect()).unwrap()
}

fn segmentation() -> &'static Segmentation {
    static FOUND: OnceLock<Segmentation> = OnceLock::new();
    FOUND.get_or_init(|| {
        segment(&sample::photo().unwrap(), &SegmentOptions::default(), &|_| {
            ControlFlow::Continue(())
        })
        .unwrap()
    })
}

fn densities() -> ParticleDensities {
    let profiles = measured_profiles(segmentation(), 1.0);
    unfold_profiles(&profiles, &types(), &DensityOptions::default(), &|_| {
        ControlFlow::Continue(())
    })
    .unwrap()
}

/// The truth counts every profile; those too small to be seen are no fault of segmentation.
#[test]
fn its_profiles_are_found() {
    let (found, truth) = (segmentation(), truth());
    assert!(
        (found.area_fraction / truth.area_fraction - 1.0).abs() < 0.03,
        "{} {}",
        found.area_fraction,
        truth.area_fraction
    );
    let visible = truth
        .profile_sizes
        .iter()
        .filter(|&&size| size > found.min_size)
        .count() as f64;
    // Profiles that the edge cuts are seen on both sides of the photograph: about (w + h) 2 mean sizes / area more.
    let whole = found.profiles.iter().filter(|profile| !profile.touches_edge).count() as f64;
    let cut = (found.profiles.len() as f64 - whole) / 2.0;
    assert!(
        ((whole + cut) / visible - 1.0).abs() < 0.05,
        "{whole} whole and {cut} cut, {visible} visible"
    );
    assert!(found.findings.is_empty(), "{:?}", found.findings);
}

/// Three colours, and the binder's. The lens and the pixels mix the binder's colour into a profile along its border: a
/// straight edge between colours a and b, blurred by a Gaussian of standard deviation σ, moves the mean over a's side
/// by (b − a) σ / √(2π) times its length over the area. The rest is the mean of the stones' texture, 0.022 strong and
/// smooth over 7 pixels, over some 5·10⁴ pixels: about 80 independent patches, 0.0025; the bound is 4 of them.
#[test]
fn its_colours_are_found() {
    let (found, truth) = (segmentation(), truth());
    assert_eq!(found.categories.len(), 3);
    let blur = (0.7_f64.powi(2) + 1.0 / 12.0).sqrt() / (2.0 * PI).sqrt();
    let mixed =
        |a: [f64; 3], b: [f64; 3], share: f64| -> [f64; 3] { std::array::from_fn(|c| a[c] + share * (b[c] - a[c])) };
    let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.01);
    let mut binder = truth.binder;
    let covered: f64 = found.profiles.iter().map(|profile| profile.area).sum();
    for (index, of) in found.categories.iter().enumerate() {
        let own = || {
            found
                .profiles
                .iter()
                .filter(|profile| usize::from(profile.category) == index)
        };
        let length: f64 = own().map(|profile| PI * profile.size).sum();
        let share = blur * length / own().map(|profile| profile.area).sum::<f64>();
        let seen = |is: &TrueCategory| near(of.colour, mixed(is.colour, truth.binder, share));
        let Some(is) = truth.categories.iter().find(|is| seen(is)) else {
            panic!("{:?} is none of {:?}", of.colour, truth.categories)
        };
        let share = blur * length / (found.labels.len() as f64 - covered);
        (0..3).for_each(|c| binder[c] += share * (is.colour[c] - truth.binder[c]));
    }
    assert!(
        near(found.binder.colour, binder),
        "{:?} is not {binder:?}",
        found.binder.colour
    );
}

/// About 500 profiles know the number density to some 6 % (their own Poisson error and that of the spread of sizes);
/// the bound is four times that.
#[test]
fn its_number_density_and_sizes_are_recovered() {
    let (found, truth) = (densities(), truth());
    let all = &found.all;
    assert!(
        (all.total.value / truth.total_number_density - 1.0).abs() < 0.25,
        "{} {}",
        all.total.value,
        truth.total_number_density
    );
    assert!(
        (all.mean_size.value / truth.mean_size - 1.0).abs() < 0.12,
        "{} {}",
        all.mean_size.value,
        truth.mean_size
    );
    assert!(
        (all.volume_fraction.value / truth.volume_fraction - 1.0).abs() < 0.12,
        "{}",
        all.volume_fraction.value
    );
    // Share of the particles in each of the true bins, the unfolded ones spread over theirs.
    let share = |edges: &[f64], density: &[f64], low: f64, high: f64| -> f64 {
        let whole: f64 = density.iter().sum();
        let part = |i: usize| (edges[i + 1].min(high) - edges[i].max(low)).max(0.0) / (edges[i + 1] - edges[i]);
        (0..density.len()).map(|i| density[i] * part(i)).sum::<f64>() / whole
    };
    let unfolded: Vec<f64> = all.number_density.iter().map(|n| n.unwrap_or(0.0)).collect();
    // Bins of 12 pixels: the unfolded bins are not the true ones.
    let difference: f64 = (0..5)
        .map(|i| (12.0 * f64::from(i), 12.0 * f64::from(i + 1)))
        .map(|(low, high)| {
            (share(&all.edges, &unfolded, low, high) - share(&truth.edges, &truth.number_density, low, high)).abs()
        })
        .sum();
    assert!(difference < 0.4, "{difference}");
}

/// The ochre pebbles are larger, and the test of size and colour says so.
#[test]
fn its_large_category_is_told_from_the_small_ones() {
    let found = densities();
    assert!(found.association.together);
    let ochre = segmentation()
        .categories
        .iter()
        .position(|of| of.colour[0] > 0.7)
        .unwrap();
    let mean = |category: usize| {
        let part = found
            .by_category
            .iter()
            .find(|part| usize::from(part.category) == category);
        part.unwrap().density.mean_size.value
    };
    for other in (0..found.by_category.len()).filter(|category| *category != ochre) {
        assert!(mean(ochre) > 1.3 * mean(other), "category {other}");
    }
}

/// The loop closes: sections of the solid, exact and segmented again, look like the photograph; and at any number of
/// threads they are the same.
#[test]
fn its_solid_shows_the_photographs_sections() {
    let options = SynthesisOptions {
        extent: Extent::Side(320.0),
        texture: TextureOptions::default().with_mode(Mode::Spectrum).with_iterations(2),
        texture_voxels: 32,
        ..SynthesisOptions::default()
    };
    let photo = sample::photo().unwrap();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| synthesize(&photo, None, &types(), &options, &|_, _| ControlFlow::Continue(())).unwrap())
    };
    let (made, again) = (run(2), run(1));
    let exact = &made.verification.exact;
    assert!(exact.size_w1 < 0.1, "{exact:?}");
    assert!(
        (exact.area_fraction_synthetic / exact.area_fraction_photo - 1.0).abs() < 0.05,
        "{exact:?}"
    );
    assert!(exact.colour_distance < 0.02, "{exact:?}");
    let drawn = made.verification.resegmented.as_ref().unwrap();
    assert!(drawn.size_w1 < 0.2, "{drawn:?}");
    assert!(
        (drawn.area_fraction_synthetic / drawn.area_fraction_photo - 1.0).abs() < 0.1,
        "{drawn:?}"
    );
    assert!(drawn.colour_distance < 0.03, "{drawn:?}");

    assert_eq!(made.solid.particles(), again.solid.particles());
    assert_eq!(made.solid.colours(), again.solid.colours());
    assert_eq!(made.details.residual, again.details.residual);
    assert_eq!(made.verification.exact, again.verification.exact);
}
