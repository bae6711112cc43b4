//! The z slabs of a volume, computed one after the other while the one before is written.

use crate::element::Element;
use crate::error::GridError;
use crate::volume_shape::VolumeShape;
use ndarray::ArrayViewMut3;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::mpsc;
use std::thread;

/// The callback that computes slabs, and two buffers for them.
pub(crate) struct Slabs<T, F> {
    shape: VolumeShape,
    slab: Vec<T>,
    /// Filled while the other is written.
    next: Vec<T>,
    fill: F,
}

impl<T: Element, F: FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>> Slabs<T, F> {
    /// Two slabs of `bytes` bytes each.
    pub(crate) fn new(shape: VolumeShape, bytes: u64, fill: F) -> Result<Self, GridError> {
        let samples = usize::try_from(bytes).map_err(|_| GridError::SlabTooLarge { bytes })? / size_of::<T>();
        let slab = || {
            let mut slab = Vec::new();
            slab.try_reserve_exact(samples)
                .map_err(|_| GridError::SlabTooLarge { bytes })?;
            slab.resize(samples, T::default());
            Ok(slab)
        };
        let (slab, next) = (slab()?, slab()?);
        Ok(Self {
            shape,
            slab,
            next,
            fill,
        })
    }

    /// Number of slabs.
    pub(crate) fn count(&self) -> usize {
        self.shape.nz
    }

    /// The samples of the slab at z.
    pub(crate) fn at(&mut self, z: usize) -> Result<&[T], GridError> {
        let VolumeShape { ny, nx, channels, .. } = self.shape;
        let view =
            ArrayViewMut3::from_shape((ny, nx, channels), &mut self.slab).expect("the slab was made for this shape");
        match (self.fill)(z, view) {
            ControlFlow::Break(()) => Err(GridError::Cancelled),
            ControlFlow::Continue(()) => Ok(&self.slab),
        }
    }

    /// Passes the slabs from z = `first` on to `take`, which works on each while the next one is computed. When this
    /// returns, `take` has had every slab that was computed.
    pub(crate) fn each(
        mut self,
        path: &Path,
        first: usize,
        mut take: impl FnMut(&[T]) -> Result<(), GridError> + Send,
    ) -> Result<(), GridError> {
        let (full, filled) = mpsc::channel::<Vec<T>>();
        let (empty, emptied) = mpsc::channel();
        let mut next = Some(std::mem::take(&mut self.next));
        let taking = move || {
            for slab in filled {
                take(&slab)?;
                // The last buffers are not needed any more, so nobody receives them.
                let _ = empty.send(slab);
            }
            Ok(())
        };
        thread::scope(|scope| {
            let taker = thread::Builder::new()
                .spawn_scoped(scope, taking)
                .map_err(GridError::io(path))?;
            let mut computed = Ok(());
            for z in first..self.shape.nz {
                if let Err(stopped) = self.at(z) {
                    computed = Err(stopped);
                    break;
                }
                // The channel is closed only if `take` failed; its error is returned below.
                let Some(empty) = next.take().or_else(|| emptied.recv().ok()) else {
                    break;
                };
                if full.send(std::mem::replace(&mut self.slab, empty)).is_err() {
                    break;
                }
            }
            drop(full);
            let taken = taker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            taken.and(computed)
        })
    }
}
