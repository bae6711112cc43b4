//! What a folder contains.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Result;

/// All files below a folder.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Snapshot {
    files: BTreeMap<PathBuf, Vec<u8>>,
    /// Temporary files and folders, which only a killed process may leave.
    pub left: Vec<PathBuf>,
}

impl Snapshot {
    /// The files of a folder.
    pub fn of(folder: &Path) -> Result<Self> {
        let mut found = Self::default();
        found.collect(folder, Path::new(""))?;
        Ok(found)
    }

    /// Whether the outputs are the same; temporary files do not count.
    pub fn same(&self, other: &Self) -> bool {
        self.files == other.files
    }

    /// The names, for a report.
    pub fn names(&self) -> Vec<&Path> {
        self.files.keys().map(PathBuf::as_path).collect()
    }

    fn collect(&mut self, folder: &Path, below: &Path) -> Result<()> {
        for entry in fs::read_dir(folder.join(below))? {
            let entry = entry?;
            let inside = below.join(entry.file_name());
            if below == Path::new("") && entry.file_name().to_string_lossy().contains(".partial") {
                self.left.push(inside);
            } else if entry.file_type()?.is_dir() {
                self.collect(folder, &inside)?;
            } else {
                self.files.insert(inside.clone(), fs::read(folder.join(&inside))?);
            }
        }
        Ok(())
    }
}
