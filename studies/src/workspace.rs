//! The folder of the workspace.

use std::path::Path;

use anyhow::{Context, Result};

/// Folder of the workspace.
pub fn root() -> Result<&'static Path> {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .context("this crate stands inside the workspace")
}
