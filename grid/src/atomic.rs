//! A file that appears complete or not at all.

use crate::error::GridError;
use crate::names::{destination, folder_of, give_name, partial_name, plain, temporary};
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use tempfile::TempPath;

/// Bytes of the write buffer. Most slabs are larger and bypass it.
const BUFFER: usize = 1 << 16;

/// Writes a file that appears under its name only when it is complete.
///
/// `write` fills a temporary file in the same folder, which is then renamed and replaces any file of that name. If
/// `path` is a symbolic link, the file that it leads to is replaced. The temporary name `NAME.partial-PROCESS-RANDOM`
/// is new, so neither another process nor a file of another program is in the way. If `write` or the system fails, the
/// temporary file is removed and an older file stays unchanged; a killed process may leave it. The bytes are passed to
/// the operating system; no sync to disk is forced.
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

/// A file that is being written under a temporary name, or under the name of a resumable one.
#[derive(Debug)]
pub(crate) struct PartialFile {
    path: PathBuf,
    writer: BufWriter<File>,
    name: PartialName,
}

#[derive(Debug)]
enum PartialName {
    /// Removed when dropped.
    Temporary(TempPath),
    /// `FILE.partial`, locked; stays when dropped.
    Resumable { partial: PathBuf, replaces: bool },
}

impl PartialFile {
    pub(crate) fn create(path: &Path) -> Result<Self, GridError> {
        refuse_folder(path)?;
        let target = destination(path).map_err(GridError::io(path))?;
        let prefix = temporary(&target);
        let mut builder = tempfile::Builder::new();
        builder.prefix(&prefix);
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666)); // as of any new file, less the umask
        let (file, name) = builder
            .tempfile_in(folder_of(&target))
            .map_err(|error| GridError::io(path)(plain(error)))?
            .into_parts();
        Ok(Self {
            path: target,
            writer: BufWriter::with_capacity(BUFFER, file),
            name: PartialName::Temporary(name),
        })
    }

    /// The existing partial file, or a new one; kept when dropped. No other process can open it until then.
    pub(crate) fn reopen(path: &Path) -> Result<Self, GridError> {
        refuse_folder(path)?;
        let target = destination(path).map_err(GridError::io(path))?;
        let partial = partial_name(&target);
        let file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&partial)
            .map_err(GridError::io(path))?;
        lock(&file, &partial)?;
        let replaces = target.exists();
        Ok(Self {
            path: target,
            writer: BufWriter::with_capacity(BUFFER, file),
            name: PartialName::Resumable { partial, replaces },
        })
    }

    pub(crate) fn writer(&mut self) -> &mut BufWriter<File> {
        &mut self.writer
    }

    /// Truncates the file to `length` bytes and continues there.
    pub(crate) fn cut_to(&mut self, length: u64) -> Result<(), GridError> {
        let file = self.writer.get_mut();
        file.set_len(length)
            .and_then(|()| file.seek(SeekFrom::Start(length)))
            .map(drop)
            .map_err(GridError::io(&self.path))
    }

    pub(crate) fn publish(mut self) -> Result<(), GridError> {
        self.writer.flush().map_err(GridError::io(&self.path))?;
        match self.name {
            PartialName::Temporary(name) => name.persist(&self.path).map_err(|error| error.error),
            PartialName::Resumable { partial, replaces } => named(&partial, &self.path, replaces),
        }
        .map_err(GridError::io(&self.path))
    }
}

/// Gives a resumed output its name. One that has appeared since the beginning is not replaced.
pub(crate) fn named(partial: &Path, path: &Path, replaces: bool) -> io::Result<()> {
    if replaces {
        fs::rename(partial, path)
    } else {
        give_name(partial, path)
    }
}

/// Locks a partial file or folder, so that no other process writes to it at the same time.
///
/// # Errors
///
/// [`GridError::InUse`] if another process has it, or has just published it.
pub(crate) fn lock(open: &File, partial: &Path) -> Result<(), GridError> {
    let in_use = || GridError::InUse {
        partial: partial.to_owned(),
    };
    match open.try_lock() {
        Err(TryLockError::WouldBlock) => return Err(in_use()),
        // A file system without locks.
        Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {}
        Err(TryLockError::Error(error)) => return Err(GridError::io(partial)(error)),
        Ok(()) => {}
    }
    if is_same(open, partial).map_err(GridError::io(partial))? {
        Ok(())
    } else {
        Err(in_use())
    }
}

/// Whether the open file still has its name: a process that held the lock before may have published it.
#[cfg(unix)]
fn is_same(open: &File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let ours = open.metadata()?;
    Ok(fs::symlink_metadata(path).is_ok_and(|there| (there.dev(), there.ino()) == (ours.dev(), ours.ino())))
}

#[cfg(not(unix))]
fn is_same(_: &File, path: &Path) -> io::Result<bool> {
    path.try_exists()
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
