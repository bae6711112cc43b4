//! Opening of a finished solid.

use std::path::Path;

use stereology::files::solid::{self, SavedSolid};

use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};

/// Opens an output folder of `stereology synthesize` or `assemble`, or a `packing.json`.
pub fn open_solid(path: &Path, everywhere: &Everywhere) -> Result<SavedSolid, Failure> {
    if path.is_file() {
        let opened = solid::read_packing(path).at(path)?;
        for shape in &opened.shapes {
            everywhere.outputs.refuse_input(Path::new(&shape.name))?;
        }
        return Ok(opened);
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
