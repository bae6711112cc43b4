//! Windows in planes through a voxel.

use nalgebra::Vector3;

/// The planes in which the windows about a voxel lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Planes {
    /// The three planes of the axes.
    #[default]
    Axis,
    /// Also the six planes diagonal to two axes and the four diagonal to all three; each pixel is the nearest voxel.
    Oblique,
}

/// The position of each pixel of a window, as a step (z, y, x) from the voxel; `None` for the centre and for pixels
/// whose nearest voxel belongs to another pixel.
pub(crate) type Layout = Vec<Option<[isize; 3]>>;

/// Layouts by plane, then by the eight rotations and reflections of the window (the first is the identity).
pub(crate) fn layouts(planes: Planes, reach: usize) -> Vec<Vec<Layout>> {
    frames(planes)
        .iter()
        .map(|frame| (0..8).map(|turn| layout(frame, reach, turn)).collect())
        .collect()
}

/// The layout of an image: rows down, columns to the right.
pub(crate) fn image_layout(reach: usize) -> Vec<Vec<Layout>> {
    vec![vec![layout(
        &[Vector3::new(0.0, 1.0, 0.0), Vector3::new(0.0, 0.0, 1.0)],
        reach,
        0,
    )]]
}

/// Directions (z, y, x) of the window's rows and columns.
fn frames(planes: Planes) -> Vec<[Vector3<f64>; 2]> {
    let [z, y, x] = [Vector3::x(), Vector3::y(), Vector3::z()];
    let mut frames = vec![[z, x], [z, y], [y, x]];
    if planes == Planes::Oblique {
        for (a, b, c) in [(z, y, x), (y, x, z), (x, z, y)] {
            frames.push([(a + b).normalize(), c]);
            frames.push([(a - b).normalize(), c]);
        }
        for normal in [z + y + x, z + y - x, z - y + x, -z + y + x] {
            let across = normal.cross(&(if normal.x > 0.0 { y } else { z })).normalize();
            frames.push([across, normal.normalize().cross(&across)]);
        }
    }
    frames
}

#[allow(clippy::cast_possible_truncation, reason = "a few voxels")]
fn layout(frame: &[Vector3<f64>; 2], reach: usize, turn: usize) -> Layout {
    let side = 2 * reach + 1;
    let place = |pixel: usize| {
        let (u, v) = (
            (pixel / side) as f64 - reach as f64,
            (pixel % side) as f64 - reach as f64,
        );
        let (u, v) = if turn & 1 == 1 { (v, u) } else { (u, v) };
        let u = if turn & 2 == 2 { -u } else { u };
        let v = if turn & 4 == 4 { -v } else { v };
        let exact = frame[0] * u + frame[1] * v;
        let nearest = exact.map(f64::round);
        (
            [nearest.x, nearest.y, nearest.z].map(|c| c as isize),
            (exact - nearest).norm(),
        )
    };
    let places: Vec<([isize; 3], f64)> = (0..side * side).map(place).collect();
    (0..places.len())
        .map(|pixel| {
            let (at, error) = places[pixel];
            let taken = places
                .iter()
                .enumerate()
                .any(|(other, (there, its_error))| *there == at && (*its_error, other) < (error, pixel));
            (at != [0; 3] && !taken).then_some(at)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{Planes, layouts};
    use std::collections::BTreeSet;

    /// A window in a plane of the axes has all its pixels, and its eight rotations and reflections are the same set of
    /// voxels.
    #[test]
    fn turns_permute_one_set() {
        let all = layouts(Planes::Oblique, 2);
        assert_eq!(all.len(), 13);
        for (plane, turns) in all.iter().enumerate() {
            let sets: Vec<BTreeSet<_>> = turns.iter().map(|l| l.iter().flatten().copied().collect()).collect();
            if plane < 3 {
                assert!(sets.iter().all(|set| set.len() == 24 && *set == sets[0]));
                // Rotated and reflected windows differ in the positions of their pixels.
                assert_eq!(turns.iter().collect::<BTreeSet<_>>().len(), 8);
            }
            assert!(sets.iter().all(|set| set.len() >= 14), "{plane}: {}", sets[0].len());
        }
    }
}
