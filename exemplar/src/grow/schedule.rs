//! Which voxel can be filled when: an order of filling, and the rounds in which voxels that do not see each other are filled at once.
#![allow(
    clippy::cast_possible_truncation,
    reason = "texels, voxels and cells are fewer than 2^32: `grow` refuses more"
)]

use super::planes::Layout;
use super::voxels::moved;
use ndarray::Array3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What was drawn for a voxel before any value is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Draw {
    /// Plane and turn of its window; `None` if no plane shows anything that was filled before.
    pub window: Option<(u8, u8)>,
    /// Chooses among the windows that are found, 0 to 1.
    pub choice: f32,
}

/// Voxels by round: a voxel's window shows only voxels of earlier rounds, or later ones of the order, which do not count. Filling round by round gives the same solid as filling one by one.
#[derive(Debug)]
pub(super) struct Schedule {
    /// Place of each voxel in the order of filling; `u32::MAX` outside.
    pub place: Array3<u32>,
    /// Draws by place in the order.
    pub draws: Vec<Draw>,
    /// Places in the order, by round.
    pub rounds: Vec<Vec<u32>>,
}

/// `given` voxels at the beginning of the order have their values already.
pub(super) fn schedule(
    order: &[[usize; 3]],
    given: usize,
    size: (usize, usize, usize),
    layouts: &[Vec<Layout>],
    seed: u64,
) -> Schedule {
    let mut place = Array3::from_elem(size, u32::MAX);
    for (at, voxel) in order.iter().enumerate() {
        place[*voxel] = at as u32;
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut rounds: Vec<Vec<u32>> = Vec::new();
    let mut round_of = vec![0_u32; order.len()];
    let mut draws = Vec::with_capacity(order.len());
    for (at, voxel) in order.iter().enumerate() {
        let (first, turn, choice) = (
            rng.random_range(0..layouts.len().max(1)),
            rng.random_range(0..layouts.first().map_or(1, Vec::len)),
            rng.random::<f32>(),
        );
        let mut draw = Draw { window: None, choice };
        let mut round = 0;
        if at >= given {
            for k in 0..layouts.len() {
                let plane = (first + k) % layouts.len();
                let latest = layouts[plane][turn]
                    .iter()
                    .flatten()
                    .filter_map(|step| moved(*voxel, *step).and_then(|near| place.get(near)))
                    .filter(|&&other| (other as usize) < at)
                    .map(|&other| round_of[other as usize])
                    .max();
                if let Some(latest) = latest {
                    draw.window = Some((plane as u8, turn as u8));
                    round = latest + 1;
                    break;
                }
            }
            round = round.max(1);
            round_of[at] = round;
            if rounds.len() < round as usize {
                rounds.resize(round as usize, Vec::new());
            }
            rounds[round as usize - 1].push(at as u32);
        }
        draws.push(draw);
    }
    Schedule { place, draws, rounds }
}
