//! A file that appears complete or not at all: written as `FILE.partial`, renamed to `FILE`.

use crate::error::GridError;
use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Bytes of the write buffer. Most slabs are larger and bypass it.
const BUFFER: usize = 1 << 16;

/// Writes a file that appears under its name only when it is complete.
///
/// `write` fills `FILE.partial` in the same folder, which is then renamed and replaces any file of that name. If
/// `write` or the system fails, `FILE.partial` is removed and an older `FILE` stays unchanged. A killed process may
/// leave `FILE.partial`; the next call overwrites it. The bytes are passed to the operating system; no sync to disk is
/// forced.
///
/// # Errors
///
/// [`GridError::Io`] with the path, if the file cannot be created, written or renamed, or with what `write` returned.
///
/// # Examples
///
/// ```
/// # use std::io::Write;
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("answer.txt");
/// stereology_grid::write_atomically(&file, |out| out.write_all(b"42"))?;
/// let refused = stereology_grid::write_atomically(&file, |_| Err(std::io::Error::other("no answer")));
/// assert!(refused.is_err());
/// assert_eq!(std::fs::read(&file)?, b"42"); // unchanged
/// assert_eq!(std::fs::read_dir(folder.path())?.count(), 1); // no partial file is left
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_atomically(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), GridError> {
    let path = path.as_ref();
    let mut partial = PartialFile::create(path)?;
    write(partial.writer()).map_err(GridError::io(path))?;
    partial.publish()
}

/// `FILE.partial` while it is being written; removed if dropped before it is published, unless it is to be kept.
#[derive(Debug)]
pub(crate) struct PartialFile {
    path: PathBuf,
    partial: PathBuf,
    writer: Option<BufWriter<File>>,
    keep: bool,
}

/// `FILE.partial`.
pub(crate) fn partial_name(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".partial");
    PathBuf::from(name)
}

impl PartialFile {
    pub(crate) fn create(path: &Path) -> Result<Self, GridError> {
        refuse_folder(path)?;
        let partial = partial_name(path);
        let file = File::create(&partial).map_err(GridError::io(path))?;
        Ok(Self::new(path, partial, file, false))
    }

    /// The existing partial file, or a new one; kept when dropped.
    pub(crate) fn reopen(path: &Path) -> Result<Self, GridError> {
        refuse_folder(path)?;
        let partial = partial_name(path);
        let file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&partial)
            .map_err(GridError::io(path))?;
        Ok(Self::new(path, partial, file, true))
    }

    fn new(path: &Path, partial: PathBuf, file: File, keep: bool) -> Self {
        Self {
            path: path.to_owned(),
            partial,
            writer: Some(BufWriter::with_capacity(BUFFER, file)),
            keep,
        }
    }

    pub(crate) fn writer(&mut self) -> &mut BufWriter<File> {
        self.writer
            .as_mut()
            .expect("the writer is taken only by publish and drop")
    }

    /// Truncates the file to `length` bytes and continues there.
    pub(crate) fn cut_to(&mut self, length: u64) -> Result<(), GridError> {
        let path = self.path.clone();
        let file = self.writer().get_mut();
        file.set_len(length)
            .and_then(|()| file.seek(SeekFrom::Start(length)))
            .map(drop)
            .map_err(GridError::io(&path))
    }

    pub(crate) fn publish(mut self) -> Result<(), GridError> {
        self.writer()
            .flush()
            .and_then(|()| fs::rename(&self.partial, &self.path))
            .map_err(GridError::io(&self.path))?;
        self.writer = None;
        Ok(())
    }
}

fn refuse_folder(path: &Path) -> Result<(), GridError> {
    if path.is_dir() {
        // Refused now: otherwise the rename fails after an hour of work.
        return Err(GridError::io(path)(io::Error::new(
            io::ErrorKind::IsADirectory,
            "is a folder; give the name of a file",
        )));
    }
    Ok(())
}

impl Drop for PartialFile {
    fn drop(&mut self) {
        // A failed flush or removal cannot be reported from here.
        match self.writer.take() {
            Some(mut writer) if self.keep => {
                let _ = writer.flush();
            }
            Some(writer) => {
                // Closed without flushing, as the file is removed.
                drop(writer.into_parts());
                let _ = fs::remove_file(&self.partial);
            }
            None => {}
        }
    }
}
