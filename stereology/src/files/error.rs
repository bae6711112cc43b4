//! Why a file cannot be read or written.

use std::io;
use std::path::{Path, PathBuf};
use stereology_grid::GridError;

/// Why a file cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// An error of the operating system.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// Not the JSON that was expected.
    #[error("{path}: not a file of this kind ({source})")]
    Json {
        /// The file.
        path: PathBuf,
        /// Where and why.
        source: serde_json::Error,
    },
    /// A file of another kind or version.
    #[error(
        "{path}: its schema is {found:?}, this version reads {expected:?}; use the version that wrote it, or make the solid again with this one"
    )]
    Schema {
        /// The file.
        path: PathBuf,
        /// Schema of the file.
        found: String,
        /// Schema that can be read.
        expected: &'static str,
    },
    /// An invalid value.
    #[error("{path}: {what}")]
    Value {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// An array.
    #[error(transparent)]
    Grid(#[from] GridError),
}

impl FileError {
    pub(crate) fn io(path: &Path, source: io::Error) -> Self {
        Self::Io {
            path: path.to_owned(),
            source,
        }
    }

    pub(crate) fn value(path: &Path, what: impl ToString) -> Self {
        Self::Value {
            path: path.to_owned(),
            what: what.to_string(),
        }
    }
}
