//! Periodic packing of particles, with a certificate that none overlap.
//!
//! A material is rebuilt by giving every particle of the recovered size distribution a random position and orientation
//! in a box that is periodic in x, y and z, and pushing overlapping particles apart: Jagnow, Dorsey & Rushmeier 2004,
//! section 4.1. Number, sizes and categories never change, so the volume fraction is exactly the requested one.
//! Spheres, ellipsoids and meshes, convex or not, can be mixed; a particle may be larger than half the box.
//!
//! - The overlap of a pair is measured by the factor `γ = max n·d / (h_A(n) + h_B(−n))` to which both would have to
//!   shrink to separate. It has a single maximum however deep the overlap is.
//! - [`pack`] minimises the sum of squared depths by gradient descent with momentum, in tens to hundreds of iterations.
//!   [`Mode::Paper`] is the method of the paper.
//! - A [`Packing`] can only be created by [`Packing::verify`], which moves nothing and finds a separating direction for
//!   every pair and every periodic image. Finding no overlap while moving proves nothing: such a run left overlaps of
//!   8.5 10⁻⁴ diameters. Meshes that are not convex are moved as convex parts ([`ConvexParts`]) or simpler proxies, and
//!   certified by the faces of the mesh itself.
//! - [`radial_distribution`], [`bond_order`], [`orientation_tensor`] and [`section_test`] characterise a packing;
//!   [`equilibrate`] brings it to equilibrium, so that it no longer depends on how it was packed.
//!
//! # Examples
//!
//! Pack a thousand spheres of lognormal sizes to a volume fraction of one half:
//!
//! ```
//! use std::ops::ControlFlow;
//! use stereology_anneal::{PackOptions, box_for_fraction, lognormal_sizes, mix, pack, populate};
//! use stereology_anneal::shape::{Arrangement, Body, UnitBody};
//!
//! let bodies = [UnitBody::new(&Body::sphere(1.0)?)];
//! let grains = mix(&lognormal_sizes(1000, 0.3, 0)?, &[1.0], 0)?;
//! let period = box_for_fraction(&bodies, &grains, 0.5)?;
//! let start = Arrangement::new(bodies, populate(&grains, &period, 0), period)?;
//! let packing = pack(&start, &PackOptions::default(), &|_| ControlFlow::Continue(()))?;
//! assert!((packing.fraction() - 0.5).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Check whether the particles of another program overlap:
//!
//! ```
//! use stereology_anneal::Packing;
//! use stereology_anneal::nalgebra::{Point3, UnitQuaternion, Vector3};
//! use stereology_anneal::shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
//!
//! let cube = UnitBody::new(&Body::cuboid([1.0, 1.0, 1.0])?);
//! let size = cube.body().size(); // edge length 1
//! let at = |x, y, z| Particle { shape: 0, size, category: 0, position: Point3::new(x, y, z), orientation: UnitQuaternion::identity() };
//! // Eight cubes that fill a box of side 2 touch everywhere and overlap nowhere.
//! let corners: Vec<_> = (0..8).map(|k| at(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2))).collect();
//! let packing = Packing::verify(&Arrangement::new([cube], corners, PeriodicBox::new(Vector3::repeat(2.0))?)?)?;
//! assert!((packing.fraction() - 1.0).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod annealing;
mod assembly;
mod certificate;
mod contacts;
mod conversions;
mod convex_parts;
mod damped;
mod densities;
mod density_limit;
mod difference;
mod equilibrium;
mod gauge;
mod neighbours;
mod occupancy;
mod one_by_one;
mod options;
mod order;
mod pack;
mod paper;
mod periodic_cells;
mod population;
mod proxies;
mod radial;
mod section_test;
mod separating_axis;
mod sequential;
mod surfaces;

/// The linear algebra of points, vectors and rotations in this crate's signatures.
pub use nalgebra;
/// The bodies and particles that are packed.
pub use stereology_shape as shape;

pub use certificate::{Certificate, Overlap, Overlaps, Packing, overlaps};
pub use convex_parts::ConvexParts;
pub use densities::{SizeDensities, SizeInBin, counts_from_densities, grains_from_densities};
pub use density_limit::density_limit;
pub use equilibrium::equilibrate;
pub use options::{Mode, PackOptions};
pub use order::{BondOrder, OrientationTensor, bond_order, orientation_tensor};
pub use pack::{Jam, PackError, Unresolved, pack};
pub use population::{
    Grain, PopulationError, box_for_fraction, count_to_fill, lognormal_sizes, mix, populate, scale_to_fraction,
    total_volume,
};
pub use proxies::Proxy;
pub use radial::{Distance, RadialDistribution, carnahan_starling, radial_distribution};
pub use section_test::{SectionTest, section_test};
