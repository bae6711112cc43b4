//! A file of raw samples: what stands before them and what behind.
//!
//! Where the two depend on shape, type and spacing alone, a file can be written slab by slab and, broken off, gone on with: its length tells how far it came.

use crate::element::Element;
use crate::{Format, VolumeShape, dream3d, npy, nrrd, tiff_stack, vti};

/// The bytes around the samples.
#[derive(Debug)]
pub(crate) struct Frame {
    pub(crate) head: Vec<u8>,
    pub(crate) tail: Vec<u8>,
}

impl Frame {
    /// The frame of a volume of `bytes` bytes; `None` for a format that is no file of raw samples.
    pub(crate) fn of<T: Element>(format: Format, shape: &VolumeShape, spacing: [f64; 3], bytes: u64) -> Option<Self> {
        let (head, tail) = match format {
            Format::Npy => (npy::header::<T>(shape), Vec::new()),
            Format::Nrrd => (nrrd::header::<T>(shape, spacing), Vec::new()),
            Format::Vti => (vti::header::<T>(shape, spacing, bytes), vti::FOOTER.to_vec()),
            Format::Tiff => tiff_stack::frame::<T>(shape, spacing, bytes),
            Format::Hdf5 => (dream3d::head::<T>(shape, spacing, bytes), Vec::new()),
            Format::Zarr => return None,
        };
        Some(Self { head, tail })
    }

    /// Bytes of both.
    pub(crate) fn length(&self) -> u64 {
        (self.head.len() + self.tail.len()) as u64
    }
}
