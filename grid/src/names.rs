//! Names of outputs: where a name leads, temporary names beside it, and how content gets a name.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// File names may have this many bytes.
const LONGEST_NAME: usize = 255;
/// Bytes of the final name in a temporary one: leaves room for `.partial`, a process id and a random part.
const SHOWN: usize = 200;
/// Symbolic links that are followed.
const MOST_LINKS: usize = 40;

/// The path that a symbolic link leads to, whether or not it exists; other paths as they are.
///
/// Content renamed to the result replaces the target of a link, and the link stays.
///
/// # Errors
///
/// If links lead to each other.
pub fn destination(path: &Path) -> io::Result<PathBuf> {
    let mut at = path.to_owned();
    for _ in 0..MOST_LINKS {
        let Ok(next) = fs::read_link(&at) else {
            return Ok(at);
        };
        at = at.parent().unwrap_or(Path::new("")).join(next);
    }
    Err(io::Error::other("too many symbolic links lead on from it"))
}

/// The folder that contains `path`.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Beginning of temporary names beside `path`: `NAME.partial-PROCESS-`, to which a random part is added.
pub(crate) fn temporary(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    format!("{}.partial-{}-", cut(&name, SHOWN), std::process::id())
}

/// Whether a file is one of [`temporary`] beside a file called `name`.
pub(crate) fn is_temporary(file: &str, name: &str) -> bool {
    file.strip_prefix(name)
        .is_some_and(|rest| rest.starts_with(".partial-"))
}

/// `FILE.partial`, from which an interrupted write is resumed. Of a very long name only the beginning is kept, with a
/// checksum of the whole.
pub(crate) fn partial_name(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    if name.len() + ".partial".len() > LONGEST_NAME {
        let sum = name
            .as_encoded_bytes()
            .iter()
            .fold(0xcbf2_9ce4_8422_2325, |sum: u64, byte| {
                (sum ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
            });
        name = format!("{}-{sum:016x}", cut(&name.to_string_lossy(), SHOWN)).into();
    }
    name.push(".partial");
    path.with_file_name(name)
}

/// The first characters of `name`, at most `bytes` bytes.
fn cut(name: &str, bytes: usize) -> &str {
    let end = (0..=bytes.min(name.len()))
        .rev()
        .find(|&end| name.is_char_boundary(end));
    &name[..end.unwrap_or(0)]
}

/// Gives `staged` the name `target` on the same file system, unless a file or folder has that name.
///
/// Of several processes that call this at the same time for one `target`, one succeeds.
///
/// # Errors
///
/// [`io::ErrorKind::AlreadyExists`] if the name is taken; others of the system.
pub fn give_name(staged: &Path, target: &Path) -> io::Result<()> {
    match rename_to_free(staged, target) {
        Some(result) => result,
        // A file system without exclusive renaming: a new hard link is exclusive too, and so is a folder, which does
        // not replace one that contains files.
        None if staged.is_dir() => match fs::symlink_metadata(target) {
            Ok(_) => Err(io::ErrorKind::AlreadyExists.into()),
            Err(_) => fs::rename(staged, target),
        },
        None => fs::hard_link(staged, target).and_then(|()| fs::remove_file(staged)),
    }
}

/// Exchanges the contents of two names on one file system, so that neither is ever without content.
///
/// Where the file system cannot do that, `a` and `b` are renamed one after the other.
///
/// # Errors
///
/// Those of the system.
pub fn exchange(a: &Path, b: &Path) -> io::Result<()> {
    if let Some(result) = exchange_names(a, b) {
        return result;
    }
    let aside = tempfile::Builder::new()
        .prefix(&temporary(a))
        .tempdir_in(folder_of(a))?;
    let old = aside.path().join("old");
    fs::rename(b, &old)?;
    if let Err(error) = fs::rename(a, b) {
        fs::rename(&old, b)?;
        return Err(error);
    }
    fs::rename(&old, a)
}

/// An error of `tempfile` without the temporary name, which the caller does not know.
pub(crate) fn plain(error: io::Error) -> io::Error {
    let message = error.to_string();
    match message.split_once(" at path ") {
        Some((cause, _)) => io::Error::new(error.kind(), cause),
        None => error,
    }
}

#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
fn exchange_names(a: &Path, b: &Path) -> Option<io::Result<()>> {
    renamed_with(a, b, rustix::fs::RenameFlags::EXCHANGE)
}

#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
fn rename_to_free(staged: &Path, target: &Path) -> Option<io::Result<()>> {
    renamed_with(staged, target, rustix::fs::RenameFlags::NOREPLACE)
}

/// `None` if the file system does not know the flag.
#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
fn renamed_with(from: &Path, to: &Path, flag: rustix::fs::RenameFlags) -> Option<io::Result<()>> {
    use rustix::fs::{CWD, renameat_with};
    use rustix::io::Errno;
    match renameat_with(CWD, from, CWD, to, flag) {
        Err(Errno::INVAL | Errno::NOSYS | Errno::OPNOTSUPP) => None,
        other => Some(other.map_err(io::Error::from)),
    }
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
fn exchange_names(_: &Path, _: &Path) -> Option<io::Result<()>> {
    None
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
fn rename_to_free(_: &Path, _: &Path) -> Option<io::Result<()>> {
    None
}
