//! A file that appears whole or not at all: written as `FILE.partial`, renamed to `FILE`.

use crate::GridError;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes a file so that it appears under its name only when it is whole.
///
/// `write` fills `FILE.partial` beside it, which is then renamed, replacing any file of that name. If `write` or the system fails, `FILE.partial` is removed and an older `FILE` stays as it was. A killed process may leave
/// `FILE.partial`; the next call overwrites it. The bytes are handed to the operating system, not forced to the platter.
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
/// assert_eq!(std::fs::read(&file)?, b"42"); // as it was
/// assert_eq!(std::fs::read_dir(folder.path())?.count(), 1); // and nothing beside it
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

/// `FILE.partial` while it is being written; removed when dropped before it was published.
#[derive(Debug)]
pub(crate) struct PartialFile {
    path: PathBuf,
    partial: PathBuf,
    writer: Option<BufWriter<File>>,
}

impl PartialFile {
    pub(crate) fn create(path: &Path) -> Result<Self, GridError> {
        if path.is_dir() {
            // Said now, not after an hour when the rename fails.
            return Err(GridError::io(path)(io::Error::new(
                io::ErrorKind::IsADirectory,
                "is a folder; give the name of a file",
            )));
        }
        let mut name = path.as_os_str().to_owned();
        name.push(".partial");
        let partial = PathBuf::from(name);
        let file = File::create(&partial).map_err(GridError::io(path))?;
        Ok(Self {
            path: path.to_owned(),
            partial,
            writer: Some(BufWriter::with_capacity(1 << 20, file)),
        })
    }

    pub(crate) fn writer(&mut self) -> &mut BufWriter<File> {
        self.writer
            .as_mut()
            .expect("the writer is taken only by publish and drop")
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

impl Drop for PartialFile {
    fn drop(&mut self) {
        if let Some(writer) = self.writer.take() {
            // Close without flushing what is to be thrown away; there is nobody to tell if the removal fails.
            drop(writer.into_parts());
            let _ = fs::remove_file(&self.partial);
        }
    }
}
