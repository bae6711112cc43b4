//! A solid in a folder: `packing.json`, `solid.json` with the colours, `texture.npy` with the residual
//! if there is one. A bare `packing.json` can be opened too.

use crate::files::packing::PackingFile;
use crate::files::{FileError, json, residual as residual_file};
use crate::pipeline::ParticleTypes;
use nalgebra::Point3;
use serde::{Deserialize, Serialize};
use std::path::Path;
use stereology_grid::LengthUnit;
use stereology_shape::{Arrangement, Body, BodyError, ClosedMesh, TriangleMesh, UnitBody};
use stereology_volume::{Residual, Solid, SolidError};

/// `solid.json`: the colours of a packing. The particles are in `packing.json`, the residual is in `texture.npy` beside
/// it.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct SolidFile {
    schema: String,
    binder: [f32; 3],
    /// Edge of a voxel of texture.npy; null without that file.
    voxel: Option<f64>,
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

/// Writes a solid as `packing.json`, `solid.json` and, with a residual, `texture.npy` into `folder`. Lengths are in
/// `unit`.
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
/// solid::write(folder.path(), &made, Some(&residual), &spheres, None)?;
/// let opened = solid::read(folder.path())?;
/// assert_eq!(opened.solid.particles(), made.particles());
/// assert_eq!(opened.shapes[0].name, "sphere");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write(
    folder: impl AsRef<Path>,
    solid: &Solid,
    residual: Option<&Residual>,
    types: &ParticleTypes,
    unit: Option<LengthUnit>,
) -> Result<(), FileError> {
    let shapes = types.types().iter().map(|of| SavedShape {
        name: of.name.clone(),
        body: of.body.clone(),
    });
    write_parts(folder, solid, residual, &shapes.collect::<Vec<_>>(), unit)
}

/// [`write()`] for a solid whose shapes were read from files.
///
/// # Errors
///
/// [`FileError`] if a file cannot be written.
pub fn write_parts(
    folder: impl AsRef<Path>,
    solid: &Solid,
    residual: Option<&Residual>,
    shapes: &[SavedShape],
    unit: Option<LengthUnit>,
) -> Result<(), FileError> {
    let folder = folder.as_ref();
    let names = shapes.iter().map(|of| of.name.clone()).collect();
    PackingFile::new(names, solid.particles(), solid.period())
        .with_unit(unit)
        .write(folder.join("packing.json"))?;
    let entry = |mesh: &ClosedMesh| MeshEntry {
        vertices: mesh.vertices().iter().map(|v| v.coords.into()).collect(),
        triangles: mesh.triangles().to_vec(),
    };
    let from_file = |name: &str| Path::new(name).extension().is_some();
    let file = SolidFile {
        schema: SOLID_SCHEMA.to_owned(),
        binder: solid.binder(),
        voxel: residual.map(|residual| residual.voxel),
        meshes: shapes
            .iter()
            .map(|of| of.body.mesh().filter(|_| from_file(&of.name)).map(entry))
            .collect(),
        colours: solid.colours().to_vec(),
        voids: solid.voids().to_vec(),
    };
    json::write(&folder.join("solid.json"), &file)?;
    residual.map_or(Ok(()), |residual| {
        residual_file::write(&folder.join("texture.npy"), residual)
    })
}

/// A shape of a packing.
#[derive(Clone, Debug)]
pub struct SavedShape {
    /// Its specification.
    pub name: String,
    /// Its body.
    pub body: Body,
}

/// A solid read from its folder.
#[derive(Clone, Debug)]
pub struct SavedSolid {
    /// The solid.
    pub solid: Solid,
    /// Each shape.
    pub shapes: Vec<SavedShape>,
    /// Unit of all lengths, if it is known.
    pub unit: Option<LengthUnit>,
}

/// Reads the folder that [`write()`] wrote.
///
/// # Errors
///
/// [`FileError`]: a file that is missing, broken or inconsistent with the others.
pub fn read(folder: impl AsRef<Path>) -> Result<SavedSolid, FileError> {
    let folder = folder.as_ref();
    let file = read_file(&folder.join("solid.json"))?;
    let packing_path = folder.join("packing.json");
    let texture_path = folder.join("texture.npy");
    // In parallel: both take a while.
    let (packing, residual) = rayon::join(
        || PackingFile::read(&packing_path),
        || {
            file.voxel
                .map(|voxel| residual_file::read(&texture_path, voxel))
                .transpose()
        },
    );
    let (packing, residual) = (packing?, residual?);
    let shapes = shapes(&packing_path, &packing.shapes, &file.meshes)?;
    let arrangement = arrangement(&packing_path, &packing, &shapes)?;
    let solid = Solid::new(arrangement, file.colours, file.binder, residual)
        .and_then(|solid| solid.with_voids(&file.voids))
        .map_err(|error: SolidError| FileError::value(folder, error))?;
    Ok(SavedSolid {
        solid,
        shapes,
        unit: packing.unit,
    })
}

/// Reads a `packing.json` without colours: particles of each category have a colour of their own, without texture.
///
/// Triangles of shapes from mesh files are taken from a `solid.json` beside it; otherwise the mesh file must be there.
///
/// # Errors
///
/// [`FileError`]: a file that cannot be read, is not a packing, or has shapes that cannot be read.
///
/// # Examples
///
/// ```
/// use stereology::files::{packing::PackingFile, solid};
/// use stereology::shape::{Particle, PeriodicBox};
///
/// let particle = Particle { shape: 0, size: 1.0, category: 3, position: nalgebra::Point3::origin(), orientation: nalgebra::UnitQuaternion::identity() };
/// let period = PeriodicBox::new(nalgebra::Vector3::repeat(4.0))?;
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("packing.json");
/// PackingFile::new(vec!["sphere".to_owned()], &[particle], &period).write(&file)?;
/// assert_eq!(solid::read_packing(&file)?.solid.particles(), [particle]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_packing(path: impl AsRef<Path>) -> Result<SavedSolid, FileError> {
    let path = path.as_ref();
    let packing = PackingFile::read(path)?;
    let beside = path.with_file_name("solid.json");
    let meshes = if beside.is_file() {
        read_file(&beside)?.meshes
    } else {
        Vec::new()
    };
    let shapes = shapes(path, &packing.shapes, &meshes)?;
    let arrangement = arrangement(path, &packing, &shapes)?;
    let colours = packing
        .particles
        .iter()
        .map(|particle| category_colour(particle.category));
    let solid = Solid::new(arrangement, colours.collect(), PLAIN_BINDER, None)
        .map_err(|error| FileError::value(path, error))?;
    Ok(SavedSolid {
        solid,
        shapes,
        unit: packing.unit,
    })
}

/// Colour of the binder of a packing without colours.
pub const PLAIN_BINDER: [f32; 3] = [0.88, 0.87, 0.84];

/// Colour of the particles of a category, if nothing else is known of it: hues one golden angle apart.
#[must_use]
pub fn category_colour(category: u8) -> [f32; 3] {
    let hue = (0.05 + 0.381_966 * f32::from(category)).fract();
    [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|channel| 0.5 + 0.22 * (std::f32::consts::TAU * (hue - channel)).cos())
}

fn read_file(path: &Path) -> Result<SolidFile, FileError> {
    // Read first: another version may hold other fields.
    let Schema { schema } = json::read(path)?;
    if schema != SOLID_SCHEMA {
        return Err(FileError::Schema {
            path: path.to_owned(),
            found: schema,
            expected: SOLID_SCHEMA,
        });
    }
    json::read(path)
}

/// Edge of a voxel of the texture beside a `solid.json`, if that can be read.
pub(crate) fn texture_voxel(solid: &Path) -> Option<f64> {
    read_file(solid).ok()?.voxel
}

fn shapes(path: &Path, names: &[String], meshes: &[Option<MeshEntry>]) -> Result<Vec<SavedShape>, FileError> {
    names
        .iter()
        .enumerate()
        .map(|(index, name)| {
            Ok(SavedShape {
                name: name.clone(),
                body: body(name, meshes.get(index).and_then(Option::as_ref))?,
            })
        })
        .collect::<Result<_, BodyError>>()
        .map_err(|error| FileError::value(path, error))
}

fn arrangement(path: &Path, packing: &PackingFile, shapes: &[SavedShape]) -> Result<Arrangement, FileError> {
    let (particles, period) = packing.unpack().map_err(|error| FileError::value(path, error))?;
    let bodies: Vec<UnitBody> = shapes.iter().map(|of| UnitBody::new(&of.body)).collect();
    Arrangement::new(bodies, particles, period).map_err(|error| FileError::value(path, error))
}

fn body(name: &str, mesh: Option<&MeshEntry>) -> Result<Body, BodyError> {
    let Some(mesh) = mesh else { return Body::parse(name) };
    let vertices = mesh.vertices.iter().copied().map(Point3::from).collect();
    Ok(Body::from_mesh(ClosedMesh::try_from(TriangleMesh {
        vertices,
        triangles: mesh.triangles.clone(),
    })?))
}
