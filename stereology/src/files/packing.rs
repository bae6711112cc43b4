//! `packing.json`: the particles of a packing in their periodic box.

use crate::files::{FileError, json};
use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::path::Path;
use stereology_grid::LengthUnit;
use stereology_shape::{BoxError, Particle, PeriodicBox};

/// `packing.json`: particles in a periodic box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PackingFile {
    /// Sides of the box along x, y, z.
    #[serde(rename = "box")]
    pub sides: [f64; 3],
    /// Symbol of the unit of all lengths, if it is known.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "unit_symbol")]
    pub unit: Option<LengthUnit>,
    /// Specification of each shape: `sphere`, `rock:1`, a mesh file.
    pub shapes: Vec<String>,
    /// The particles.
    pub particles: Vec<PackedParticle>,
}

/// A particle of a [`PackingFile`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PackedParticle {
    /// Index of its shape.
    pub shape: usize,
    /// Size: diameter of the circle with the area of its largest section.
    pub size: f64,
    /// Colour category.
    pub category: u8,
    /// Its centre of volume.
    pub position: [f64; 3],
    /// Unit quaternion w, x, y, z.
    pub orientation: [f64; 4],
}

impl PackingFile {
    /// The file of a packing; `shapes` holds the specification of each shape.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology::files::packing::PackingFile;
    /// use stereology::shape::{Arrangement, Particle, PeriodicBox};
    ///
    /// let particle = Particle { shape: 0, size: 1.0, category: 0, position: nalgebra::Point3::origin(), orientation: nalgebra::UnitQuaternion::identity() };
    /// let file = PackingFile::new(vec!["sphere".to_owned()], &[particle], &PeriodicBox::new(nalgebra::Vector3::repeat(4.0))?);
    /// let folder = tempfile::tempdir()?;
    /// file.write(folder.path().join("packing.json"))?;
    /// let (particles, period) = PackingFile::read(folder.path().join("packing.json"))?.unpack()?;
    /// assert_eq!((particles, period.volume()), (vec![particle], 64.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn new(shapes: Vec<String>, particles: &[Particle], period: &PeriodicBox) -> Self {
        let packed = |particle: &Particle| {
            let q = particle.orientation.quaternion();
            PackedParticle {
                shape: particle.shape,
                size: particle.size,
                category: particle.category,
                position: particle.position.coords.into(),
                orientation: [q.w, q.i, q.j, q.k],
            }
        };
        Self {
            sides: period.sides().into(),
            unit: None,
            shapes,
            particles: particles.iter().map(packed).collect(),
        }
    }

    /// The same file with lengths in this unit.
    #[must_use]
    pub fn with_unit(self, unit: Option<LengthUnit>) -> Self {
        Self { unit, ..self }
    }

    /// The particles and their box.
    ///
    /// # Errors
    ///
    /// [`BoxError`] for sides that are not positive lengths.
    pub fn unpack(&self) -> Result<(Vec<Particle>, PeriodicBox), BoxError> {
        let particle = |packed: &PackedParticle| {
            let [w, i, j, k] = packed.orientation;
            Particle {
                shape: packed.shape,
                size: packed.size,
                category: packed.category,
                position: Point3::from(packed.position),
                // As written: a second normalisation could change the last bit.
                orientation: UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k)),
            }
        };
        let period = PeriodicBox::new(Vector3::from(self.sides))?;
        Ok((self.particles.iter().map(particle).collect(), period))
    }

    /// Writes `packing.json`, completely or not at all.
    ///
    /// # Errors
    ///
    /// [`FileError`] if it cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        json::write(path.as_ref(), self)
    }

    /// Reads `packing.json`.
    ///
    /// # Errors
    ///
    /// [`FileError`] if it cannot be read, is not a packing, or holds an invalid shape index or orientation.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, FileError> {
        let path = path.as_ref();
        let file: Self = json::read(path)?;
        for (index, particle) in file.particles.iter().enumerate() {
            let norm: f64 = particle.orientation.iter().map(|c| c * c).sum();
            if particle.shape >= file.shapes.len() {
                return Err(FileError::value(
                    path,
                    format!(
                        "particle {index} has shape {}, but there are {} shapes (numbered from 0)",
                        particle.shape,
                        file.shapes.len()
                    ),
                ));
            }
            if (norm - 1.0).abs() > 1e-6 {
                return Err(FileError::value(
                    path,
                    format!("particle {index}: its orientation is not a unit quaternion"),
                ));
            }
        }
        Ok(file)
    }
}

/// A unit of length as its symbol.
mod unit_symbol {
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};
    use stereology_grid::LengthUnit;

    #[allow(clippy::ref_option, reason = "the signature is serde's")]
    pub(super) fn serialize<S: Serializer>(unit: &Option<LengthUnit>, serializer: S) -> Result<S::Ok, S::Error> {
        unit.map(LengthUnit::symbol).serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<LengthUnit>, D::Error> {
        let symbol = Option::<String>::deserialize(deserializer)?;
        symbol
            .map(|symbol| symbol.parse().map_err(D::Error::custom))
            .transpose()
    }
}
