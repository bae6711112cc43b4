//! Whether the file system has room for a volume, checked before it is written.

use crate::error::GridError;
use std::fs;
use std::path::Path;

/// Bytes of a file, or of all files in a folder; 0 if there is neither.
pub(crate) fn bytes_in(path: &Path) -> u64 {
    match fs::read_dir(path) {
        Ok(entries) => entries.flatten().map(|entry| bytes_in(&entry.path())).sum(),
        Err(_) => fs::metadata(path).map_or(0, |file| file.len()),
    }
}

/// Refuses a file that its file system cannot hold.
pub(crate) fn refuse_without_room(path: &Path, needed: u64) -> Result<(), GridError> {
    // Where the system does not report the free space, the limit is the largest file, 2^63 bytes.
    let free = free_bytes(path).unwrap_or(i64::MAX.unsigned_abs());
    if needed > free {
        Err(GridError::NoRoom {
            path: path.to_owned(),
            needed,
            free,
        })
    } else {
        Ok(())
    }
}

#[cfg(unix)]
fn free_bytes(path: &Path) -> Option<u64> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let system = rustix::fs::statvfs(folder).ok().filter(|system| system.f_blocks > 0)?;
    Some(system.f_bavail.saturating_mul(system.f_frsize))
}

#[cfg(not(unix))]
fn free_bytes(_: &Path) -> Option<u64> {
    None
}
