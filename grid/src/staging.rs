//! An output under a temporary name beside its final one.

use crate::names::{destination, exchange, folder_of, give_name, plain, temporary};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A file or a folder that is being written, and gets its name when it is complete.
///
/// It is written inside a new folder `NAME.partial-PROCESS-RANDOM` beside `NAME`, so it is on the same file system, and
/// no file of anyone else is in the way or touched. The folder is removed when this is dropped; only a killed process
/// leaves it.
///
/// # Examples
///
/// ```
/// use stereology_grid::Staging;
///
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("answer.txt");
/// let mut staged = Staging::beside(&file)?;
/// std::fs::write(staged.path(), "42")?;
/// assert!(!file.exists());
/// staged.publish(false)?;
/// drop(staged);
/// assert_eq!(std::fs::read_to_string(&file)?, "42");
/// assert_eq!(std::fs::read_dir(folder.path())?.count(), 1);
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct Staging {
    folder: TempDir,
    content: PathBuf,
    target: PathBuf,
    state: State,
}

/// What has become of a staged output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Staged,
    /// Published under a name that was free.
    Named,
    /// Published in exchange for an older output, which is staged now.
    Exchanged,
}

impl Staging {
    /// Begins an output that will be called `target`. If `target` is a symbolic link, it leads to the output.
    ///
    /// # Errors
    ///
    /// If nothing can be written beside `target`.
    pub fn beside(target: &Path) -> io::Result<Self> {
        let target = destination(target)?;
        let folder = tempfile::Builder::new()
            .prefix(&temporary(&target))
            .tempdir_in(folder_of(&target))
            .map_err(plain)?;
        // The extension stays, as it often decides on the format.
        let mut content = folder.path().join("content");
        if let Some(extension) = target.extension() {
            content.set_extension(extension);
        }
        Ok(Self {
            folder,
            content,
            target,
            state: State::Staged,
        })
    }

    /// Path to write to, with the extension of the final name. It does not exist yet.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.content
    }

    /// The final name, with links followed.
    #[must_use]
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// The temporary folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Gives the output its name. With `replace` it takes the place of an older output, which is removed when this is
    /// dropped.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::AlreadyExists`] if the name is taken and `replace` is false; others of the system.
    pub fn publish(&mut self, replace: bool) -> io::Result<()> {
        for _ in 0..MOST_ATTEMPTS {
            match give_name(&self.content, &self.target) {
                Ok(()) => {
                    self.state = State::Named;
                    return Ok(());
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists && replace => {}
                Err(error) => return Err(error),
            }
            match exchange(&self.content, &self.target) {
                Ok(()) => {
                    self.state = State::Exchanged;
                    return Ok(());
                }
                // Removed since.
                Err(error) if error.kind() == io::ErrorKind::NotFound && self.content.exists() => {}
                Err(error) => return Err(error),
            }
        }
        Err(io::Error::other(
            "appears and disappears all the time; another program uses it",
        ))
    }

    /// Takes the output back: after this the name is as it was before [`publish`](Self::publish).
    ///
    /// # Errors
    ///
    /// Those of the system.
    pub fn take_back(&mut self) -> io::Result<()> {
        match self.state {
            State::Staged => {}
            State::Named => fs::rename(&self.target, &self.content)?,
            State::Exchanged => exchange(&self.content, &self.target)?,
        }
        self.state = State::Staged;
        Ok(())
    }
}

/// Attempts to publish beside another process that makes and removes the same name.
const MOST_ATTEMPTS: usize = 100;
