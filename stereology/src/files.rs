//! The files a solid is kept in: `packing.json`, `densities.csv`, `solid.json` with `texture.npy`.
//!
//! Files hold lengths in the unit of the run, colours sRGB-encoded / 255, and neither times nor paths of where they were made.

use crate::pipeline::{ParticleDensities, ParticleTypes};
use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use ndarray::{Array4, Axis, Ix4, concatenate};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::fs::File;
use std::io::{self, BufReader, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use stereology_grid::{Format, GridError, VolumeShape, read_npy, write_atomically, write_volume};
use stereology_shape::{
    Arrangement, Body, BodyError, BoxError, ClosedMesh, Particle, PeriodicBox, TriangleMesh, UnitBody,
};
use stereology_unfold::Unfolding;
use stereology_volume::{Residual, Solid, SolidError};

/// `packing.json`: particles in a box that repeats.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PackingFile {
    /// Sides of the box along x, y, z.
    #[serde(rename = "box")]
    pub sides: [f64; 3],
    /// What each shape is: `sphere`, `rock:1`, a mesh file.
    pub shapes: Vec<String>,
    /// The particles.
    pub particles: Vec<PackedParticle>,
}

/// A particle of a [`PackingFile`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PackedParticle {
    /// Index of its shape.
    pub shape: usize,
    /// Diameter of the circle with the area of its largest section.
    pub size: f64,
    /// Colour category.
    pub category: u8,
    /// Its centre of volume.
    pub position: [f64; 3],
    /// Unit quaternion w, x, y, z.
    pub orientation: [f64; 4],
}

/// A file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The operating system said no.
    #[error("{path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Not the JSON that was expected.
    #[error("{path}: not a file of this kind ({source}); give a folder written by `stereology synthesize`")]
    Json {
        /// Which file.
        path: PathBuf,
        /// Where and why.
        source: serde_json::Error,
    },
    /// Another kind of file, or of another version.
    #[error(
        "{path}: its schema is {found:?}, this program reads {SOLID_SCHEMA:?}; take the version of the program that wrote it, or make the solid again with this one"
    )]
    Schema {
        /// Which file.
        path: PathBuf,
        /// What it says it is.
        found: String,
    },
    /// A value that cannot be.
    #[error("{path}: {what}")]
    Value {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// An array.
    #[error(transparent)]
    Grid(#[from] GridError),
}

impl FileError {
    fn value(path: &Path, what: impl ToString) -> Self {
        Self::Value {
            path: path.to_owned(),
            what: what.to_string(),
        }
    }
}

impl PackingFile {
    /// The particles of a packing; `shapes` names each shape.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology::files::PackingFile;
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
            shapes,
            particles: particles.iter().map(packed).collect(),
        }
    }

    /// The particles and their box.
    ///
    /// # Errors
    ///
    /// [`BoxError`] for sides that are no lengths.
    pub fn unpack(&self) -> Result<(Vec<Particle>, PeriodicBox), BoxError> {
        let particle = |packed: &PackedParticle| {
            let [w, i, j, k] = packed.orientation;
            Particle {
                shape: packed.shape,
                size: packed.size,
                category: packed.category,
                position: Point3::from(packed.position),
                // As written: normalising again could change the last bit.
                orientation: UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k)),
            }
        };
        let period = PeriodicBox::new(Vector3::from(self.sides))?;
        Ok((self.particles.iter().map(particle).collect(), period))
    }

    /// Writes `packing.json`, whole or not at all.
    ///
    /// # Errors
    ///
    /// [`FileError`] if it cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        write_json(path.as_ref(), self)
    }

    /// Reads `packing.json`.
    ///
    /// # Errors
    ///
    /// [`FileError`] if it cannot be read, is no such file, or a shape index or orientation in it cannot be.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, FileError> {
        let path = path.as_ref();
        let file: Self = read_json(path)?;
        for (index, particle) in file.particles.iter().enumerate() {
            let norm: f64 = particle.orientation.iter().map(|c| c * c).sum();
            if particle.shape >= file.shapes.len() {
                return Err(FileError::value(
                    path,
                    format!(
                        "particle {index} has shape {}, of {}",
                        particle.shape,
                        file.shapes.len()
                    ),
                ));
            }
            if (norm - 1.0).abs() > 1e-6 {
                return Err(FileError::value(
                    path,
                    format!("particle {index}: its orientation is no unit quaternion"),
                ));
            }
        }
        Ok(file)
    }
}

/// `solid.json`: what colours a packing; the particles are in `packing.json`, the residual in `texture.npy` beside it.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct SolidFile {
    schema: String,
    binder: [f32; 3],
    /// Edge of a voxel of texture.npy.
    voxel: f64,
    /// Triangles of the shapes that came from mesh files, so that the folder stands by itself.
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
/// texture.npy has axes (z, y, x, channel), f32: channels 0-2 are the binder's residual, 3-5 that of the particles.
///
/// # Errors
///
/// [`FileError`] if a file cannot be written.
///
/// # Examples
///
/// ```
/// use stereology::files::{open_solid, save_solid};
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
/// let solid = Solid::new(Arrangement::new(spheres.unit_bodies(), vec![particle], period)?, vec![[0.7, 0.3, 0.2]], [0.8; 3], Some(residual.clone()))?;
/// let folder = tempfile::tempdir()?;
/// save_solid(folder.path(), &solid, &residual, &spheres)?;
/// let opened = open_solid(folder.path())?;
/// assert_eq!(opened.solid.particles(), solid.particles());
/// assert_eq!(opened.shapes, ["sphere"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn save_solid(
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
    write_json(&folder.join("solid.json"), &file)?;
    write_texture(&folder.join("texture.npy"), residual)
}

fn write_texture(path: &Path, residual: &Residual) -> Result<(), FileError> {
    let both = concatenate(Axis(3), &[residual.binder.view(), residual.particles.view()])
        .map_err(|_| FileError::value(path, "the residuals of binder and particles differ in size"))?;
    let (nz, ny, nx, channels) = both.dim();
    let spacing = [residual.voxel; 3];
    let slab = |z: usize, mut slab: ndarray::ArrayViewMut3<'_, f32>| {
        slab.assign(&both.index_axis(Axis(0), z));
        ControlFlow::Continue(())
    };
    Ok(write_volume::<f32>(
        path,
        Format::Npy,
        VolumeShape { nz, ny, nx, channels },
        spacing,
        slab,
    )?)
}

/// A solid opened from its folder, and the names of its shapes.
#[derive(Clone, Debug)]
pub struct SavedSolid {
    /// The solid.
    pub solid: Solid,
    /// What each shape is.
    pub shapes: Vec<String>,
}

/// Opens what [`save_solid`] wrote.
///
/// # Errors
///
/// [`FileError`]: which file is missing, broken or does not fit the others.
pub fn open_solid(folder: impl AsRef<Path>) -> Result<SavedSolid, FileError> {
    let folder = folder.as_ref();
    let path = folder.join("solid.json");
    // Asked first: another version may hold other fields.
    let Schema { schema } = read_json(&path)?;
    if schema != SOLID_SCHEMA {
        return Err(FileError::Schema { path, found: schema });
    }
    let file: SolidFile = read_json(&path)?;
    let packing_path = folder.join("packing.json");
    let texture_path = folder.join("texture.npy");
    // Beside each other: either takes a while.
    let (packing, residual) = rayon::join(
        || PackingFile::read(&packing_path),
        || read_texture(&texture_path, file.voxel),
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

fn read_texture(path: &Path, voxel: f64) -> Result<Residual, FileError> {
    let both: Array4<f32> = read_npy::<f32>(path)?
        .into_dimensionality::<Ix4>()
        .ok()
        .filter(|array| array.dim().3 == 6)
        .ok_or_else(|| FileError::value(path, "not a residual volume: axes (z, y, x, 6) are expected"))?;
    let (nz, ny, nx, _) = both.dim();
    let both = both.as_standard_layout();
    let part = |from: usize| {
        let voxels = both.as_slice().unwrap_or_default().as_chunks::<6>().0.iter();
        let samples: Vec<[f32; 3]> = voxels
            .map(|both| [both[from], both[from + 1], both[from + 2]])
            .collect();
        Array4::from_shape_vec((nz, ny, nx, 3), samples.into_flattened())
    };
    let (binder, particles) = rayon::join(|| part(0), || part(3));
    let damaged = |error| FileError::value(path, error);
    Ok(Residual {
        binder: binder.map_err(damaged)?,
        particles: particles.map_err(damaged)?,
        voxel,
    })
}

/// `densities.csv`: lower_edge,upper_edge,number_density,lower,upper,type,category, all types together; rows of each category follow those of all.
///
/// # Errors
///
/// [`FileError`] if it cannot be written.
///
/// # Examples
///
/// ```
/// use std::ops::ControlFlow;
/// use stereology::files::write_densities;
/// use stereology::pipeline::{DensityOptions, MeasuredProfiles, ParticleTypes, unfold_profiles};
///
/// let profiles = MeasuredProfiles { sizes: vec![3.0, 4.0, 5.0], weights: vec![1.0; 3], categories: vec![0; 3], area: 100.0, ..MeasuredProfiles::default() };
/// let options = DensityOptions { bins: 2, ..DensityOptions::default() };
/// let densities = unfold_profiles(&profiles, &ParticleTypes::parse(&["sphere"])?, &options, &|_| ControlFlow::Continue(()))?;
/// let folder = tempfile::tempdir()?;
/// write_densities(folder.path().join("densities.csv"), &densities)?;
/// let table = std::fs::read_to_string(folder.path().join("densities.csv"))?;
/// assert_eq!(table.lines().count(), 1 + 2);
/// assert!(table.lines().nth(2).is_some_and(|row| row.starts_with("2.5,5,")));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_densities(path: impl AsRef<Path>, densities: &ParticleDensities) -> Result<(), FileError> {
    let mut rows = DensityRows::default();
    rows.unfolding(&densities.all, None, None);
    if densities.by_category.len() > 1 {
        for (category, number_density) in densities.by_category.iter().enumerate() {
            rows.densities(&densities.all.edges, number_density, None, Some(category));
        }
    }
    rows.write(path)
}

/// Rows of `densities.csv`, gathered and then written.
///
/// # Examples
///
/// ```
/// use stereology::files::DensityRows;
///
/// let mut rows = DensityRows::default();
/// rows.densities(&[0.0, 1.0, 2.0], &[None, Some(0.25)], Some(0), None); // nothing is known of the first bin
/// let folder = tempfile::tempdir()?;
/// rows.write(folder.path().join("densities.csv"))?;
/// assert!(std::fs::read_to_string(folder.path().join("densities.csv"))?.ends_with("0,1,,,,0,\n1,2,0.25,,,0,\n"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct DensityRows {
    lines: Vec<String>,
}

impl DensityRows {
    /// Adds the bins of an unfolding with their intervals; `None` for a type or category means all together, an empty field.
    pub fn unfolding(&mut self, unfolding: &Unfolding, particle_type: Option<usize>, category: Option<usize>) {
        let intervals = unfolding
            .intervals
            .clone()
            .unwrap_or_else(|| vec![None; unfolding.number_density.len()]);
        for (bin, interval) in intervals.iter().enumerate() {
            let ends = interval.map(|interval| [interval.lower, interval.upper]);
            self.row(
                &unfolding.edges[bin..bin + 2],
                unfolding.number_density[bin],
                ends,
                particle_type,
                category,
            );
        }
    }

    /// Adds bins without intervals.
    pub fn densities(
        &mut self,
        edges: &[f64],
        number_density: &[Option<f64>],
        particle_type: Option<usize>,
        category: Option<usize>,
    ) {
        for (edges, density) in edges.windows(2).zip(number_density) {
            self.row(edges, *density, None, particle_type, category);
        }
    }

    fn row(
        &mut self,
        edges: &[f64],
        density: Option<f64>,
        ends: Option<[f64; 2]>,
        particle_type: Option<usize>,
        category: Option<usize>,
    ) {
        let number = |value: Option<f64>| value.map(|v| v.to_string()).unwrap_or_default();
        let index = |value: Option<usize>| value.map(|v| v.to_string()).unwrap_or_default();
        self.lines.push(format!(
            "{},{},{},{},{},{},{}",
            edges[0],
            edges[1],
            number(density),
            number(ends.map(|e| e[0])),
            number(ends.map(|e| e[1])),
            index(particle_type),
            index(category)
        ));
    }

    /// Writes the table, whole or not at all.
    ///
    /// # Errors
    ///
    /// [`FileError`] if it cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        Ok(write_atomically(path, |out| {
            writeln!(out, "lower_edge,upper_edge,number_density,lower,upper,type,category")?;
            self.lines.iter().try_for_each(|line| writeln!(out, "{line}"))
        })?)
    }
}

fn write_json(path: &Path, value: &impl Serialize) -> Result<(), FileError> {
    Ok(write_atomically(path, |out| {
        serde_json::to_writer(&mut *out, value)?;
        writeln!(out)
    })?)
}

fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T, FileError> {
    let file = File::open(path).map_err(|source| FileError::Io {
        path: path.to_owned(),
        source,
    })?;
    serde_json::from_reader(BufReader::new(file)).map_err(|source| FileError::Json {
        path: path.to_owned(),
        source,
    })
}
