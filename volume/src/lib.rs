//! The solid texture: particles, colours and residual, evaluated at any point; slices, sections, voxels.
//!
//! A [`Solid`] is reconstructed from a photograph of a cut: particles packed in a periodic box, each with the mean
//! colour of a profile, a binder with the mean colour of the rest, and a residual that adds fine detail (Jagnow, Dorsey
//! & Rushmeier 2004, section 4):
//!
//! ```text
//! colour(p) = mean of the particle at p + residual of particles(p)      or      binder + residual of binder(p)
//! ```
//!
//! with p taken modulo the sides of the box and the residual modulo its own period, which divides them. The arithmetic
//! is on sRGB-encoded values / 255 and values are clamped only when they are written as bytes.
//!
//! A grid of cells finds the particle at a point in some 100 ns: each cell lists the particle images that reach into
//! it, and a cell entirely inside a particle stores that particle. Distances are Euclidean. Sections are exact profiles
//! ([`Solid::section_profiles`]) or images ([`Solid::slice`]); voxels are written to files slab by slab
//! ([`Solid::write_voxels`]). Meshes get the solid's colours at their vertices ([`Solid::carve`]) or in a texture
//! ([`Solid::bake`]).
//!
//! # What does a cut through a packing look like?
//!
//! ```
//! use nalgebra::{Point3, UnitQuaternion, Vector3};
//! use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
//! use stereology_volume::{Axis, SlicePlane, Solid};
//!
//! let rock = UnitBody::new(&Body::rock(1));
//! let at = |x, y, z| Particle {
//!     shape: 0, size: 3.0, category: 0, position: Point3::new(x, y, z), orientation: UnitQuaternion::identity(),
//! };
//! let particles = vec![at(2.0, 2.0, 2.0), at(6.0, 6.0, 3.0)];
//! let colours = vec![[0.7, 0.3, 0.2], [0.2, 0.3, 0.7]];
//! let period = PeriodicBox::new(Vector3::repeat(8.0))?;
//! let solid = Solid::new(Arrangement::new(vec![rock], particles, period)?, colours, [0.8, 0.8, 0.75], None)?;
//!
//! let image = solid.slice(&SlicePlane::across(Axis::Z, 2.5), 200, 200, 8.0 / 200.0)?;
//! assert_eq!(image.get_pixel(50, 50).0, [179, 77, 51]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What is the volume fraction of particles, measured on sections?
//!
//! ```
//! # use nalgebra::{Point3, UnitQuaternion, Vector3};
//! # use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
//! # use stereology_volume::{Axis, Solid};
//! # let sphere = UnitBody::new(&Body::sphere(1.0)?);
//! # let particle = Particle { shape: 0, size: 3.0, category: 0, position: Point3::origin(), orientation: UnitQuaternion::identity() };
//! # let period = PeriodicBox::new(Vector3::repeat(8.0))?;
//! # let solid = Solid::new(Arrangement::new(vec![sphere], vec![particle], period)?, vec![[0.5; 3]], [0.5; 3], None)?;
//! let depths = (0..1000).map(|i| (f64::from(i) + 0.5) * 8.0 / 1000.0);
//! let areas: f64 = depths.flat_map(|z| solid.section_profiles(Axis::Z, z)).map(|(_, area)| area).sum();
//! let area_fraction = areas / (1000.0 * 8.0 * 8.0);
//! let volume_fraction = std::f64::consts::PI / 6.0 * 27.0 / 512.0;
//! assert!((area_fraction - volume_fraction).abs() < 1e-6); // Delesse: V_V = A_A
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Rejected alternatives
//!
//! A voxel volume as the representation of the solid fixes the resolution, and its sections have steps. A tree of
//! particles is slower than the grid of cells for packings, whose particles fill space evenly. Plain trilinear
//! interpolation of the residual keeps only an eighth of the variance of white noise between voxels, see [`Lookup`].

mod atlas;
mod autocovariance;
mod carve;
mod carve_error;
mod cells;
mod charts;
mod colour;
mod images;
mod narrow;
mod residual;
mod residual_row;
mod row;
mod row_colours;
mod sections;
mod slice;
mod solid;
mod solid_error;
mod strip;
mod turned;
mod voids;
mod voxels;

pub use atlas::{BakeOptions, Baked};
pub use carve::{CarveOptions, Carved};
pub use carve_error::CarveError;
pub use residual::{Lookup, Residual};
pub use sections::Axis;
pub use slice::SlicePlane;
pub use solid::Solid;
pub use solid_error::SolidError;
pub use stereology_metrics::Progress;
pub use turned::turned;
pub use voxels::{Channel, ChannelError, VoxelGrid};
