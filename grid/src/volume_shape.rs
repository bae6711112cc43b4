//! How many voxels and channels a volume has.

use crate::element::Element;
use crate::error::GridError;

/// Voxels along each axis and channels per voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VolumeShape {
    /// Voxels along z, the slowest axis in the file: number of slabs or pages.
    pub nz: usize,
    /// Voxels along y.
    pub ny: usize,
    /// Voxels along x.
    pub nx: usize,
    /// Samples per voxel: 3 for a colour, 1 for an id.
    pub channels: usize,
}

impl VolumeShape {
    /// Array sizes, slowest axis first; no channel axis if there is one channel.
    pub(crate) fn sizes(&self) -> Vec<usize> {
        match self.channels {
            1 => vec![self.nz, self.ny, self.nx],
            n => vec![self.nz, self.ny, self.nx, n],
        }
    }

    /// Bytes of the whole volume and of one slab.
    pub(crate) fn bytes<T: Element>(&self) -> Result<[u64; 2], GridError> {
        let Self { nz, ny, nx, channels } = *self;
        if [nz, ny, nx, channels].contains(&0) {
            return Err(GridError::Empty { nx, ny, nz, channels });
        }
        let slab = [ny, nx, channels]
            .iter()
            .try_fold(size_of::<T>() as u64, |bytes, &n| bytes.checked_mul(n as u64));
        slab.and_then(|slab| Some([slab.checked_mul(nz as u64)?, slab]))
            .ok_or(GridError::Uncountable { nx, ny, nz, channels })
    }
}
