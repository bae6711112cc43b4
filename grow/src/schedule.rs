//! The schedule of filling: rounds of voxels whose windows do not contain each other, so that they can be filled at the
//! same time.

use ndarray::Array3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::neighbours::moved;
use crate::numbers::{number, small};
use crate::planes::Layout;

/// Random choices for a voxel, drawn before any value is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draw {
    /// Plane and turn of its window; `None` if no plane contains a voxel that was filled before.
    pub(crate) window: Option<(u8, u8)>,
    /// Chooses among the windows found, 0 to 1.
    pub(crate) choice: f32,
}

/// Voxels by round. A voxel's window contains only voxels of earlier rounds, and voxels later in the order, which do
/// not count; so filling round by round gives the same solid as filling one by one.
#[derive(Debug)]
pub(crate) struct Schedule {
    /// Place of each voxel in the order of filling; `u32::MAX` outside.
    pub(crate) place: Array3<u32>,
    /// Draws by place in the order.
    pub(crate) draws: Vec<Draw>,
    /// Places in the order, by round.
    pub(crate) rounds: Vec<Vec<u32>>,
}

/// `given` voxels at the beginning of the order have their values already.
pub(crate) fn schedule(
    order: &[[usize; 3]],
    given: usize,
    size: (usize, usize, usize),
    layouts: &[Vec<Layout>],
    seed: u64,
) -> Schedule {
    let mut place = Array3::from_elem(size, u32::MAX);
    for (at, voxel) in order.iter().enumerate() {
        place[*voxel] = number(at);
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
                    draw.window = Some((small(plane), small(turn)));
                    round = latest + 1;
                    break;
                }
            }
            round = round.max(1);
            round_of[at] = round;
            if rounds.len() < round as usize {
                rounds.resize(round as usize, Vec::new());
            }
            rounds[round as usize - 1].push(number(at));
        }
        draws.push(draw);
    }
    Schedule { place, draws, rounds }
}
