//! Particle shapes: measures, plane sections, queries and positions in a periodic box.
//!
//! A body is a closed triangle mesh, a sphere or an ellipsoid. This crate computes what stereology needs of it:
//!
//! - volume V, surface S and the mean width H = (1/4π) Σ edge length × angle: a plane cuts N_A = H N_V particles per
//!   unit area, where N_V is their number per unit volume;
//! - its `size`: the equivalent circular diameter √(4 A / π) of its largest section of area A, found by maximisation;
//! - the profiles of a section: disjoint outlines with their holes; a section of one particle may have several;
//! - as a [`UnitBody`] (centroid at the origin, size 1): point tests, support points and signed distances in
//!   nanoseconds;
//! - as a [`Particle`]: scaled, rotated and moved, world = position + size · R u, in a [`PeriodicBox`]. An
//!   [`Arrangement`] holds particles that have been checked.
//!
//! Decisions that rounding could change (which side of a plane, inside or outside) use exact signs of determinants.
//! Measures are sums in double precision. [`ClosedMesh::repairs`] lists every repair of a mesh.
//!
//! # Examples
//!
//! What are the mean caliper diameter of a brick and the size of its largest section?
//!
//! ```
//! use stereology_shape::Body;
//!
//! let brick = Body::cuboid([10.0, 20.0, 5.0])?;
//! assert!((brick.mean_width() - 17.5).abs() < 1e-9);
//! assert!((brick.size() - (4.0 * 20.0 * 125.0_f64.sqrt() / std::f64::consts::PI).sqrt()).abs() < 1e-6);
//! # Ok::<(), stereology_shape::BodyError>(())
//! ```
//!
//! Is a point of a material inside this rotated rock?
//!
//! ```
//! use nalgebra::Point3;
//! use rand::SeedableRng;
//! use stereology_shape::{Body, Particle, UnitBody, isotropic_rotation};
//!
//! let rock = UnitBody::new(&Body::rock(1));
//! let orientation = isotropic_rotation(&mut rand_chacha::ChaCha8Rng::seed_from_u64(0));
//! let particle = Particle { shape: 0, size: 3.0, category: 0, position: Point3::new(5.0, 5.0, 5.0), orientation };
//! assert!(rock.contains(&particle.to_local(&Point3::new(5.2, 5.0, 4.9))));
//! assert!(!rock.contains(&particle.to_local(&Point3::new(9.0, 5.0, 5.0))));
//! ```

mod arrangement;
mod body;
#[cfg(feature = "io")]
mod file;
mod generate;
mod mesh;
mod particle;
mod periodic_box;
mod query;
mod section;
mod unit_body;

pub use arrangement::{Arrangement, ArrangementError};
pub use body::{Body, BodyError, BodyKind};
#[cfg(feature = "io")]
pub use file::coloured_mesh_file::write_coloured_mesh;
#[cfg(feature = "io")]
pub use file::mesh_file::{MeshFormat, read_mesh, write_mesh};
#[cfg(feature = "io")]
pub use file::mesh_file_error::{MeshFileError, MeshFileFault, MeshFilePlace};
#[cfg(feature = "io")]
pub use file::point_file::{parse_points, read_points};
#[cfg(feature = "io")]
pub use file::table::{
    Column, ColumnUnit, DecimalMark, Separator, Table, TableError, TableRow, TableSource, TextEncoding,
};
#[cfg(feature = "io")]
pub use file::textured_mesh_file::write_textured_mesh;
pub use generate::control_sphere::{ControlSphere, ControlSphereError};
pub use mesh::closed_mesh::ClosedMesh;
pub use mesh::coloured_mesh::ColouredMesh;
pub use mesh::corner_normals::corner_normals;
pub use mesh::hull::convex_hull;
pub use mesh::mesh_error::{MeshError, Repair};
pub use mesh::quickhull::HullError;
pub use mesh::self_intersection::self_intersections;
pub use mesh::subdivision::Subdivision;
pub use mesh::textured_mesh::{Texture, TexturedMesh};
pub use mesh::triangle_mesh::TriangleMesh;
pub use particle::{Particle, isotropic_rotation};
pub use periodic_box::{BoxError, PeriodicBox};
pub use query::chord::{Chord, Chords};
pub use query::inside::InsideTest;
pub use section::section_areas::{Knots, SectionAreas};
pub use section::slicer::{SectionPolygon, section_polygons};
pub use unit_body::UnitBody;
