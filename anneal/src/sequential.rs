//! Random sequential addition: "add one particle at a time, randomly testing orientations and translations until
//! sufficient vacant space is found".
//!
//! # References
//!
//! Jagnow, Dorsey & Rushmeier 2004, section 4.1, which dismisses it: "this method fills space inefficiently and works
//! only for loosely packed volumes". Random sequential addition of equal spheres ends at a fraction of .384 (Torquato
//! 2002); lognormal sizes, with the largest first as here, reach slightly more.

use crate::assembly::Assembly;
use crate::one_by_one::{OneByOne, anywhere};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use stereology_metrics::Progress;
use stereology_shape::{PeriodicBox, isotropic_rotation};

/// How the addition ended.
pub(crate) enum Filling {
    Complete {
        /// Positions tried for all particles together.
        tries: usize,
    },
    /// `placed` have a position, in order of size; `next` found none.
    Jammed {
        placed: Vec<usize>,
        next: usize,
    },
    Cancelled,
}

/// Adds all particles, the largest first, with at most `tries_each` random positions per particle.
pub(crate) fn fill(
    assembly: &mut Assembly<'_>,
    period: &PeriodicBox,
    tries_each: usize,
    seed: u64,
    progress: Progress<'_>,
) -> Filling {
    let mut order: Vec<usize> = (0..assembly.len()).collect();
    order.sort_by(|&i, &j| assembly.radius[j].total_cmp(&assembly.radius[i]).then(i.cmp(&j)));
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(STREAM);
    let mut tries = 0;
    let mut filled = OneByOne::empty(assembly, period, CLEARANCE);
    for (placed, &i) in order.iter().enumerate() {
        if progress(placed as f64 / order.len() as f64).is_break() {
            return Filling::Cancelled;
        }
        let found = (0..tries_each).any(|try_number| {
            tries += 1;
            // The first try is the given position.
            if try_number > 0 {
                let centre = anywhere(&mut rng, period);
                let rotation = isotropic_rotation(&mut rng);
                filled.try_pose(i, centre, rotation);
            }
            filled.vacant(i)
        });
        if !found {
            return Filling::Jammed {
                placed: order[..placed].to_vec(),
                next: i,
            };
        }
        filled.settle(i);
    }
    Filling::Complete { tries }
}

/// Particles keep a relative distance of this factor, so that rounding cannot produce an overlap that the certificate
/// finds.
pub(crate) const CLEARANCE: f64 = 1.0 + 1e-8;
const STREAM: u64 = 21;
