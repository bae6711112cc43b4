//! Neighbouring voxels of a mask.

use ndarray::ArrayView3;

/// The 26 steps (z, y, x) from a voxel to its neighbours.
pub(crate) fn neighbours() -> impl Iterator<Item = [isize; 3]> {
    (0..27)
        .filter(|step| *step != 13)
        .map(|step: isize| [step / 9 - 1, step / 3 % 3 - 1, step % 3 - 1])
}

/// A voxel moved by a step, unless it leaves the box at its low end.
pub(crate) fn moved(voxel: [usize; 3], step: [isize; 3]) -> Option<[usize; 3]> {
    Some([
        voxel[0].checked_add_signed(step[0])?,
        voxel[1].checked_add_signed(step[1])?,
        voxel[2].checked_add_signed(step[2])?,
    ])
}

/// Whether a voxel is in the box and inside the mask.
pub(crate) fn is_inside(mask: &ArrayView3<'_, bool>, voxel: [usize; 3]) -> bool {
    mask.get(voxel).copied().unwrap_or(false)
}
