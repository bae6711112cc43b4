//! Periodic packing of particles, with a certificate that none overlap.
//!
//! A material is rebuilt by giving every particle of the recovered size distribution a random place and orientation in a box that repeats in x, y and z,
//! and pushing overlapping ones apart: Jagnow, Dorsey & Rushmeier 2004, section 4.1. Number, sizes and categories never change, so the volume fraction is
//! exactly the one asked for. Spheres, ellipsoids and meshes, convex or not, mix freely; a particle may be larger than half the box.
//!
//! - How deep a pair overlaps is the factor `γ = max n·d / (h_A(n) + h_B(−n))` by which it would have to shrink to part: one maximum, however deep.
//! - [`pack`] minimises the sum of squared depths by descent with momentum, in tens to hundreds of iterations; [`Mode::Paper`] keeps the way of the paper.
//! - [`Packing`] can only be made by [`Packing::verify`], which moves nothing and finds for every pair and every periodic image a direction that separates it.
//!   "No overlap seen while moving" proves nothing: such a run has left overlaps of 8.5 10⁻⁴ diameters. Meshes that are not convex are moved by convex parts
//!   ([`ConvexParts`]) or simpler proxies, and certified by the faces of the mesh itself.
//! - [`radial_distribution`], [`bond_order`], [`orientation_tensor`] and [`section_test`] judge a packing; [`equilibrate`] makes it forget how it was made.
//!
//! # Examples
//!
//! How do I pack a thousand spheres of lognormal sizes to a volume fraction of one half?
//!
//! ```
//! use std::ops::ControlFlow;
//! use stereology_anneal::{PackOptions, box_for_fraction, lognormal_sizes, mix, pack, populate};
//! use stereology_shape::{Arrangement, Body, UnitBody};
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
//! Do the particles of another program overlap?
//!
//! ```
//! use nalgebra::{Point3, UnitQuaternion, Vector3};
//! use stereology_anneal::Packing;
//! use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
//!
//! let cube = UnitBody::new(&Body::cuboid([1.0, 1.0, 1.0])?);
//! let size = cube.body().size(); // of edge 1
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
