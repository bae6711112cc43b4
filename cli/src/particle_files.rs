//! `--also`: particles in formats of other programs.

use std::path::Path;

use stereology::files::{particle_table, vtp, xyz};
use stereology::grid::LengthUnit;
use stereology::shape::Arrangement;

use crate::failure::{Explain, Failure};

/// A format of particles, chosen by the extension of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParticleFormat {
    /// A table.
    Csv,
    /// Extended XYZ (OVITO).
    Xyz,
    /// VTK poly data (ParaView).
    Vtp,
}

impl ParticleFormat {
    /// The format of the extension.
    pub fn of(path: &Path) -> Result<Self, Failure> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("csv") => Ok(Self::Csv),
            Some("xyz") => Ok(Self::Xyz),
            Some("vtp") => Ok(Self::Vtp),
            _ => Err(Failure::usage(format!(
                "--also {}: the file's ending must be .csv, .xyz or .vtp",
                path.display()
            ))),
        }
    }

    /// Writes the particles, completely or not at all.
    pub fn write(self, path: &Path, arrangement: &Arrangement, unit: Option<LengthUnit>) -> Result<(), Failure> {
        match self {
            Self::Csv => particle_table::write(path, arrangement.particles(), unit),
            Self::Xyz => xyz::write(path, arrangement),
            Self::Vtp => vtp::write(path, arrangement.particles()),
        }
        .at(path)
    }
}
