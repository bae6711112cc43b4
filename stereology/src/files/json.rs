//! JSON files.

use crate::files::FileError;
use serde::{Serialize, de::DeserializeOwned};
use std::fs::File;
use std::io::{BufReader, Write};
use std::path::Path;
use stereology_grid::write_atomically;

/// Writes a value as JSON, completely or not at all.
pub(crate) fn write(path: &Path, value: &impl Serialize) -> Result<(), FileError> {
    Ok(write_atomically(path, |out| {
        serde_json::to_writer(&mut *out, value)?;
        writeln!(out)
    })?)
}

/// Reads a value from JSON.
pub(crate) fn read<T: DeserializeOwned>(path: &Path) -> Result<T, FileError> {
    let file = File::open(path).map_err(|source| FileError::io(path, source))?;
    serde_json::from_reader(BufReader::new(file)).map_err(|source| FileError::Json {
        path: path.to_owned(),
        source,
    })
}
