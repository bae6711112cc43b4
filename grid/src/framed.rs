//! A file of raw samples between a head and a tail, written slab by slab and resumed after an interruption.

use crate::atomic::PartialFile;
use crate::element::Element;
use crate::error::GridError;
use crate::frame::Frame;
use crate::names::partial_name;
use crate::slabs::Slabs;
use ndarray::ArrayViewMut3;
use std::io::{Read, Seek, SeekFrom, Write};
use std::ops::ControlFlow;
use std::path::Path;

/// Writes head, slabs and tail; with `resume` the slabs that `FILE.partial` already holds are kept.
pub(crate) fn write<T: Element, F: FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>>(
    path: &Path,
    frame: &Frame,
    slab_bytes: u64,
    resume: bool,
    mut slabs: Slabs<T, F>,
) -> Result<(), GridError> {
    let (mut file, done) = if resume {
        let mut file = PartialFile::reopen(path)?;
        let done = whole_slabs(path, &mut file, frame, slab_bytes, &mut slabs)?;
        (file, done)
    } else {
        (PartialFile::create(path)?, 0)
    };
    let failed = || GridError::io(path);
    if done == 0 {
        file.cut_to(0)?;
        file.writer().write_all(&frame.head).map_err(failed())?;
    } else {
        file.cut_to(frame.head.len() as u64 + done as u64 * slab_bytes)?;
    }
    slabs.each(path, done, |slab| T::write(slab, file.writer()).map_err(failed()))?;
    file.writer().write_all(&frame.tail).map_err(failed())?;
    file.publish()
}

/// Number of complete slabs in `FILE.partial`. What it holds must equal ours: its head, its first slab as far as it
/// goes, and its last complete slab.
fn whole_slabs<T: Element, F: FnMut(usize, ArrayViewMut3<'_, T>) -> ControlFlow<()>>(
    path: &Path,
    file: &mut PartialFile,
    frame: &Frame,
    slab_bytes: u64,
    slabs: &mut Slabs<T, F>,
) -> Result<usize, GridError> {
    let head = frame.head.len() as u64;
    let length = file.writer().get_ref().metadata().map_err(GridError::io(path))?.len();
    let whole = usize::try_from(length.saturating_sub(head) / slab_bytes).unwrap_or(usize::MAX);
    let done = whole.min(slabs.count());
    let mut is_there = |at: u64, ours: &[u8]| {
        let stored = usize::try_from(length.saturating_sub(at)).unwrap_or(usize::MAX);
        let ours = &ours[..ours.len().min(stored)];
        let mut theirs = vec![0; ours.len()];
        let from = file.writer().get_mut();
        from.seek(SeekFrom::Start(at))
            .and_then(|_| from.read_exact(&mut theirs))
            .map_err(GridError::io(path))?;
        if theirs == ours {
            return Ok(());
        }
        let partial = partial_name(path);
        Err(GridError::OtherPartial { partial })
    };
    is_there(0, &frame.head)?;
    if length > head {
        for z in [0, done.saturating_sub(1)] {
            let mut ours = Vec::new();
            T::write(slabs.at(z)?, &mut ours).map_err(GridError::io(path))?;
            is_there(head + z as u64 * slab_bytes, &ours)?;
        }
    }
    Ok(done)
}
