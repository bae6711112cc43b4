//! Opening of a finished solid.

use std::path::Path;

use stereology::files::solid::{self, SavedSolid};

use crate::failure::{Explain, Failure};

/// Opens an output folder of `stereology synthesize` or `assemble`, or a `packing.json`.
pub fn open_solid(path: &Path) -> Result<SavedSolid, Failure> {
    if path.is_file() {
        return solid::read_packing(path).at(path);
    }
    if let Some(missing) = ["solid.json", "packing.json"]
        .iter()
        .find(|part| !path.join(part).is_file())
    {
        return Err(Failure::run(format!(
            "{} contains no {missing}; give a folder written by `stereology synthesize` or `assemble`, or a packing.json",
            path.display()
        )));
    }
    solid::read(path).at(path)
}
