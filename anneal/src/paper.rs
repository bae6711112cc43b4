//! The way of the paper: "repeatedly searches for all collisions and then relaxes particle positions".
//!
//! # References
//!
//! Jagnow, Dorsey & Rushmeier 2004, section 4.1. The text gives neither step nor stopping rule; collisions are found anew at every iteration in a grid, every
//! colliding pair is pushed apart along its direction of contact by a part of its depth, all pairs at once, and orientations stay as they were drawn.

use crate::assembly::Assembly;
use crate::contacts::{Memory, Overlaps};
use crate::damped::{APART, End, Limits};
use nalgebra::Vector3;
use std::ops::ControlFlow;
use stereology_shape::PeriodicBox;

/// Part of a depth each particle of a pair yields in one iteration: more lets crowded particles jump to and fro.
const YIELD: f64 = 0.25;

/// Relaxes until no pair overlaps at true size. Energies are appended to `trace`.
pub(crate) fn relax(
    assembly: &mut Assembly<'_>,
    period: &PeriodicBox,
    limits: &Limits,
    trace: &mut Vec<f64>,
    progress: &dyn Fn(&Overlaps) -> ControlFlow<()>,
) -> End {
    let mut overlaps = Overlaps::default();
    let mut ways = vec![Vector3::zeros(); assembly.len()];
    for _ in 0..limits.iterations {
        assembly.wrap(period);
        let neighbours = assembly.neighbours(limits.swelling, 0.0);
        let mut memory = vec![Memory::NONE; if assembly.round { 0 } else { neighbours.len() }];
        assembly.overlaps(&neighbours, &mut memory, limits.swelling, &mut overlaps);
        trace.push(overlaps.energy);
        if overlaps.worst < APART {
            return End::Apart;
        }
        if progress(&overlaps).is_break() {
            return End::Cancelled;
        }
        ways.fill(Vector3::zeros());
        for push in overlaps.pushes() {
            ways[push.a as usize] -= push.force * YIELD;
            ways[push.b as usize] += push.force * YIELD;
        }
        for (i, way) in ways.iter().enumerate() {
            assembly.shift(i, way);
        }
    }
    End::Stuck
}
