//! Which bodies may touch: a hierarchical grid of bounding spheres in a box that repeats.
//!
//! Sizes of real aggregates spread over an order of magnitude. One cell size set by the largest body puts hundreds of small ones into each cell;
//! here every body lives on the level whose cells fit its own reach, and asks its own level and the coarser ones.
//!
//! Cells are asked by unwrapped number: number `k` of `n` along an axis is cell `k mod n` seen in the period `floor(k / n)`. Every periodic image is met
//! once and none is missed, whether an axis has one cell or a thousand and whether a body is smaller or larger than the box.

use nalgebra::Vector3;
use rayon::prelude::*;

/// One candidate: body `other`, displaced by the period number `image` of [`Images`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Neighbour {
    pub(crate) other: u32,
    pub(crate) image: u32,
}

/// The periods within reach and their displacements.
#[derive(Clone, Debug)]
pub(crate) struct Images {
    most: i64,
    shifts: Vec<Vector3<f64>>,
}

impl Images {
    fn new(sides: Vector3<f64>, longest_reach: f64) -> Self {
        // A centre in [0, side) asks cells within `longest_reach`: at most this many periods away.
        let most = (longest_reach / sides.min()).ceil() as i64 + 1;
        let mut shifts = Vec::with_capacity((2 * most as usize + 1).pow(3));
        for x in -most..=most {
            for y in -most..=most {
                for z in -most..=most {
                    shifts.push(Vector3::new(x as f64, y as f64, z as f64).component_mul(&sides));
                }
            }
        }
        Self { most, shifts }
    }

    fn number(&self, period: [i64; 3]) -> usize {
        let width = 2 * self.most + 1;
        period.iter().fold(0, |sum, p| sum * width + (p + self.most)) as usize
    }

    /// The displacement of a candidate's image.
    pub(crate) fn shift(&self, image: u32) -> &Vector3<f64> {
        &self.shifts[image as usize]
    }
}

/// All pairs of bounding spheres nearer than a skin, each pair of images once.
#[derive(Clone, Debug)]
pub(crate) struct Neighbours {
    pub(crate) images: Images,
    start: Vec<usize>,
    list: Vec<Neighbour>,
}

impl Neighbours {
    /// Finds the pairs of spheres (`centres` in the box, radii `reach`) whose surfaces are nearer than `skin`.
    ///
    /// A body meets its own images too. O(N) for any spread of sizes at a given volume fraction.
    pub(crate) fn find(centres: &[Vector3<f64>], reach: &[f64], sides: Vector3<f64>, skin: f64) -> Self {
        let largest = reach.iter().copied().fold(0.0, f64::max);
        let images = Images::new(sides, 2.0 * largest + skin);
        let grid = Grid::new(centres, reach, sides, skin);
        let blocks: Vec<(Vec<Neighbour>, Vec<usize>)> = (0..centres.len().div_ceil(BLOCK))
            .into_par_iter()
            .map(|block| {
                let mut list = Vec::with_capacity(16 * BLOCK);
                let mut counts = Vec::with_capacity(BLOCK);
                for body in block * BLOCK..centres.len().min((block + 1) * BLOCK) {
                    let before = list.len();
                    grid.ask(body, &centres[body], reach[body], &images, &mut list);
                    counts.push(list.len() - before);
                }
                (list, counts)
            })
            .collect();
        let mut start = Vec::with_capacity(centres.len() + 1);
        start.push(0);
        let mut list = Vec::with_capacity(blocks.iter().map(|b| b.0.len()).sum());
        let mut end = 0;
        for (found, counts) in blocks {
            list.extend_from_slice(&found);
            for count in counts {
                end += count;
                start.push(end);
            }
        }
        Self { images, start, list }
    }

    /// The number of the first pair of `body` in the list of all pairs, and its pairs.
    pub(crate) fn of(&self, body: usize) -> (usize, &[Neighbour]) {
        let (from, to) = (self.start[body], self.start[body + 1]);
        (from, &self.list[from..to])
    }

    /// All pairs together.
    pub(crate) fn len(&self) -> usize {
        self.list.len()
    }
}

/// Bodies asked by one task; fixed, so that the order of pairs does not depend on threads.
const BLOCK: usize = 512;

struct Grid {
    sides: Vector3<f64>,
    skin: f64,
    levels: Vec<Level>,
    level_of: Vec<u8>,
}

struct Level {
    longest_reach: f64,
    cells: [i64; 3],
    start: Vec<u32>,
    members: Vec<Member>,
}

#[derive(Clone, Copy)]
struct Member {
    centre: Vector3<f64>,
    reach: f64,
    body: u32,
}

impl Grid {
    fn new(centres: &[Vector3<f64>], reach: &[f64], sides: Vector3<f64>, skin: f64) -> Self {
        let level_of = levels(reach);
        let count = level_of.iter().copied().max().map_or(0, |l| l as usize + 1);
        let levels = (0..count)
            .map(|level| {
                let bodies: Vec<u32> = (0..reach.len())
                    .filter(|&i| level_of[i] as usize == level)
                    .map(|i| i as u32)
                    .collect();
                Level::new(&bodies, centres, reach, sides, skin)
            })
            .collect();
        Self {
            sides,
            skin,
            levels,
            level_of,
        }
    }

    fn ask(&self, body: usize, centre: &Vector3<f64>, reach: f64, images: &Images, found: &mut Vec<Neighbour>) {
        let own = self.level_of[body] as usize;
        for (number, level) in self.levels.iter().enumerate().skip(own) {
            if level.members.is_empty() {
                continue;
            }
            let far = reach + level.longest_reach + self.skin;
            let mut ranges = [[(0_i64, 0_i64); 2]; 3];
            for axis in 0..3 {
                let scale = level.cells[axis] as f64 / self.sides[axis];
                ranges[axis][0] = (
                    ((centre[axis] - far) * scale).floor() as i64,
                    ((centre[axis] + far) * scale).floor() as i64,
                );
            }
            let [nx, ny, nz] = level.cells;
            for kx in ranges[0][0].0..=ranges[0][0].1 {
                let (cx, px) = (kx.rem_euclid(nx), kx.div_euclid(nx));
                for ky in ranges[1][0].0..=ranges[1][0].1 {
                    let (cy, py) = (ky.rem_euclid(ny), ky.div_euclid(ny));
                    for kz in ranges[2][0].0..=ranges[2][0].1 {
                        let (cz, pz) = (kz.rem_euclid(nz), kz.div_euclid(nz));
                        let cell = ((cx * ny + cy) * nz + cz) as usize;
                        let image = images.number([px, py, pz]);
                        let from = centre - images.shifts[image];
                        let members = &level.members[level.start[cell] as usize..level.start[cell + 1] as usize];
                        for member in members {
                            let near = reach + member.reach + self.skin;
                            if (member.centre - from).norm_squared() >= near * near {
                                continue;
                            }
                            let other = member.body as usize;
                            // Within a level both bodies of a pair find each other: keep one. A body and its image: one of two opposite periods.
                            if number > own || other > body || (other == body && [px, py, pz] > [0, 0, 0]) {
                                found.push(Neighbour {
                                    other: member.body,
                                    image: image as u32,
                                });
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Levels by reach, each about twice as coarse as the one before; sparsely filled ones join the next.
pub(crate) fn levels(reach: &[f64]) -> Vec<u8> {
    let smallest = reach.iter().copied().fold(f64::INFINITY, f64::min);
    let fine: Vec<usize> = reach
        .iter()
        .map(|r| ((r / smallest).log2().floor() as usize).min(60))
        .collect();
    let mut filled = [0_usize; 61];
    for &level in &fine {
        filled[level] += 1;
    }
    // A level is worth its own cells only if it holds a good part of all bodies up to it.
    let mut name = [0_u8; 61];
    let (mut next, mut below) = (0_u8, 0_usize);
    for level in 0..61 {
        name[level] = next;
        below += filled[level];
        if 8 * below >= reach.len() {
            next += 1;
            below = 0;
        }
    }
    fine.into_iter().map(|level| name[level]).collect()
}

impl Level {
    fn new(bodies: &[u32], centres: &[Vector3<f64>], reach: &[f64], sides: Vector3<f64>, skin: f64) -> Self {
        let longest_reach = bodies.iter().map(|&b| reach[b as usize]).fold(0.0, f64::max);
        let wanted = (2.0 * longest_reach + skin).max(f64::MIN_POSITIVE);
        // No more cells than a few for each body, however small the bodies are.
        let most = ((4 * bodies.len() + 8) as f64).cbrt();
        let mean_side = sides.product().cbrt();
        let cells: [i64; 3] = std::array::from_fn(|axis| {
            let fit = (sides[axis] / wanted).min(most * sides[axis] / mean_side);
            (fit.floor() as i64).clamp(1, 4096)
        });
        let cell_of = |body: u32| {
            let at: [i64; 3] = std::array::from_fn(|axis| {
                let cell = (centres[body as usize][axis] * (cells[axis] as f64 / sides[axis])).floor() as i64;
                cell.clamp(0, cells[axis] - 1)
            });
            ((at[0] * cells[1] + at[1]) * cells[2] + at[2]) as usize
        };
        let count = (cells[0] * cells[1] * cells[2]) as usize;
        let mut start = vec![0_u32; count + 1];
        for &body in bodies {
            start[cell_of(body) + 1] += 1;
        }
        for cell in 0..count {
            start[cell + 1] += start[cell];
        }
        let mut next = start.clone();
        let nothing = Member {
            centre: Vector3::zeros(),
            reach: 0.0,
            body: 0,
        };
        let mut members = vec![nothing; bodies.len()];
        for &body in bodies {
            let place = &mut next[cell_of(body)];
            members[*place as usize] = Member {
                centre: centres[body as usize],
                reach: reach[body as usize],
                body,
            };
            *place += 1;
        }
        Self {
            longest_reach,
            cells,
            start,
            members,
        }
    }
}
