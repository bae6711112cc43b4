//! Where blocks come from: images, or cubes of a volume.

use ndarray::{ArrayView3, ArrayView4, Axis};

use super::features::part;
use crate::slices::Family;

/// What blocks are cut from; values 0 to 1.
#[derive(Clone, Copy, Debug)]
pub enum BlockSource<'a> {
    /// Independent images (row, column, channel): every part of an image is a block.
    Images(&'a [ArrayView3<'a, f32>]),
    /// A volume (z, y, x, channel). Neighbouring slices are almost equal and slices of different families intersect, so
    /// the volume is divided into cubes, and each cube gives one block: a section through its middle, of the families
    /// in turn.
    Volume {
        /// The voxels.
        voxels: ArrayView4<'a, f32>,
        /// Families of slices; none gives no blocks.
        families: &'a [Family],
        /// Voxels that count; all if `None`.
        mask: Option<ArrayView3<'a, bool>>,
    },
}

/// A block: an image, its corner, its side.
pub(super) struct Place<'a> {
    pub(super) image: ArrayView3<'a, f32>,
    pub(super) corner: [usize; 2],
}

impl<'a> BlockSource<'a> {
    /// Number of blocks of `side` pixels, without regard to a mask.
    pub(super) fn count(&self, side: usize) -> usize {
        match self {
            Self::Images(images) => images.iter().map(|i| (i.dim().0 / side) * (i.dim().1 / side)).sum(),
            Self::Volume { families: [], .. } => 0,
            Self::Volume { voxels, .. } => {
                let (nz, ny, nx, _) = voxels.dim();
                (nz / side) * (ny / side) * (nx / side)
            }
        }
    }

    /// The blocks of `side` pixels, in order of their place.
    pub(super) fn places(&self, side: usize) -> Vec<Place<'a>> {
        match *self {
            Self::Images(images) => {
                let of = |image: &ArrayView3<'a, f32>| {
                    let (height, width, _) = image.dim();
                    let columns = starts(width, side);
                    let corners = starts(height, side).into_iter();
                    let corners: Vec<_> = corners.flat_map(|y| columns.iter().map(move |&x| [y, x])).collect();
                    let image = *image;
                    corners.into_iter().map(move |corner| Place { image, corner })
                };
                images.iter().flat_map(of).collect()
            }
            Self::Volume { voxels, families, mask } => {
                let (nz, ny, nx, _) = voxels.dim();
                let mut places = Vec::new();
                for (k, z) in starts(nz, side).into_iter().enumerate() {
                    for (j, y) in starts(ny, side).into_iter().enumerate() {
                        for (i, x) in starts(nx, side).into_iter().enumerate() {
                            let Some(&family) = families.get((i + j + k) % families.len().max(1)) else {
                                continue;
                            };
                            let corner = [z, y, x];
                            places.extend(section(voxels, mask, family, corner, side));
                        }
                    }
                }
                places
            }
        }
    }
}

/// The block through the middle of a cube, unless the mask leaves out a part of it.
fn section<'a>(
    voxels: ArrayView4<'a, f32>,
    mask: Option<ArrayView3<'a, bool>>,
    family: Family,
    corner: [usize; 3],
    side: usize,
) -> Option<Place<'a>> {
    let normal = family.normal().index();
    let middle = corner[normal] + side / 2;
    let mut corner = corner.to_vec();
    corner.remove(normal);
    let range = |at: usize| at..at + side;
    let inside = mask.is_none_or(|mask| {
        let plane = mask.index_axis_move(Axis(normal), middle);
        part(plane, range(corner[0]), range(corner[1]))
            .iter()
            .all(|inside| *inside)
    });
    inside.then(|| Place {
        image: voxels.index_axis_move(Axis(normal), middle),
        corner: [corner[0], corner[1]],
    })
}

/// Starts of the parts of `side` pixels that fit, spread evenly.
fn starts(n: usize, side: usize) -> Vec<usize> {
    match n / side {
        0 => Vec::new(),
        1 => vec![(n - side) / 2],
        parts => (0..parts).map(|i| i * (n - side) / (parts - 1)).collect(),
    }
}
