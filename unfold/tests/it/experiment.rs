//! The experiment of the paper's figure 7: a periodic box of spheres, ten slices, the profiles counted, the densities
//! known.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Poisson};

/// Two narrow bands of sizes, with its number of profiles.
pub(crate) const TWO_BANDS: (&str, f64) = ("twoband", 1200.0);

/// Size distributions on (0, 1], with the number of profiles they are to show.
pub(crate) const DISTRIBUTIONS: [(&str, f64); 4] = [
    ("single", 1200.0),
    ("bimodal", 1250.0),
    ("lognormal", 1150.0),
    ("constant", 1300.0),
];

const SIDE: f64 = 12.0;
const SLICES: usize = 10;
pub(crate) const AREA: f64 = SLICES as f64 * SIDE * SIDE;

fn density(name: &str, x: f64) -> f64 {
    let bell = |middle: f64, width: f64| (-0.5 * ((x - middle) / width).powi(2)).exp();
    match name {
        "single" => bell(0.55, 0.15),
        "bimodal" => bell(0.30, 0.08) + bell(0.75, 0.08),
        "lognormal" => (-0.5 * ((x.ln() - 0.30_f64.ln()) / 0.45).powi(2)).exp() / x,
        "twoband" => f64::from(u8::from((x > 0.3 && x < 0.4) || (x > 0.7 && x < 0.8))),
        _ => 1.0,
    }
}

/// A distribution with the number density that shows the wanted number of profiles: N_A = ⟨D⟩ N_V.
pub(crate) struct Design {
    /// Cumulative shares on a grid of (0, 1].
    cumulative: Vec<f64>,
    number_density: f64,
}

impl Design {
    pub(crate) fn new(name: &str, profiles: f64) -> Self {
        let grid = 20_000;
        let values: Vec<f64> = (0..grid)
            .map(|k| density(name, (f64::from(k) + 0.5) / f64::from(grid)))
            .collect();
        let total: f64 = values.iter().sum();
        let mean: f64 = values
            .iter()
            .enumerate()
            .map(|(k, v)| v / total * (k as f64 + 0.5) / f64::from(grid))
            .sum();
        let mut sum = 0.0;
        let cumulative = std::iter::once(0.0)
            .chain(values.iter().map(|v| {
                sum += v / total;
                sum
            }))
            .collect();
        Self {
            cumulative,
            number_density: profiles / (AREA * mean),
        }
    }

    /// Spheres per unit volume in each of `bins` equal bins.
    pub(crate) fn densities(&self, bins: usize) -> Vec<f64> {
        let cells = (self.cumulative.len() - 1) / bins;
        (0..bins)
            .map(|j| self.number_density * (self.cumulative[(j + 1) * cells] - self.cumulative[j * cells]))
            .collect()
    }

    /// Diameters of the profiles on ten equally spaced slices of a box of spheres, of random number, sizes and heights.
    pub(crate) fn profiles(&self, seed: u64) -> Vec<f64> {
        let profiles = self.profiles_with_sizes(seed).into_iter();
        profiles.map(|(profile, _)| profile).collect()
    }

    /// The same, each with the diameter of its sphere.
    pub(crate) fn profiles_with_sizes(&self, seed: u64) -> Vec<(f64, f64)> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let count = Poisson::new(self.number_density * SIDE.powi(3))
            .unwrap()
            .sample(&mut rng);
        let shift: f64 = rng.random();
        let mut profiles = Vec::new();
        let mut left = count;
        while left > 0.0 {
            left -= 1.0;
            let share: f64 = rng.random();
            let above = self.cumulative.partition_point(|&c| c < share).max(1);
            let (low, high) = (self.cumulative[above - 1], self.cumulative[above]);
            let diameter = (above as f64 - 1.0 + (share - low) / (high - low)) / (self.cumulative.len() - 1) as f64;
            let height = SIDE * rng.random::<f64>();
            for slice in 0..SLICES {
                let apart = (height - (slice as f64 + shift) * SIDE / SLICES as f64).abs();
                let apart = apart.min(SIDE - apart);
                if 2.0 * apart < diameter {
                    profiles.push(((diameter * diameter - 4.0 * apart * apart).sqrt(), diameter));
                }
            }
        }
        profiles
    }
}

/// |relative error of the total|, L1 distance of the normalised histograms by number and by volume.
pub(crate) fn scores(found: &[f64], truth: &[f64], edges: &[f64]) -> [f64; 3] {
    let normalised = |values: Vec<f64>| {
        let total: f64 = values.iter().sum();
        values.into_iter().map(|value| value / total).collect::<Vec<_>>()
    };
    let volume = |values: &[f64]| {
        let bins = values.iter().zip(edges.windows(2));
        normalised(
            bins.map(|(value, bin)| value * (bin[1].powi(4) - bin[0].powi(4)) / (bin[1] - bin[0]))
                .collect(),
        )
    };
    let apart = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(&b).map(|(a, b)| (a - b).abs()).sum::<f64>();
    let (found_total, total) = (found.iter().sum::<f64>(), truth.iter().sum::<f64>());
    [
        (found_total / total - 1.0).abs(),
        apart(normalised(found.to_vec()), normalised(truth.to_vec())),
        apart(volume(found), volume(truth)),
    ]
}
