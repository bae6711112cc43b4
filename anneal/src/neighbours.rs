//! Pairs of bodies that may touch, from a hierarchical grid of bounding spheres in a periodic box.
//!
//! Sizes of real aggregates spread over an order of magnitude. With one cell size set by the largest body, each cell
//! would hold hundreds of small bodies; here each body lies on the level whose cells fit its own reach, and searches
//! its own level and the coarser ones.

use crate::conversions::{compact, floor, index, truncated};
use crate::periodic_cells::PeriodicCells;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::convert::Infallible;
use std::ops::ControlFlow;

/// A candidate: body `other`, displaced by image number `image` of [`Images`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Neighbour {
    pub(crate) other: u32,
    pub(crate) image: u32,
}

/// The periodic images within reach and their displacements.
#[derive(Clone, Debug)]
pub(crate) struct Images {
    most: i64,
    shifts: Vec<Vector3<f64>>,
}

impl Images {
    fn new(sides: Vector3<f64>, longest_reach: f64) -> Self {
        // A centre in [0, side) searches cells within `longest_reach`: at most this many periods away.
        let most = floor((longest_reach / sides.min()).ceil()) + 1;
        let mut shifts = Vec::with_capacity(index(2 * most + 1).pow(3));
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
        index(period.iter().fold(0, |sum, p| sum * width + (p + self.most)))
    }

    /// Displacement of a candidate's image.
    pub(crate) fn shift(&self, image: u32) -> &Vector3<f64> {
        &self.shifts[image as usize]
    }
}

/// All pairs of bounding spheres whose gap is less than a skin, each pair of images once.
#[derive(Clone, Debug)]
pub(crate) struct Neighbours {
    pub(crate) images: Images,
    start: Vec<usize>,
    list: Vec<Neighbour>,
}

impl Neighbours {
    /// Finds the pairs of spheres (`centres` in the box, radii `reach`) whose surfaces are less than `skin` apart.
    ///
    /// Includes pairs of a body and its own images. O(N) for any spread of sizes at a given volume fraction.
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
                    grid.search(body, &centres[body], reach[body], &images, &mut list);
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

    /// Index of the first pair of `body` in the list of all pairs, and its pairs.
    pub(crate) fn of(&self, body: usize) -> (usize, &[Neighbour]) {
        let (from, to) = (self.start[body], self.start[body + 1]);
        (from, &self.list[from..to])
    }

    /// Number of all pairs.
    pub(crate) fn len(&self) -> usize {
        self.list.len()
    }
}

/// Bodies per task; fixed, so that the order of pairs does not depend on the number of threads.
const BLOCK: usize = 512;

struct Grid {
    skin: f64,
    levels: Vec<Level>,
    level_of: Vec<u8>,
}

struct Level {
    longest_reach: f64,
    cells: PeriodicCells,
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
                    .map(compact)
                    .collect();
                Level::new(&bodies, centres, reach, sides, skin)
            })
            .collect();
        Self { skin, levels, level_of }
    }

    fn search(&self, body: usize, centre: &Vector3<f64>, reach: f64, images: &Images, found: &mut Vec<Neighbour>) {
        let own = self.level_of[body] as usize;
        for (level_number, level) in self.levels.iter().enumerate().skip(own) {
            if level.members.is_empty() {
                continue;
            }
            let far = reach + level.longest_reach + self.skin;
            let ControlFlow::Continue(()) = level.cells.visit(centre, far, |cell, period| {
                let image = images.number(period);
                let from = centre - images.shifts[image];
                let members = &level.members[level.start[cell] as usize..level.start[cell + 1] as usize];
                for member in members {
                    let near = reach + member.reach + self.skin;
                    if (member.centre - from).norm_squared() >= near * near {
                        continue;
                    }
                    let other = member.body as usize;
                    // Within a level both bodies of a pair find each other: keep one. A body and its image: one of two
                    // opposite periods.
                    if level_number > own || other > body || (other == body && period > [0, 0, 0]) {
                        found.push(Neighbour {
                            other: member.body,
                            image: compact(image),
                        });
                    }
                }
                ControlFlow::<Infallible>::Continue(())
            });
        }
    }
}

/// Level of each body by its reach. Each level is about twice as coarse as the one before; sparsely filled levels join
/// the next.
pub(crate) fn levels(reach: &[f64]) -> Vec<u8> {
    let smallest = reach.iter().copied().fold(f64::INFINITY, f64::min);
    let fine: Vec<usize> = reach
        .iter()
        .map(|r| truncated((r / smallest).log2().floor()).min(60))
        .collect();
    let mut filled = [0_usize; 61];
    for &level in &fine {
        filled[level] += 1;
    }
    // A level gets its own cells only if it holds an eighth of all bodies or more, with the levels that joined it.
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
        // No more cells than a few per body, however small the bodies are.
        let cells = PeriodicCells::new(sides, 2.0 * longest_reach + skin, 4 * bodies.len() + 8, 4096);
        let cell_of = |body: u32| cells.of(&centres[body as usize]);
        let mut start = vec![0_u32; cells.len() + 1];
        for &body in bodies {
            start[cell_of(body) + 1] += 1;
        }
        for cell in 0..cells.len() {
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
