//! Coverage of intervals where particles are clustered: spheres in clusters (Neyman-Scott), cut by a plane.
//!
//! `cargo run --release -p stereology-unfold --example clustered -- [REPEATS]`
//!
//! One row per number of profiles, members per cluster and radius of the clusters (in sides of the photograph): the
//! variance of the number of profiles over its mean, how often p is below 0.1 and 0.01, and the coverage of nominal
//! 90 % intervals of the total and of the mean size with Poisson counts and with blocks where p is below 0.1.
#![allow(
    clippy::print_stdout,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a study prints its table; counts are far below 2^53"
)]

#[path = "designs/spheres.rs"]
mod spheres;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Poisson, StandardNormal};
use spheres::spheres;
use std::error::Error;
use std::f64::consts::PI;
use stereology_unfold::{Bootstrap, ProfileCounts, Resampling, Tiling, UnfoldOptions, Unfolding, clustering, unfold};

/// Spread of the logarithms of the sizes.
const SIGMA: f64 = 0.3;
/// Expected area fraction of the profiles.
const AREA_FRACTION: f64 = 0.15;

/// Spheres in clusters, and a photograph of side 1 with a number of profiles.
struct Design {
    profiles: f64,
    /// Members of a cluster; 0: no clusters.
    members: f64,
    radius: f64,
}

const DESIGNS: [Design; 12] = [
    Design {
        profiles: 60.0,
        members: 0.0,
        radius: 0.0,
    },
    Design {
        profiles: 190.0,
        members: 0.0,
        radius: 0.0,
    },
    Design {
        profiles: 1000.0,
        members: 0.0,
        radius: 0.0,
    },
    Design {
        profiles: 60.0,
        members: 20.0,
        radius: 0.1,
    },
    Design {
        profiles: 190.0,
        members: 5.0,
        radius: 0.1,
    },
    Design {
        profiles: 190.0,
        members: 20.0,
        radius: 0.05,
    },
    Design {
        profiles: 190.0,
        members: 20.0,
        radius: 0.1,
    },
    Design {
        profiles: 190.0,
        members: 60.0,
        radius: 0.15,
    },
    Design {
        profiles: 190.0,
        members: 60.0,
        radius: 0.25,
    },
    Design {
        profiles: 600.0,
        members: 20.0,
        radius: 0.1,
    },
    Design {
        profiles: 600.0,
        members: 60.0,
        radius: 0.1,
    },
    Design {
        profiles: 1000.0,
        members: 10.0,
        radius: 0.05,
    },
];

impl Design {
    /// Median diameter.
    fn median(&self) -> f64 {
        // Mean area of a profile: (2/3) π/4 <D³>/<D>.
        (AREA_FRACTION / self.profiles * 6.0 / PI * (-4.0 * SIGMA * SIGMA).exp()).sqrt()
    }

    fn mean(&self) -> f64 {
        self.median() * (0.5 * SIGMA * SIGMA).exp()
    }

    /// Particles per unit volume.
    fn density(&self) -> f64 {
        self.profiles / self.mean()
    }

    /// Centres and sizes of the profiles on the photograph. All whose centre lies on it count (plus-sampling).
    fn profiles(&self, rng: &mut ChaCha8Rng) -> (Vec<[f64; 2]>, Vec<f64>) {
        let (clustered, members) = (self.members > 0.0, self.members.max(1.0));
        let reach = 5.0 * self.median();
        let (side, half) = (1.0 + 2.0 * self.radius, self.radius + reach);
        let clusters =
            Poisson::new(self.density() / members * side * side * 2.0 * half).map_or(0.0, |law| law.sample(rng));
        let (mut points, mut sizes) = (Vec::new(), Vec::new());
        for _ in 0..clusters as usize {
            let mut within = |from: f64, to: f64| from + (to - from) * rng.random::<f64>();
            let centre = [
                within(-self.radius, 1.0 + self.radius),
                within(-self.radius, 1.0 + self.radius),
                within(-half, half),
            ];
            let count = if clustered {
                Poisson::new(members).map_or(0.0, |law| law.sample(rng))
            } else {
                1.0
            };
            for _ in 0..count as usize {
                let [x, y, z] = ball(rng);
                let normal: f64 = StandardNormal.sample(rng);
                let size = self.median() * (SIGMA * normal).exp();
                let squared = size * size - 4.0 * (centre[2] + self.radius * z).powi(2);
                let point = [centre[0] + self.radius * x, centre[1] + self.radius * y];
                if squared > 0.0 && point.iter().all(|of| (0.0..1.0).contains(of)) {
                    points.push(point);
                    sizes.push(squared.sqrt());
                }
            }
        }
        (points, sizes)
    }
}

/// A point of the unit ball.
fn ball(rng: &mut ChaCha8Rng) -> [f64; 3] {
    loop {
        let point: [f64; 3] = std::array::from_fn(|_| 2.0 * rng.random::<f64>() - 1.0);
        if point.iter().map(|of| of * of).sum::<f64>() <= 1.0 {
            return point;
        }
    }
}

fn options(resampling: Resampling, seed: u64) -> UnfoldOptions {
    UnfoldOptions::default().with_bootstrap(Bootstrap {
        seed,
        resampling,
        ..Bootstrap::default()
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let repeats: u64 = std::env::args().nth(1).map_or(Ok(100), |text| text.parse())?;
    println!(
        "profiles members radius | variance / mean | p < .1  < .01 | Poisson: total  mean | blocks if p < .1: total  mean"
    );
    for design in &DESIGNS {
        let (mut numbers, mut used, mut reported) = (Vec::new(), 0_u32, 0_u32);
        let mut held = [[0_u32; 2]; 2];
        for repeat in 0..repeats {
            let mut rng = ChaCha8Rng::seed_from_u64(repeat);
            let (points, sizes) = design.profiles(&mut rng);
            numbers.push(sizes.len() as f64);
            let (edges, kernel) = spheres(&sizes, None)?;
            let found = clustering(&points, &sizes).filter(|of| of.p_value < 0.1);
            used += u32::from(found.is_some());
            reported += u32::from(found.is_some_and(|of| of.p_value < 0.01));
            let poisson = ProfileCounts::from_sizes(&sizes, None, &edges, 1.0)?;
            let with_poisson = unfold(&poisson, &kernel, &options(Resampling::Counts, repeat))?;
            let tiling = found.and_then(|of| Tiling::new(&points, None, of.dispersion));
            let with_blocks = match &tiling {
                None => with_poisson.clone(),
                Some(tiling) => {
                    let counts = ProfileCounts::from_tiles(&sizes, None, &points, tiling, &edges, 1.0)?;
                    unfold(&counts, &kernel, &options(Resampling::Blocks, repeat))?
                }
            };
            for (held, found) in held.iter_mut().zip([with_poisson, with_blocks]) {
                let (total, mean) = covered(&found, design);
                held[0] += u32::from(total);
                held[1] += u32::from(mean);
            }
        }
        let n = repeats as f64;
        let mean = numbers.iter().sum::<f64>() / n;
        let variance = numbers.iter().map(|of| (of - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let share = |of: u32| f64::from(of) / n;
        println!(
            "{:8} {:7} {:6} | {:15.1} | {:6.2} {:6.3} | {:14.2} {:5.2} | {:23.2} {:5.2}",
            design.profiles,
            design.members,
            design.radius,
            variance / mean,
            share(used),
            share(reported),
            share(held[0][0]),
            share(held[0][1]),
            share(held[1][0]),
            share(held[1][1])
        );
    }
    Ok(())
}

/// Whether the intervals of the total and of the mean size contain the truth.
fn covered(found: &Unfolding, design: &Design) -> (bool, bool) {
    let holds = |of: stereology_unfold::Estimate, truth: f64| {
        of.interval.is_some_and(|of| of.lower <= truth && truth <= of.upper)
    };
    (
        holds(found.total, design.density()),
        holds(found.mean_size, design.mean()),
    )
}
