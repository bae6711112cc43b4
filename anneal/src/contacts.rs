//! The overlaps of particles, their energy and the forces that separate them.
//!
//! # Formula
//!
//! ```text
//! E = Σ over pairs ½ δ²,    δ = (1 + ε − γ) w   where γ < 1 + ε
//! ```
//!
//! `γ` is the gauge of the pair and `w` the width of the difference body along the direction found, so `δ` is the depth
//! of the overlap of the swollen bodies in that direction; for spheres `swollen radii − distance`. The force is `δ`
//! along that direction, at the contact point of the shrunken bodies: every contact has stiffness 1. (With depth
//! relative to the size of a particle, flat contacts of rods are stiffer than contacts at their ends, and packing takes
//! a thousand iterations instead of eighty.) For bodies represented by convex parts, pairs are pairs of parts. Unit of
//! energy: length².

use crate::assembly::Assembly;
use crate::conversions::compact;
use crate::gauge::{Gauge, Search};
use crate::neighbours::{Neighbour, Neighbours};
use nalgebra::Vector3;
use rayon::prelude::*;

/// One overlap: it pushes `b` by `force` at `on_b`, and `a` by the opposite force at `on_a` (relative to the
/// centroids).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Push {
    pub(crate) a: u32,
    pub(crate) b: u32,
    pub(crate) force: Vector3<f64>,
    pub(crate) on_a: Vector3<f64>,
    pub(crate) on_b: Vector3<f64>,
}

/// The overlaps of one arrangement, in blocks of fixed order.
#[derive(Debug, Default)]
pub(crate) struct Overlaps {
    blocks: Vec<Block>,
    pub(crate) energy: f64,
    /// Largest overlap at the true sizes, `1 − γ`; not positive if none.
    pub(crate) worst: f64,
}

#[derive(Debug, Default)]
struct Block {
    pushes: Vec<Push>,
    energy: f64,
    worst: f64,
}

impl Block {
    /// Adds the overlap of a pair, or of two parts of it at `arms` from the centres.
    fn overlap(&mut self, [a, b]: [usize; 2], swelling: f64, gauge: &Gauge, arms: [Vector3<f64>; 2]) {
        let depth = (swelling - gauge.value) * gauge.width;
        self.energy += 0.5 * depth * depth;
        self.worst = self.worst.max(1.0 - gauge.value);
        let normal = if gauge.value > 0.0 {
            gauge.normal
        } else {
            arbitrary(a, b)
        };
        self.pushes.push(Push {
            a: compact(a),
            b: compact(b),
            force: normal * depth,
            on_a: arms[0] + gauge.on_a * gauge.value.max(0.0),
            on_b: arms[1] + gauge.on_b * gauge.value.max(0.0),
        });
    }
}

impl Overlaps {
    /// All overlaps, always in the same order.
    pub(crate) fn pushes(&self) -> impl Iterator<Item = &Push> {
        self.blocks.iter().flat_map(|block| &block.pushes)
    }
}

/// State of a pair while it stays in the list.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Memory {
    /// The last direction that separated the pair, or came closest to it; zero if none yet.
    normal: Vector3<f64>,
    /// The pair cannot overlap before the distances that both have moved sum to this.
    safe_until: f64,
}

impl Memory {
    pub(crate) const NONE: Self = Self {
        normal: Vector3::new(0.0, 0.0, 0.0),
        safe_until: f64::NEG_INFINITY,
    };
}

/// Bodies per block; fixed, so that sums do not depend on the number of threads.
const BLOCK: usize = 256;

/// Below this number of bodies a second thread costs more than it saves.
const ALONE: usize = 2 * BLOCK;

/// Visitor of a pair of solids: vectors from the centres of the particles to those of the solids, and their gauge.
type Contact<'a> = dyn FnMut(&Vector3<f64>, &Vector3<f64>, &Gauge) + 'a;

impl Assembly<'_> {
    /// Energy of one pair, with `b` displaced by `shift`, at sizes times `swelling`; 0 if it is proved separate.
    pub(crate) fn pair_energy(&self, a: usize, b: usize, shift: &Vector3<f64>, swelling: f64) -> f64 {
        let offset = self.centre[b] + shift - self.centre[a];
        let squared = offset.norm_squared();
        let far = swelling * (self.reach(a) + self.reach(b));
        if squared >= far * far {
            return 0.0;
        }
        if self.round {
            let depth = far - squared.sqrt();
            return 0.5 * depth * depth;
        }
        let mut energy = 0.0;
        self.each_contact(a, b, &offset, swelling, swelling, &mut |_, _, gauge| {
            if gauge.value < swelling {
                energy += 0.5 * ((swelling - gauge.value) * gauge.width).powi(2);
            }
        });
        energy
    }

    /// Searches all pairs of solids of two particles whose bounding spheres overlap, until the quotient reaches
    /// `enough`.
    ///
    /// Returns the least gap between bounding spheres that do not overlap.
    fn each_contact(
        &self,
        a: usize,
        b: usize,
        offset: &Vector3<f64>,
        swelling: f64,
        enough: f64,
        visit: &mut Contact<'_>,
    ) -> f64 {
        let search = Search {
            enough,
            precision: 1e-4,
            steps: 24,
        };
        let mut safe = f64::INFINITY;
        let reach_of_b = swelling * self.reach(b);
        for (arm_a, reach_a, posed_a) in self.solids(a) {
            let from_a = offset - arm_a;
            let far = from_a.norm() - swelling * reach_a - reach_of_b;
            if far >= 0.0 {
                safe = safe.min(far);
                continue;
            }
            for (arm_b, reach_b, posed_b) in self.solids(b) {
                let between = from_a + arm_b;
                let far = between.norm() - swelling * (reach_a + reach_b);
                if far >= 0.0 {
                    safe = safe.min(far);
                } else {
                    let gauge = Gauge::search(&posed_a, &posed_b, &between, &search);
                    visit(&arm_a, &arm_b, &gauge);
                }
            }
        }
        safe
    }

    /// All overlaps at sizes times `swelling`.
    pub(crate) fn overlaps(
        &mut self,
        neighbours: &Neighbours,
        memory: &mut [Memory],
        swelling: f64,
        found: &mut Overlaps,
    ) {
        found.blocks.resize_with(self.len().div_ceil(BLOCK), Block::default);
        let this = &*self;
        if this.round {
            let work = |(number, block): (usize, &mut Block)| this.sphere_block(number, neighbours, swelling, block);
            if this.len() <= 4 * ALONE {
                found.blocks.iter_mut().enumerate().for_each(work);
            } else {
                found.blocks.par_iter_mut().enumerate().for_each(work);
            }
        } else {
            let mut parts = Vec::with_capacity(found.blocks.len());
            let mut rest = memory;
            for number in 0..found.blocks.len() {
                let from = neighbours.of(number * BLOCK).0;
                let to = if (number + 1) * BLOCK < this.len() {
                    neighbours.of((number + 1) * BLOCK).0
                } else {
                    neighbours.len()
                };
                let (part, later) = rest.split_at_mut(to - from);
                parts.push(part);
                rest = later;
            }
            let work = |(number, (block, part)): (usize, (&mut Block, &mut [Memory]))| {
                this.convex_block(number, neighbours, part, swelling, block);
            };
            if this.len() <= ALONE {
                found.blocks.iter_mut().zip(parts).enumerate().for_each(work);
            } else {
                found.blocks.par_iter_mut().zip(parts).enumerate().for_each(work);
            }
        }
        found.energy = found.blocks.iter().map(|b| b.energy).sum();
        found.worst = found.blocks.iter().map(|b| b.worst).fold(f64::NEG_INFINITY, f64::max);
    }

    fn sphere_block(&self, number: usize, neighbours: &Neighbours, swelling: f64, block: &mut Block) {
        block.pushes.clear();
        (block.energy, block.worst) = (0.0, f64::NEG_INFINITY);
        for a in number * BLOCK..self.len().min((number + 1) * BLOCK) {
            let (centre, radius) = (self.centre[a], self.radius[a]);
            for &Neighbour { other, image } in neighbours.of(a).1 {
                let b = other as usize;
                let offset = self.centre[b] + neighbours.images.shift(image) - centre;
                let touching = radius + self.radius[b];
                let swollen = touching * swelling;
                let squared = offset.norm_squared();
                if squared >= swollen * swollen || a == b {
                    continue;
                }
                let distance = squared.sqrt();
                let depth = swollen - distance;
                let force = if distance > 1e-12 * touching {
                    offset * (depth / distance)
                } else {
                    arbitrary(a, b) * depth
                };
                block.energy += 0.5 * depth * depth;
                block.worst = block.worst.max(1.0 - distance / touching);
                block.pushes.push(Push {
                    a: compact(a),
                    b: other,
                    force,
                    on_a: Vector3::zeros(),
                    on_b: Vector3::zeros(),
                });
            }
        }
    }

    fn convex_block(
        &self,
        number: usize,
        neighbours: &Neighbours,
        memory: &mut [Memory],
        swelling: f64,
        block: &mut Block,
    ) {
        block.pushes.clear();
        (block.energy, block.worst) = (0.0, f64::NEG_INFINITY);
        let first = neighbours.of(number * BLOCK).0;
        for a in number * BLOCK..self.len().min((number + 1) * BLOCK) {
            let (from, list) = neighbours.of(a);
            for (pair, &Neighbour { other, image }) in list.iter().enumerate() {
                let memory = &mut memory[from + pair - first];
                let b = other as usize;
                let travelled = self.travelled[a] + self.travelled[b];
                if travelled < memory.safe_until {
                    continue;
                }
                let offset = self.centre[b] + neighbours.images.shift(image) - self.centre[a];
                let single = self.single(a) && self.single(b);
                let meet = if single { Self::meet } else { Self::meet_by_parts };
                meet(self, a, b, &offset, travelled, swelling, memory, block);
            }
        }
    }

    #[expect(clippy::too_many_arguments, reason = "one step of the loop above, split for reading")]
    fn meet(
        &self,
        a: usize,
        b: usize,
        offset: &Vector3<f64>,
        travelled: f64,
        swelling: f64,
        memory: &mut Memory,
        block: &mut Block,
    ) {
        let squared = offset.norm_squared();
        let bounding = swelling * (self.reach(a) + self.reach(b));
        if squared >= bounding * bounding {
            memory.safe_until = travelled + squared.sqrt() - bounding;
            return;
        }
        let (pose_a, pose_b) = (self.posed(a), self.posed(b));
        if memory.normal != Vector3::zeros() {
            let (value, width) = Gauge::along(&pose_a, &pose_b, offset, &memory.normal);
            if value >= swelling {
                memory.safe_until = travelled + (value - swelling) * width;
                return;
            }
        }
        let search = Search {
            enough: swelling + PROVED_GAP,
            precision: 1e-4,
            steps: 24,
        };
        let gauge = Gauge::search(&pose_a, &pose_b, offset, &search);
        memory.normal = gauge.normal;
        if gauge.value >= swelling {
            memory.safe_until = travelled + (gauge.value - swelling) * gauge.width;
            return;
        }
        memory.safe_until = f64::NEG_INFINITY;
        block.overlap([a, b], swelling, &gauge, [Vector3::zeros(); 2]);
    }

    #[expect(clippy::too_many_arguments, reason = "as above")]
    fn meet_by_parts(
        &self,
        a: usize,
        b: usize,
        offset: &Vector3<f64>,
        travelled: f64,
        swelling: f64,
        memory: &mut Memory,
        block: &mut Block,
    ) {
        let far = offset.norm() - swelling * (self.reach(a) + self.reach(b));
        if far >= 0.0 {
            memory.safe_until = travelled + far;
            return;
        }
        let (mut safe, mut apart) = (f64::INFINITY, true);
        let spheres = self.each_contact(
            a,
            b,
            offset,
            swelling,
            swelling + PROVED_GAP,
            &mut |arm_a, arm_b, gauge| {
                if gauge.value >= swelling {
                    safe = safe.min((gauge.value - swelling) * gauge.width);
                    return;
                }
                apart = false;
                block.overlap([a, b], swelling, gauge, [*arm_a, *arm_b]);
            },
        );
        memory.safe_until = if apart {
            travelled + safe.min(spheres)
        } else {
            f64::NEG_INFINITY
        };
    }
}

/// A search continues past the first proof of separation until it has proved this relative gap, so that the pair need
/// not be searched again soon.
const PROVED_GAP: f64 = 0.05;

/// A direction for coinciding centres, the same every time.
fn arbitrary(a: usize, b: usize) -> Vector3<f64> {
    let angle = (a as f64 * 0.618 + b as f64 * 0.414).fract() * std::f64::consts::TAU;
    let height = ((a as f64 * 0.755 + b as f64 * 0.57).fract() * 2.0 - 1.0) * 0.99;
    let around = (1.0 - height * height).sqrt();
    Vector3::new(around * angle.cos(), around * angle.sin(), height)
}
