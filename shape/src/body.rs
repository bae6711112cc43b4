//! Bodies of particles: closed forms and meshes.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::{Point3, UnitVector3, Vector3};

#[cfg(feature = "io")]
use crate::generate::control_sphere::ControlSphere;
use crate::generate::rock;
use crate::generate::superellipsoid::{EXPONENTS, superellipsoid};
use crate::mesh::closed_mesh::ClosedMesh;
use crate::mesh::hull::convex_hull;
use crate::mesh::mesh_error::MeshError;
use crate::mesh::triangle_mesh::TriangleMesh;
use crate::query::elliptic::{self, carlson_rg};
use crate::section::largest_section::largest_section_area;
use crate::section::slicer::Slicer;

/// A solid body in its own unit of length and position. It is measured once.
///
/// # Examples
///
/// ```
/// use stereology_shape::Body;
///
/// let sphere = Body::sphere(2.0)?;
/// assert_eq!((sphere.mean_width(), sphere.size()), (2.0, 2.0));
///
/// let brick = Body::parse("box:1,2,3")?;
/// assert!((brick.volume() - 6.0).abs() < 1e-12);
/// assert!((brick.mean_width() - 3.0).abs() < 1e-12);
/// # Ok::<(), stereology_shape::BodyError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    form: Form,
    largest_section_area: f64,
}

#[derive(Clone, Debug, PartialEq)]
enum Form {
    Sphere { diameter: f64 },
    Ellipsoid { axes: Vector3<f64> },
    Mesh(Arc<ClosedMesh>),
}

/// The description of a body, for code that has a closed form for it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum BodyKind<'a> {
    /// A sphere about the origin.
    Sphere {
        /// Its diameter.
        diameter: f64,
    },
    /// An ellipsoid about the origin, its axes along x, y, z.
    Ellipsoid {
        /// Half its extent along x, y, z.
        semi_axes: [f64; 3],
    },
    /// Anything else.
    Mesh(&'a ClosedMesh),
}

/// Why a body cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BodyError {
    /// A length is not positive and finite, or too large or small for its cube.
    #[error("the {what} of a body is a length from 1e-60 to 1e60, not {value}")]
    Length {
        /// Which length.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// The description starts like a shape, but its numbers are wrong.
    #[error("{spec:?} is not a shape: write {expected}, numbers separated by commas")]
    Numbers {
        /// What was given.
        spec: String,
        /// How it is written.
        expected: &'static str,
    },
    /// Neither a shape nor a mesh file.
    #[error(
        "{spec:?} is not a shape: write sphere, ellipsoid:A,B,C (semi-axes), box:A,B,C (edges), cylinder:D,L, rock:SEED[,ROUGHNESS], \
         superellipsoid:A,B,C,E1,E2, hull:FILE (a mesh file, or text rows of x, y, z), or the name of a mesh (.obj, .stl, .ply) or control-point file (.json)"
    )]
    UnknownShape {
        /// What was given.
        spec: String,
    },
    /// A roughness outside 0 to 1.
    #[error("the roughness of a rock is a number from 0 to 1, not {0}")]
    Roughness(f64),
    /// An exponent of a superellipsoid outside 0.05 to 4.
    #[error("the exponents of a superellipsoid are numbers from 0.05 (a box) over 1 (an ellipsoid) to 4, not {0}")]
    Exponent(f64),
    /// Points have no hull.
    #[error(transparent)]
    Hull(#[from] crate::mesh::quickhull::HullError),
    /// The points of a file have no hull.
    #[error("{path}: {source}")]
    HullOf {
        /// The file.
        path: String,
        /// What is wrong with its points.
        source: crate::mesh::quickhull::HullError,
    },
    /// The control points of a file make no surface.
    #[error("{path}: {source}")]
    ControlPoints {
        /// The file.
        path: String,
        /// What is wrong with its control points.
        source: crate::generate::control_sphere::ControlSphereError,
    },
    /// The triangles enclose no solid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The triangles of a file enclose no solid.
    #[error("{path}: {source}")]
    MeshOf {
        /// The file.
        path: String,
        /// What is wrong with its mesh.
        source: MeshError,
    },
    /// The mesh file cannot be read.
    #[cfg(feature = "io")]
    #[error(transparent)]
    File(#[from] crate::file::mesh_file_error::MeshFileError),
}

/// Sides of the prism that approximates a cylinder.
const CYLINDER_SIDES: u32 = 128;
/// Steps per arc of the surface of a control-point sphere.
#[cfg(feature = "io")]
const CONTROL_STEPS: u32 = 16;

impl Body {
    /// A sphere about the origin.
    ///
    /// # Errors
    ///
    /// [`BodyError::Length`] unless the diameter is a positive finite length.
    ///
    /// ```
    /// # use stereology_shape::Body;
    /// assert!((Body::sphere(1.0)?.volume() - std::f64::consts::PI / 6.0).abs() < 1e-15);
    /// # Ok::<(), stereology_shape::BodyError>(())
    /// ```
    pub fn sphere(diameter: f64) -> Result<Self, BodyError> {
        check_length("diameter", diameter)?;
        Ok(Self {
            form: Form::Sphere { diameter },
            largest_section_area: 0.25 * PI * diameter * diameter,
        })
    }

    /// An ellipsoid about the origin with these **semi**-axes along x, y, z.
    ///
    /// # Errors
    ///
    /// [`BodyError::Length`] unless all are positive finite lengths.
    ///
    /// ```
    /// # use stereology_shape::Body;
    /// let disc = Body::ellipsoid([2.0, 2.0, 0.5])?;
    /// assert_eq!(disc.size(), 4.0);
    /// # Ok::<(), stereology_shape::BodyError>(())
    /// ```
    pub fn ellipsoid(semi_axes: [f64; 3]) -> Result<Self, BodyError> {
        for axis in semi_axes {
            check_length("semi-axis", axis)?;
        }
        let axes = Vector3::from(semi_axes);
        // The product of the two largest axes is the product of all over the smallest.
        let largest_section_area = PI * (axes.product() / axes.min());
        Ok(Self {
            form: Form::Ellipsoid { axes },
            largest_section_area,
        })
    }

    /// A box about the origin with these full edges along x, y, z.
    ///
    /// # Errors
    ///
    /// [`BodyError`] unless all are positive finite lengths and the box is not too flat to have a volume.
    ///
    /// ```
    /// # use stereology_shape::Body;
    /// let cube = Body::cuboid([1.0; 3])?;
    /// assert!((cube.largest_section_area() - 2.0_f64.sqrt()).abs() < 1e-9); // through two opposite edges
    /// # Ok::<(), stereology_shape::BodyError>(())
    /// ```
    pub fn cuboid(edges: [f64; 3]) -> Result<Self, BodyError> {
        for edge in edges {
            check_length("edge", edge)?;
        }
        Ok(Self::from_mesh(ClosedMesh::try_from(TriangleMesh::cuboid(edges))?))
    }

    /// A cylinder along z about the origin: a prism of 128 sides with the circle's cross-section area.
    ///
    /// # Errors
    ///
    /// [`BodyError`] unless both are positive finite lengths and the cylinder is not too flat to have a volume.
    ///
    /// ```
    /// # use stereology_shape::Body;
    /// let can = Body::cylinder(2.0, 1.0)?;
    /// assert!((can.volume() - std::f64::consts::PI).abs() < 1e-9);
    /// # Ok::<(), stereology_shape::BodyError>(())
    /// ```
    pub fn cylinder(diameter: f64, length: f64) -> Result<Self, BodyError> {
        check_length("diameter", diameter)?;
        check_length("length", length)?;
        Ok(Self::from_mesh(ClosedMesh::try_from(TriangleMesh::cylinder(
            diameter,
            length,
            CYLINDER_SIDES,
        ))?))
    }

    /// A convex rock of 16 to 38 faces, about one unit across; the same body for the same seed.
    ///
    /// ```
    /// # use stereology_shape::Body;
    /// let rock = Body::rock(5);
    /// assert!(rock.is_convex() && rock == Body::rock(5) && rock != Body::rock(6));
    /// ```
    #[must_use]
    pub fn rock(seed: u64) -> Self {
        Self::from_mesh(rock::rock(seed))
    }

    /// The rock of the same seed with a rough surface, 5,120 triangles: radii times exp(`amplitude` g), where g is a
    /// random sum of spherical harmonics of degrees 3 to 20, self-affine, of mean square 1. Amplitudes of 0.02 (worn)
    /// to 0.1 (jagged) look like stone.
    ///
    /// # Errors
    ///
    /// [`BodyError::Length`] unless the amplitude is from 0 to 1.
    ///
    /// ```
    /// # use stereology_shape::Body;
    /// let rough = Body::rough_rock(5, 0.05)?;
    /// assert!(!rough.is_convex() && (rough.volume() / Body::rock(5).volume() - 1.0).abs() < 0.2);
    /// # Ok::<(), stereology_shape::BodyError>(())
    /// ```
    pub fn rough_rock(seed: u64, amplitude: f64) -> Result<Self, BodyError> {
        if !(0.0..=1.0).contains(&amplitude) {
            return Err(BodyError::Roughness(amplitude));
        }
        Ok(Self::from_mesh(rock::rough_rock(seed, amplitude)?))
    }

    /// A superellipsoid about the origin with these **semi**-axes along x, y, z and exponents (north-south, east-west):
    /// near 0 a box, 1 an ellipsoid, 2 an octahedron, above 2 a star. A mesh of up to 5,120 (stars: 8,192) triangles
    /// with its vertices on the surface.
    ///
    /// # Errors
    ///
    /// [`BodyError`] unless axes are lengths and exponents from 0.05 to 4.
    ///
    /// ```
    /// # use stereology_shape::Body;
    /// let pillow = Body::superellipsoid([1.0, 1.0, 0.5], [0.5, 0.5])?;
    /// let (ball, brick) = (Body::ellipsoid([1.0, 1.0, 0.5])?.volume(), 4.0);
    /// assert!(pillow.is_convex() && pillow.volume() > ball && pillow.volume() < brick);
    /// # Ok::<(), stereology_shape::BodyError>(())
    /// ```
    pub fn superellipsoid(semi_axes: [f64; 3], exponents: [f64; 2]) -> Result<Self, BodyError> {
        for axis in semi_axes {
            check_length("semi-axis", axis)?;
        }
        if let Some(&wrong) = exponents.iter().find(|e| !EXPONENTS.contains(e)) {
            return Err(BodyError::Exponent(wrong));
        }
        Ok(Self::from_mesh(superellipsoid(semi_axes, exponents)?))
    }

    /// The convex hull of points.
    ///
    /// # Errors
    ///
    /// [`BodyError::Hull`] if their hull has no volume.
    pub fn hull(points: &[Point3<f64>]) -> Result<Self, BodyError> {
        Ok(Self::from_mesh(convex_hull(points)?))
    }

    /// The solid inside a closed mesh.
    ///
    /// ```
    /// # use stereology_shape::{Body, ClosedMesh, TriangleMesh};
    /// let torus = Body::from_mesh(ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.5, 64, 24))?);
    /// assert!(!torus.is_convex());
    /// # Ok::<(), stereology_shape::MeshError>(())
    /// ```
    #[must_use]
    pub fn from_mesh(mesh: ClosedMesh) -> Self {
        let largest_section_area = largest_section_area(&mesh);
        Self {
            form: Form::Mesh(Arc::new(mesh)),
            largest_section_area,
        }
    }

    /// Reads a body from its description: `sphere` (diameter 1), `ellipsoid:A,B,C` (semi-axes), `box:A,B,C` (full
    /// edges), `cylinder:D,L`, `rock:SEED` or `rock:SEED,ROUGHNESS`, `superellipsoid:A,B,C,E1,E2` (semi-axes,
    /// exponents), and with feature `io` `hull:FILE` (of [points](crate::read_points): the vertices of a mesh file, or
    /// rows of x, y, z) or the name of a mesh file or of a control-point sphere (.json).
    ///
    /// # Errors
    ///
    /// [`BodyError`] states what is wrong with the words, the numbers, the file or its mesh, and where.
    ///
    /// ```
    /// # use stereology_shape::Body;
    /// assert_eq!(Body::parse("rock:3")?, Body::rock(3));
    /// assert!(Body::parse("box:1,2").is_err());
    /// # Ok::<(), stereology_shape::BodyError>(())
    /// ```
    pub fn parse(spec: &str) -> Result<Self, BodyError> {
        Self::parse_welding(spec, 0.0)
    }

    /// Like [`parse`](Self::parse), but vertices of a mesh file nearer than `weld` to each other are joined first.
    ///
    /// # Errors
    ///
    /// As [`parse`](Self::parse).
    pub fn parse_welding(spec: &str, weld: f64) -> Result<Self, BodyError> {
        let (name, rest) = spec.split_once(':').unwrap_or((spec, ""));
        match name {
            "sphere" if rest.is_empty() => Self::sphere(1.0),
            "sphere" => Err(BodyError::Numbers {
                spec: spec.to_owned(),
                expected: "sphere (its diameter is 1)",
            }),
            "ellipsoid" => Self::ellipsoid(numbers(spec, rest, "ellipsoid:A,B,C (semi-axes)")?),
            "box" => Self::cuboid(numbers(spec, rest, "box:A,B,C (full edges)")?),
            "cylinder" => {
                let [diameter, length] = numbers(spec, rest, "cylinder:D,L (diameter, length)")?;
                Self::cylinder(diameter, length)
            }
            "rock" => {
                let wrong = || BodyError::Numbers {
                    spec: spec.to_owned(),
                    expected: "rock:SEED or rock:SEED,ROUGHNESS, a whole number and a number from 0 to 1",
                };
                let (seed, roughness) = match rest.split_once(',') {
                    Some((seed, roughness)) => (seed, Some(roughness.trim().parse().map_err(|_| wrong())?)),
                    None => (rest, None),
                };
                let seed = seed.trim().parse().map_err(|_| wrong())?;
                roughness.map_or_else(|| Ok(Self::rock(seed)), |roughness| Self::rough_rock(seed, roughness))
            }
            "superellipsoid" => {
                let [a, b, c, e1, e2] = numbers(spec, rest, "superellipsoid:A,B,C,E1,E2 (semi-axes, exponents)")?;
                Self::superellipsoid([a, b, c], [e1, e2])
            }
            #[cfg(feature = "io")]
            "hull" => Self::hull(&crate::file::point_file::read_points(rest)?).map_err(|error| match error {
                BodyError::Hull(source) => BodyError::HullOf {
                    path: rest.to_owned(),
                    source,
                },
                other => other,
            }),
            _ => Self::from_file(spec, weld),
        }
    }

    #[cfg(feature = "io")]
    fn from_file(spec: &str, weld: f64) -> Result<Self, BodyError> {
        let path = std::path::Path::new(spec);
        if path
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("json"))
        {
            return Self::from_control_points(spec);
        }
        if crate::file::mesh_file::MeshFormat::from_path(path).is_err() {
            return Err(BodyError::UnknownShape { spec: spec.to_owned() });
        }
        let mesh = crate::file::mesh_file::read_mesh(path)?;
        let closed = ClosedMesh::welded_within(mesh, weld).map_err(|source| BodyError::MeshOf {
            path: spec.to_owned(),
            source,
        })?;
        Ok(Self::from_mesh(closed))
    }

    #[cfg(feature = "io")]
    fn from_control_points(spec: &str) -> Result<Self, BodyError> {
        let text =
            std::fs::read_to_string(spec).map_err(|source| crate::file::mesh_file_error::MeshFileError::Read {
                path: spec.into(),
                source,
            })?;
        let sphere = ControlSphere::from_json(&text).map_err(|source| BodyError::ControlPoints {
            path: spec.to_owned(),
            source,
        })?;
        let closed = ClosedMesh::try_from(sphere.triangles(CONTROL_STEPS)).map_err(|source| BodyError::MeshOf {
            path: spec.to_owned(),
            source,
        })?;
        Ok(Self::from_mesh(closed))
    }

    #[cfg(not(feature = "io"))]
    fn from_file(spec: &str, _weld: f64) -> Result<Self, BodyError> {
        Err(BodyError::UnknownShape { spec: spec.to_owned() })
    }

    /// The closed form or the mesh.
    #[must_use]
    pub fn kind(&self) -> BodyKind<'_> {
        match &self.form {
            Form::Sphere { diameter } => BodyKind::Sphere { diameter: *diameter },
            Form::Ellipsoid { axes } => BodyKind::Ellipsoid {
                semi_axes: (*axes).into(),
            },
            Form::Mesh(mesh) => BodyKind::Mesh(mesh),
        }
    }

    /// The mesh, if the body is a mesh.
    #[must_use]
    pub fn mesh(&self) -> Option<&ClosedMesh> {
        match &self.form {
            Form::Mesh(mesh) => Some(mesh),
            _ => None,
        }
    }

    /// Triangles for drawing or writing: the mesh itself, or an icosphere of `20 · 4^subdivisions` triangles scaled to
    /// the closed form.
    ///
    /// ```
    /// # use stereology_shape::Body;
    /// assert_eq!(Body::sphere(1.0)?.to_triangles(2).triangles.len(), 320);
    /// # Ok::<(), stereology_shape::BodyError>(())
    /// ```
    #[must_use]
    pub fn to_triangles(&self, subdivisions: u32) -> TriangleMesh {
        match &self.form {
            Form::Sphere { diameter } => TriangleMesh::icosphere(*diameter, subdivisions),
            Form::Ellipsoid { axes } => {
                TriangleMesh::icosphere(2.0, subdivisions).mapped(|p| Point3::from(p.coords.component_mul(axes)))
            }
            Form::Mesh(mesh) => mesh.as_triangle_mesh().clone(),
        }
    }

    /// Volume; unit of length cubed.
    #[must_use]
    pub fn volume(&self) -> f64 {
        match &self.form {
            Form::Sphere { diameter } => PI / 6.0 * diameter.powi(3),
            Form::Ellipsoid { axes } => 4.0 / 3.0 * PI * axes.product(),
            Form::Mesh(mesh) => mesh.volume(),
        }
    }

    /// Area of the surface. Ellipsoids: 4π R_G(a²b², a²c², b²c²), Carlson's elliptic integral.
    #[must_use]
    pub fn surface_area(&self) -> f64 {
        match &self.form {
            Form::Sphere { diameter } => PI * diameter * diameter,
            Form::Ellipsoid { axes } => {
                // In units of the largest axis, so that fourth powers stay in range.
                let unit = axes.max();
                let [a, b, c]: [f64; 3] = (axes / unit).component_mul(&(axes / unit)).into();
                4.0 * PI * unit * unit * carlson_rg(a * b, a * c, b * c)
            }
            Form::Mesh(mesh) => mesh.surface_area(),
        }
    }

    /// Mean width (mean caliper diameter) of the convex hull: the number of parallel planes of unit spacing that meet
    /// it, averaged over directions and offsets. Ellipsoids: 2 R_G(a², b², c²).
    #[must_use]
    pub fn mean_width(&self) -> f64 {
        match &self.form {
            Form::Sphere { diameter } => *diameter,
            Form::Ellipsoid { axes } => {
                let unit = axes.max();
                let [a, b, c]: [f64; 3] = (axes / unit).component_mul(&(axes / unit)).into();
                2.0 * unit * carlson_rg(a, b, c)
            }
            Form::Mesh(mesh) => mesh.mean_width(),
        }
    }

    /// The mean of profiles minus holes over random planes, per plane spacing; equal to the mean width for a convex
    /// body.
    #[must_use]
    pub fn signed_mean_width(&self) -> f64 {
        self.mesh()
            .map_or_else(|| self.mean_width(), ClosedMesh::signed_mean_width)
    }

    /// Centre of volume.
    #[must_use]
    pub fn centroid(&self) -> Point3<f64> {
        self.mesh().map_or_else(Point3::origin, ClosedMesh::centroid)
    }

    /// Whether the body is convex. A section of a convex body is one profile without holes.
    #[must_use]
    pub fn is_convex(&self) -> bool {
        self.mesh().is_none_or(ClosedMesh::is_convex)
    }

    /// Area of the largest single profile of any plane section: exact for spheres and ellipsoids, found by maximisation
    /// over directions and depths for meshes (deterministic; never larger than an existing section).
    #[must_use]
    pub fn largest_section_area(&self) -> f64 {
        self.largest_section_area
    }

    /// Equivalent circular diameter of the largest profile, √(4 A / π). `size` has this meaning everywhere.
    #[must_use]
    pub fn size(&self) -> f64 {
        match &self.form {
            Form::Sphere { diameter } => *diameter,
            _ => (4.0 / PI * self.largest_section_area).sqrt(),
        }
    }

    /// Areas of the disjoint profiles of the section by the plane n·x = `offset`, holes subtracted; empty if the plane
    /// misses the body.
    ///
    /// ```
    /// # use nalgebra::Vector3;
    /// # use stereology_shape::Body;
    /// let areas = Body::ellipsoid([1.0, 2.0, 3.0])?.profile_areas(&Vector3::z_axis(), 0.0);
    /// assert!((areas[0] - 2.0 * std::f64::consts::PI).abs() < 1e-12);
    /// # Ok::<(), stereology_shape::BodyError>(())
    /// ```
    #[must_use]
    pub fn profile_areas(&self, normal: &UnitVector3<f64>, offset: f64) -> Vec<f64> {
        match &self.form {
            Form::Sphere { diameter } => positive(PI * (0.5 * diameter - offset) * (0.5 * diameter + offset)),
            Form::Ellipsoid { axes } => positive(elliptic::section_area(axes, normal, offset)),
            Form::Mesh(mesh) => mesh_profile_areas(mesh, normal, offset),
        }
    }
}

pub(crate) fn mesh_profile_areas(mesh: &ClosedMesh, normal: &UnitVector3<f64>, offset: f64) -> Vec<f64> {
    let mut slicer = Slicer::new(mesh);
    slicer.turn_to(normal);
    if mesh.is_convex() {
        return positive(slicer.total_area(offset));
    }
    slicer
        .profiles(offset, 0..mesh.triangles().len())
        .iter()
        .map(crate::section::slicer::FlatProfile::area)
        .collect()
}

fn positive(area: f64) -> Vec<f64> {
    if area > 0.0 { vec![area] } else { Vec::new() }
}

fn check_length(what: &'static str, value: f64) -> Result<(), BodyError> {
    if (1e-60..=1e60).contains(&value) {
        Ok(())
    } else {
        Err(BodyError::Length { what, value })
    }
}

fn numbers<const N: usize>(spec: &str, list: &str, expected: &'static str) -> Result<[f64; N], BodyError> {
    let values: Option<Vec<f64>> = list.split(',').map(|word| word.trim().parse().ok()).collect();
    let wrong = || BodyError::Numbers {
        spec: spec.to_owned(),
        expected,
    };
    values.ok_or_else(wrong)?.try_into().map_err(|_| wrong())
}
