//! A solid in a folder: `packing.json`, `solid.json` with the colours, `texture.npy` with the residual.

use crate::files::packing::PackingFile;
use crate::files::{FileError, json, residual as residual_file};
use crate::pipeline::ParticleTypes;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};
use std::path::Path;
use stereology_shape::{Arrangement, Body, BodyError, ClosedMesh, TriangleMesh, UnitBody};
use stereology_volume::{Residual, Solid, SolidError};

/// `solid.json`: the colours of a packing. The particles are in `packing.json`, the residual is in `texture.npy` beside
/// it.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct SolidFile {
    schema: String,
    binder: [f32; 3],
    /// Edge of a voxel of texture.npy.
    voxel: f64,
    /// Triangles of the shapes that came from mesh files, so that the folder is self-contained.
    meshes: Vec<Option<MeshEntry>>,
    /// Mean colour of each particle.
    colours: Vec<[f32; 3]>,
    /// Shapes that are voids.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    voids: Vec<usize>,
}

/// The kind and the version of a file.
#[derive(Deserialize)]
struct Schema {
    schema: String,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct MeshEntry {
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

const SOLID_SCHEMA: &str = "stereology.solid/1";

/// Writes a solid as `packing.json`, `solid.json` and `texture.npy` into `folder`.
///
/// # Errors
///
/// [`FileError`] if a file cannot be written.
///
/// # Examples
///
/// ```
/// use stereology::files::solid;
/// use nalgebra::{Point3, UnitQuaternion, Vector3};
/// use stereology::pipeline::ParticleTypes;
/// use stereology::shape::{Arrangement, Particle, PeriodicBox};
/// use stereology::volume::{Residual, Solid};
///
/// // A sphere of diameter 40 in a box of side 64.
/// let spheres = ParticleTypes::parse(&["sphere"])?;
/// let particle = Particle { shape: 0, size: 40.0, category: 0, position: Point3::new(32.0, 32.0, 32.0), orientation: UnitQuaternion::identity() };
/// let period = PeriodicBox::new(Vector3::repeat(64.0))?;
/// let residual = Residual { binder: ndarray::Array4::zeros([8, 8, 8, 3]), particles: ndarray::Array4::zeros([8, 8, 8, 3]), voxel: 8.0 };
/// let made = Solid::new(Arrangement::new(spheres.unit_bodies(), vec![particle], period)?, vec![[0.7, 0.3, 0.2]], [0.8; 3], Some(residual.clone()))?;
/// let folder = tempfile::tempdir()?;
/// solid::write(folder.path(), &made, &residual, &spheres)?;
/// let opened = solid::read(folder.path())?;
/// assert_eq!(opened.solid.particles(), made.particles());
/// assert_eq!(opened.shapes, ["sphere"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write(
    folder: impl AsRef<Path>,
    solid: &Solid,
    residual: &Residual,
    types: &ParticleTypes,
) -> Result<(), FileError> {
    let folder = folder.as_ref();
    let names = types.types().iter().map(|of| of.name.clone()).collect();
    PackingFile::new(names, solid.particles(), solid.period()).write(folder.join("packing.json"))?;
    let entry = |mesh: &ClosedMesh| MeshEntry {
        vertices: mesh.vertices().iter().map(|v| v.coords.into()).collect(),
        triangles: mesh.triangles().to_vec(),
    };
    let from_file = |name: &str| Path::new(name).extension().is_some();
    let file = SolidFile {
        schema: SOLID_SCHEMA.to_owned(),
        binder: solid.binder(),
        voxel: residual.voxel,
        meshes: types
            .types()
            .iter()
            .map(|of| of.body.mesh().filter(|_| from_file(&of.name)).map(entry))
            .collect(),
        colours: solid.colours().to_vec(),
        voids: solid.voids().to_vec(),
    };
    json::write(&folder.join("solid.json"), &file)?;
    residual_file::write(&folder.join("texture.npy"), residual)
}

/// A solid read from its folder, and the specifications of its shapes.
#[derive(Clone, Debug)]
pub struct SavedSolid {
    /// The solid.
    pub solid: Solid,
    /// Specification of each shape.
    pub shapes: Vec<String>,
}

/// Reads the folder that [`write()`] wrote.
///
/// # Errors
///
/// [`FileError`]: a file that is missing, broken or inconsistent with the others.
pub fn read(folder: impl AsRef<Path>) -> Result<SavedSolid, FileError> {
    let folder = folder.as_ref();
    let path = folder.join("solid.json");
    // Read first: another version may hold other fields.
    let Schema { schema } = json::read(&path)?;
    if schema != SOLID_SCHEMA {
        return Err(FileError::Schema {
            path,
            found: schema,
            expected: SOLID_SCHEMA,
        });
    }
    let file: SolidFile = json::read(&path)?;
    let packing_path = folder.join("packing.json");
    let texture_path = folder.join("texture.npy");
    // In parallel: both take a while.
    let (packing, residual) = rayon::join(
        || PackingFile::read(&packing_path),
        || residual_file::read(&texture_path, file.voxel),
    );
    let (packing, residual) = (packing?, residual?);
    let (particles, period) = packing
        .unpack()
        .map_err(|error| FileError::value(&packing_path, error))?;
    let bodies = packing
        .shapes
        .iter()
        .enumerate()
        .map(|(index, name)| {
            Ok(UnitBody::new(&body(
                name,
                file.meshes.get(index).and_then(Option::as_ref),
            )?))
        })
        .collect::<Result<Vec<_>, BodyError>>()
        .map_err(|error| FileError::value(&packing_path, error))?;
    let arrangement =
        Arrangement::new(bodies, particles, period).map_err(|error| FileError::value(&packing_path, error))?;
    let solid = Solid::new(arrangement, file.colours, file.binder, Some(residual))
        .and_then(|solid| solid.with_voids(&file.voids))
        .map_err(|error: SolidError| FileError::value(folder, error))?;
    Ok(SavedSolid {
        solid,
        shapes: packing.shapes,
    })
}

fn body(name: &str, mesh: Option<&MeshEntry>) -> Result<Body, BodyError> {
    let Some(mesh) = mesh else { return Body::parse(name) };
    let vertices = mesh.vertices.iter().copied().map(Point3::from).collect();
    Ok(Body::from_mesh(ClosedMesh::try_from(TriangleMesh {
        vertices,
        triangles: mesh.triangles.clone(),
    })?))
}
