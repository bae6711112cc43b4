//! Files written by the crate, read back by readers that are not ours.
#![expect(clippy::unwrap_used, reason = "a failing test panics")]

mod damaged;
mod formats;
mod hdf5;
#[cfg(feature = "read")]
mod other_programs;
mod resume;
mod units;
mod whole_or_nothing;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Every file of a folder or the one file, by name.
fn contents(path: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    match fs::read_dir(path) {
        Ok(entries) => entries.flat_map(|entry| contents(&entry.unwrap().path())).collect(),
        Err(_) => BTreeMap::from([(path.to_owned(), fs::read(path).unwrap())]),
    }
}
