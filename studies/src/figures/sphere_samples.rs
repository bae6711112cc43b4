//! The distributions of figure 7, and the profiles of such spheres on ten equally spaced planes through a box of
//! spheres at random positions.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Poisson};

/// Side of the box in largest diameters; planes are farther apart than the largest diameter, so that no sphere is cut
/// twice.
pub const SIDE: f64 = 12.0;
/// Number of planes.
pub const PLANES: usize = 10;
/// Total area of the planes.
pub const AREA: f64 = PLANES as f64 * SIDE * SIDE;

/// A distribution of diameters on (0, 1].
pub struct Diameters {
    /// Name.
    pub name: &'static str,
    /// Density of diameters, not normalised.
    density: fn(f64) -> f64,
    /// Expected number of profiles.
    profiles: f64,
}

/// The four distributions of the paper.
pub const FIGURE_7: [Diameters; 4] = [
    Diameters {
        name: "single mode",
        density: |d| gauss(d, 0.55, 0.15),
        profiles: 1200.0,
    },
    Diameters {
        name: "bimodal",
        density: |d| gauss(d, 0.30, 0.08) + gauss(d, 0.75, 0.08),
        profiles: 1250.0,
    },
    Diameters {
        name: "lognormal",
        density: |d| gauss(d.ln(), 0.30_f64.ln(), 0.45) / d,
        profiles: 1150.0,
    },
    Diameters {
        name: "constant",
        density: |_| 1.0,
        profiles: 1300.0,
    },
];

/// Two narrow bands, which smooth estimates cannot represent.
pub const TWO_BANDS: Diameters = Diameters {
    name: "two bands",
    density: |d| f64::from(u8::from((0.3..0.4).contains(&d) || (0.7..0.8).contains(&d))),
    profiles: 1200.0,
};

/// A band on a broad mode, which is neither smooth nor sparse.
pub const BAND_ON_MODE: Diameters = Diameters {
    name: "band on a broad mode",
    density: |d| gauss(d, 0.40, 0.12) + f64::from(u8::from((0.74..0.78).contains(&d))) * 5.0,
    profiles: 1200.0,
};

/// With a tenth of the profiles two modes resemble two bands.
pub const FEW: Diameters = Diameters {
    name: "bimodal with 125 profiles",
    density: |d| gauss(d, 0.30, 0.08) + gauss(d, 0.75, 0.08),
    profiles: 125.0,
};

fn gauss(x: f64, mean: f64, deviation: f64) -> f64 {
    (-0.5 * ((x - mean) / deviation).powi(2)).exp()
}

const STEPS: usize = 20_000;

/// A distribution prepared for sampling.
pub struct Population {
    cumulative: Vec<f64>,
    /// Spheres per unit volume.
    pub number_density: f64,
    /// Mean diameter.
    pub mean: f64,
    /// Volume fraction of the spheres.
    pub volume_fraction: f64,
}

impl Diameters {
    /// The number density that gives the expected number of profiles: N_A = ⟨D⟩ N_V, eq. (1).
    pub fn population(&self) -> Population {
        let at = |i: usize| (i as f64 + 0.5) / STEPS as f64;
        let whole: f64 = (0..STEPS).map(|i| (self.density)(at(i))).sum();
        let moment = |power: i32| {
            (0..STEPS)
                .map(|i| at(i).powi(power) * (self.density)(at(i)))
                .sum::<f64>()
                / whole
        };
        let number_density = self.profiles / (AREA * moment(1));
        let cumulative = (0..STEPS).scan(0.0, |sum, i| {
            *sum += (self.density)(at(i)) / whole;
            Some(*sum)
        });
        Population {
            cumulative: cumulative.collect(),
            number_density,
            mean: moment(1),
            volume_fraction: number_density * std::f64::consts::PI / 6.0 * moment(3),
        }
    }
}

/// The profiles of a sample.
#[derive(Default)]
pub struct Profiles {
    /// Diameters of the profiles.
    pub sizes: Vec<f64>,
    /// Diameters of their spheres.
    pub cut: Vec<f64>,
    /// Plane of each profile.
    pub planes: Vec<usize>,
}

impl Population {
    /// Draws a diameter.
    pub fn draw(&self, rng: &mut ChaCha8Rng) -> f64 {
        let place: f64 = rng.random();
        let step = self.cumulative.partition_point(|c| *c < place).min(STEPS - 1);
        (step as f64 + rng.random::<f64>().max(1e-9)) / STEPS as f64
    }

    /// Spheres per unit volume in each of `bins` equal bins.
    pub fn densities(&self, bins: usize) -> Vec<f64> {
        let up_to = |bin: usize| {
            if bin == 0 {
                0.0
            } else {
                self.cumulative[bin * STEPS / bins - 1]
            }
        };
        (0..bins)
            .map(|bin| self.number_density * (up_to(bin + 1) - up_to(bin)))
            .collect()
    }

    /// Draws spheres and returns their profiles on the planes.
    pub fn profiles(&self, seed: u64) -> Profiles {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let expected = self.number_density * SIDE.powi(3);
        let count = Poisson::new(expected).map_or(0.0, |of| of.sample(&mut rng));
        let offset: f64 = rng.random();
        let mut profiles = Profiles::default();
        let mut left = count;
        while left > 0.0 {
            left -= 1.0;
            let diameter = self.draw(&mut rng);
            let height = SIDE * rng.random::<f64>();
            for plane in 0..PLANES {
                let apart = (height - (plane as f64 + offset) * SIDE / PLANES as f64).abs();
                let chord = diameter.powi(2) - 4.0 * apart.min(SIDE - apart).powi(2);
                if chord > 0.0 {
                    profiles.sizes.push(chord.sqrt());
                    profiles.cut.push(diameter);
                    profiles.planes.push(plane);
                }
            }
        }
        profiles
    }
}

/// Relative |error of the total|, and L1 distances of the histograms normalised by number and by volume.
pub fn scores(found: &[f64], truth: &[f64]) -> [f64; 3] {
    let bins = truth.len() as f64;
    let normalised = |values: Vec<f64>| {
        let whole: f64 = values.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        values.into_iter().map(|value| value / whole).collect::<Vec<_>>()
    };
    let volume = |values: &[f64]| {
        let cube = |j: usize| {
            let (a, b) = (j as f64 / bins, (j as f64 + 1.0) / bins);
            0.25 * (a + b) * (a * a + b * b)
        };
        normalised(values.iter().enumerate().map(|(j, value)| value * cube(j)).collect())
    };
    let apart = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(&b).map(|(a, b)| (a - b).abs()).sum::<f64>();
    let (sum, whole): (f64, f64) = (found.iter().sum(), truth.iter().sum());
    [
        (sum / whole - 1.0).abs(),
        apart(normalised(found.to_vec()), normalised(truth.to_vec())),
        apart(volume(found), volume(truth)),
    ]
}
