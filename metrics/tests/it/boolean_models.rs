//! Overlapping discs and spheres at random places: S2, lineal path, chords and local porosity in closed form.

use ndarray::{Array2, Array3, Axis};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;
use stereology_metrics::{
    chord_lengths, lineal_path, local_porosity, planar_functionals, radial_mean, spatial_functionals, two_point,
};

/// Number of points of a Poisson process of mean `mean`.
fn poisson(rng: &mut ChaCha8Rng, mean: f64) -> usize {
    // Exponential gaps; the means here are hundreds.
    let (mut at, mut count) = (0.0, 0);
    loop {
        at -= (1.0 - rng.random::<f64>()).ln();
        if at > mean {
            return count;
        }
        count += 1;
    }
}

/// True outside discs of radius `radius`, `density` per unit of area; discs whose centres lie outside the image overlap
/// it too.
fn outside_discs(side: usize, radius: f64, density: f64, seed: u64) -> Array2<bool> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let wide = side as f64 + 2.0 * radius;
    let mut phase = Array2::from_elem((side, side), true);
    for _ in 0..poisson(&mut rng, density * wide * wide) {
        let [cy, cx] = [0; 2].map(|_| rng.random::<f64>() * wide - radius);
        let range = |c: f64| {
            (c - radius).ceil().max(0.0) as usize..((c + radius).floor() + 1.0).clamp(0.0, side as f64) as usize
        };
        for y in range(cy) {
            for x in range(cx) {
                if (y as f64 - cy).hypot(x as f64 - cx) < radius {
                    phase[[y, x]] = false;
                }
            }
        }
    }
    phase
}

/// Area of the union of two discs of radius `r` at distance `d`.
fn union_of_discs(r: f64, d: f64) -> f64 {
    let common = if d < 2.0 * r {
        2.0 * r * r * (d / (2.0 * r)).acos() - d / 2.0 * (4.0 * r * r - d * d).sqrt()
    } else {
        0.0
    };
    2.0 * PI * r * r - common
}

/// Means and standard errors of curves over independent images.
fn averaged(curves: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let n = curves.len() as f64;
    (0..curves[0].len())
        .map(|k| {
            let mean = curves.iter().map(|c| c[k]).sum::<f64>() / n;
            let variance = curves.iter().map(|c| (c[k] - mean).powi(2)).sum::<f64>() / (n - 1.0);
            (mean, (variance / n).sqrt())
        })
        .collect()
}

const RADIUS: f64 = 6.0;
const DENSITY: f64 = 0.005;
const IMAGES: u64 = 60;

fn images() -> Vec<Array2<bool>> {
    (0..IMAGES)
        .map(|seed| outside_discs(160, RADIUS, DENSITY, seed))
        .collect()
}

/// Student's t with 59 degrees of freedom exceeds 6.4 in one of a million two-sided tests of the 30 lags.
const T: f64 = 6.4;

/// Two points are outside all discs if no centre lies in the union of the discs about them.
#[test]
fn two_point_correlation_of_overlapping_discs() {
    let of = |phase: &Array2<bool>| {
        let map = two_point(phase.view(), 30);
        map.row(30).iter().skip(30).copied().collect::<Vec<f64>>()
    };
    let curves: Vec<Vec<f64>> = images().iter().map(of).collect();
    for (lag, (mean, error)) in averaged(&curves).iter().enumerate() {
        let law = (-DENSITY * union_of_discs(RADIUS, lag as f64)).exp();
        assert!(
            (mean - law).abs() < T * error,
            "lag {lag}: {mean} +- {error}, law {law}"
        );
    }
}

/// A segment is outside all discs if no centre lies within a radius of it; chord lengths are exponential.
#[test]
fn lineal_path_and_chords_of_overlapping_discs() {
    let all = images();
    for axis in [Axis(0), Axis(1)] {
        let curves: Vec<Vec<f64>> = all.iter().map(|p| lineal_path(p.view(), axis, 30)).collect();
        for (z, (mean, error)) in averaged(&curves).iter().enumerate() {
            // A path of z pixels is sampled at z + 1 points only; a disc may cross the line between them.
            let law = (-DENSITY * (PI * RADIUS * RADIUS + 2.0 * RADIUS * z as f64)).exp();
            let missed = law * DENSITY * z as f64 * RADIUS * 0.02;
            assert!(
                (mean - law).abs() < T * error + missed,
                "{axis:?} length {z}: {mean} +- {error}, law {law}"
            );
        }
    }
    // Exponential chord lengths of rate c, in whole pixels, short compared with the image: the mean of those over m
    // pixels is m + 1/c.
    let c = 2.0 * RADIUS * DENSITY;
    let means: Vec<Vec<f64>> = all
        .iter()
        .map(|p| {
            let chords = chord_lengths(p.view(), Axis(1));
            // The fraction up to 20 pixels of the chords up to 40, which hardly depends on the border.
            let count = |most: usize| chords.iter().filter(|&&l| l <= most).count() as f64;
            vec![count(20) / count(40)]
        })
        .collect();
    let (fraction, error) = averaged(&means)[0];
    // A chord of l pixels that touches the border is left out: weight (160 − l).
    let weight = |a: f64, b: f64| {
        (0..1000)
            .map(|i| a + (f64::from(i) + 0.5) * (b - a) / 1000.0)
            .map(|l| (160.0 - l) * (-c * l).exp() * (b - a) / 1000.0)
            .sum::<f64>()
    };
    let law = weight(0.5, 20.5) / weight(0.5, 40.5);
    assert!(
        (fraction - law).abs() < T * error + 0.003,
        "{fraction} +- {error}, law {law}"
    );
}

/// True outside spheres of radius `radius`, `density` per unit of volume.
fn outside_spheres(side: usize, radius: f64, density: f64, seed: u64) -> Array3<bool> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let wide = side as f64 + 2.0 * radius;
    let mut void = Array3::from_elem((side, side, side), true);
    for _ in 0..poisson(&mut rng, density * wide.powi(3)) {
        let c = [0; 3].map(|_| rng.random::<f64>() * wide - radius);
        let range = |c: f64| {
            (c - radius).ceil().max(0.0) as usize..((c + radius).floor() + 1.0).clamp(0.0, side as f64) as usize
        };
        for z in range(c[0]) {
            for y in range(c[1]) {
                for x in range(c[2]) {
                    let square = (z as f64 - c[0]).powi(2) + (y as f64 - c[1]).powi(2) + (x as f64 - c[2]).powi(2);
                    if square < radius * radius {
                        void[[z, y, x]] = false;
                    }
                }
            }
        }
    }
    void
}

/// Overlapping spheres with volume V, surface S and integral of mean curvature M, λ per unit of volume (Miles 1976):
/// S_V = λ S q, M_V = (λ M − π²/32 λ² S²) q, χ_V = (λ − λ² M S / 4π + π/384 λ³ S³) q with q = exp(−λ V). The void has
/// the same surface and Euler number, and the opposite curvature.
#[test]
fn minkowski_functionals_of_overlapping_spheres() {
    let (radius, density) = (12.0_f64, 7e-5_f64);
    let found: Vec<Vec<f64>> = (0..24)
        .map(|seed| {
            let of = spatial_functionals(outside_spheres(96, radius, density, seed).view());
            let euler = (of.euler_26 + of.euler_6) / 2.0;
            vec![of.fraction, of.specific_surface, of.mean_curvature, euler]
        })
        .collect();
    let (volume, surface, curvature) = (
        4.0 * PI / 3.0 * radius.powi(3),
        4.0 * PI * radius * radius,
        4.0 * PI * radius,
    );
    let q = (-density * volume).exp();
    let (first, second, third) = (density, density.powi(2), density.powi(3));
    // Two spheres less than a voxel apart touch on the grid: pairs per volume at distances from 2R to 2R + 1, and per
    // area of a plane, whose discs have mean radius πR/4 and density 2Rλ.
    let pairs = 2.0 * PI * second * (2.0 * radius).powi(2) * q;
    let pairs_on_planes = PI * (2.0 * radius * density).powi(2) * (PI / 2.0 * radius) * q;
    let laws = [
        (q, 0.0),
        (first * surface * q, 0.0),
        (
            -(first * curvature - PI * PI / 32.0 * second * surface * surface) * q,
            2.0 * PI * pairs_on_planes,
        ),
        (
            (first - second * curvature * surface / (4.0 * PI) + PI / 384.0 * third * surface.powi(3)) * q,
            pairs,
        ),
    ];
    for (k, ((mean, error), (law, touching))) in averaged(&found).into_iter().zip(laws).enumerate() {
        // Student's t with 23 degrees of freedom exceeds 7.4 less than once in a million times; 2 % for the grid.
        let tolerance = 7.4 * error + 0.02 * law.abs() + touching;
        assert!(
            (mean - law).abs() < tolerance,
            "{k}: {mean} +- {error}, law {law}, {touching}"
        );
    }
}

/// Overlapping discs with area A and boundary L: L_A = λ L q, χ_A = (λ − λ² L² / 4π) q with q = exp(−λ A); the void has
/// the opposite Euler number.
#[test]
fn minkowski_functionals_of_overlapping_discs() {
    let (radius, density) = (12.0, 0.001_25);
    let found: Vec<Vec<f64>> = (0..60)
        .map(|seed| {
            let of = planar_functionals(outside_discs(240, radius, density, seed).view());
            vec![of.fraction, of.boundary_length, (of.euler_8 + of.euler_4) / 2.0]
        })
        .collect();
    let q = (-density * PI * radius * radius).exp();
    let length = 2.0 * PI * radius;
    // Two discs less than a pixel apart touch on the grid.
    let pairs = PI * density * density * 2.0 * radius * q;
    let laws = [
        (q, 0.0),
        (density * length * q, 0.0),
        (-(density - (density * length).powi(2) / (4.0 * PI)) * q, pairs),
    ];
    for (k, ((mean, error), (law, touching))) in averaged(&found).into_iter().zip(laws).enumerate() {
        let tolerance = T * error + 0.02 * law.abs() + touching;
        assert!(
            (mean - law).abs() < tolerance,
            "{k}: {mean} +- {error}, law {law}, {touching}"
        );
    }
}

/// Sections of overlapping spheres: S2 of the void phase follows the law of the spheres.
#[test]
fn two_point_correlation_of_overlapping_spheres() {
    let (radius, density) = (5.0, 0.0012);
    let volumes = 40;
    let of = |seed: u64| {
        let void = outside_spheres(48, radius, density, seed);
        // The volume and one of its sections have the same function.
        let volume = two_point(void.view(), 14);
        let section = two_point(void.index_axis(Axis(1), 24), 14);
        let line = |d: usize| volume[[14, 14, 14 + d]];
        (0..15)
            .map(line)
            .chain((0..15).map(|d| section[[14 + d, 14]]))
            .collect::<Vec<f64>>()
    };
    let curves: Vec<Vec<f64>> = (0..volumes).map(of).collect();
    for (k, (mean, error)) in averaged(&curves).iter().enumerate() {
        let (r, big) = ((k % 15) as f64, 4.0 * PI / 3.0 * radius.powi(3));
        let union = if r < 2.0 * radius {
            big * (1.0 + 3.0 * r / (4.0 * radius) - r.powi(3) / (16.0 * radius.powi(3)))
        } else {
            2.0 * big
        };
        let law = (-density * union).exp();
        assert!((mean - law).abs() < 7.0 * error, "{k}: {mean} +- {error}, law {law}");
    }
}

/// Squares of independent pixels contain a binomial number: variance φ (1 − φ) / side².
#[test]
fn local_porosity_of_noise_is_binomial() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let noise = Array2::from_shape_fn((512, 512), |_| rng.random::<f64>() < 0.3);
    for side in [1_usize, 4, 8] {
        let fractions = local_porosity(noise.view(), side);
        // Disjoint squares are independent.
        let disjoint: Vec<f64> = fractions
            .indexed_iter()
            .filter(|((y, x), _)| y % side == 0 && x % side == 0)
            .map(|(_, s)| *s)
            .collect();
        let n = disjoint.len() as f64;
        let mean = disjoint.iter().sum::<f64>() / n;
        let variance = disjoint.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / n;
        let law = 0.21 / (side * side) as f64;
        // Variance of a variance: about 2 σ⁴ / n; five standard errors.
        assert!(
            (variance / law - 1.0).abs() < 5.0 * (2.0 / n).sqrt(),
            "side {side}: {variance}, law {law}"
        );
        assert!((mean - 0.3).abs() < 5.0 * (law / n).sqrt());
    }
}

/// S2 of independent pixels is φ at displacement 0 and φ² elsewhere, and so are its radial means.
#[test]
fn two_point_correlation_of_noise() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let noise = Array2::from_shape_fn((300, 400), |_| rng.random::<f64>() < 0.4);
    let fraction = noise.iter().filter(|here| **here).count() as f64 / noise.len() as f64;
    let rings = radial_mean(two_point(noise.view(), 20).view());
    assert!((rings[0] - fraction).abs() < 1e-9);
    // A ring averages about a hundred displacements of 120,000 pairs each.
    assert!(
        rings[1..]
            .iter()
            .all(|s2| (s2 - fraction * fraction).abs() < 5.0 * 0.25 / 120_000_f64.sqrt())
    );
}
