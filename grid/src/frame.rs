//! A file of raw samples: the bytes before and after them.
//!
//! Both depend only on shape, type and spacing. So a file can be written slab by slab, and an interrupted write can be
//! resumed: the length of the file gives the number of complete slabs.

use crate::element::Element;
use crate::format::Format;
use crate::volume_shape::VolumeShape;
use crate::voxel_size::VoxelSize;
use crate::{dream3d, npy, nrrd, tiff_stack, vti};

/// The bytes around the samples.
#[derive(Debug)]
pub(crate) struct Frame {
    pub(crate) head: Vec<u8>,
    pub(crate) tail: Vec<u8>,
}

impl Frame {
    /// The frame of a volume of `bytes` bytes; `None` for a format that is not one file of raw samples.
    pub(crate) fn of<T: Element>(format: Format, shape: &VolumeShape, size: &VoxelSize, bytes: u64) -> Option<Self> {
        let (head, tail) = match format {
            Format::Npy => (npy::header::<T>(shape), Vec::new()),
            Format::Nrrd => (nrrd::header::<T>(shape, size), Vec::new()),
            Format::Vti => (vti::header::<T>(shape, size, bytes), vti::FOOTER.to_vec()),
            Format::Tiff => tiff_stack::frame::<T>(shape, size, bytes),
            Format::Hdf5 => (dream3d::head::<T>(shape, size.sides, bytes), Vec::new()),
            Format::Zarr => return None,
        };
        Some(Self { head, tail })
    }

    /// Bytes of head and tail.
    pub(crate) fn length(&self) -> u64 {
        (self.head.len() + self.tail.len()) as u64
    }
}
