//! The method of the paper: "repeatedly searches for all collisions and then relaxes particle positions".
//!
//! # References
//!
//! Jagnow, Dorsey & Rushmeier 2004, section 4.1. The text gives neither step length nor stopping rule. Here, each
//! iteration finds all collisions in a grid and pushes every colliding pair apart along its contact direction by a
//! fraction of its depth, all pairs at once. Orientations do not change.

use crate::assembly::Assembly;
use crate::contacts::{Memory, Overlaps};
use crate::damped::{APART, End, Limits};
use nalgebra::Vector3;
use std::ops::ControlFlow;
use stereology_shape::PeriodicBox;

/// Fraction of the depth by which each particle of a pair moves in one iteration. With more, crowded particles
/// oscillate.
const FRACTION: f64 = 0.25;

/// Relaxes until no pair overlaps at true size. Energies are appended to `trace`.
pub(crate) fn relax(
    assembly: &mut Assembly<'_>,
    period: &PeriodicBox,
    limits: &Limits,
    trace: &mut Vec<f64>,
    progress: &dyn Fn(&Overlaps) -> ControlFlow<()>,
) -> End {
    let mut overlaps = Overlaps::default();
    let mut shifts = vec![Vector3::zeros(); assembly.len()];
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
        shifts.fill(Vector3::zeros());
        for push in overlaps.pushes() {
            shifts[push.a as usize] -= push.force * FRACTION;
            shifts[push.b as usize] += push.force * FRACTION;
        }
        for (i, shift) in shifts.iter().enumerate() {
            assembly.shift(i, shift);
        }
    }
    End::Stuck
}
