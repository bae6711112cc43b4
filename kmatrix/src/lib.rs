//! Stereological kernels: what profile sizes does a random section through a particle of each size give?
//!
//! The probability that a plane cuts a particle is proportional to its mean caliper diameter. The profile is anything
//! between a point and the largest section. For a body of any shape one function describes this, the [`SectionLaw`]:
//!
//! ```text
//! F(x) = ⟨profiles with √(A / A_max) ≤ x⟩ / ⟨profiles⟩        ⟨·⟩ = (1/4π) ∫ over directions, ∫ over offsets
//! N_A  = H_eff K N_V,   K[i][j] = (j/n) (F(i/j) − F((i−1)/j))   H_eff = ⟨profiles⟩
//! ```
//!
//! Spheres and ellipsoids have closed forms. For a closed mesh and one direction the section area is a piecewise
//! quadratic function of the offset, so the length of the offsets with a profile of each size is exact. Only the mean
//! over directions is estimated. Its standard error comes from random rotations of a lattice of directions.
//!
//! # A kernel for unfolding
//!
//! ```
//! use stereology_kmatrix::{SectionLaw, SectionOptions, Sizes};
//! use stereology_kmatrix::shape::Body;
//!
//! let law = SectionLaw::of_body(&Body::rock(7), &SectionOptions::default().with_directions(1024))?;
//! let edges: Vec<f64> = (0..=10).map(f64::from).collect();
//! let kernel = law.kernel(&edges, &edges, Sizes::Integrated)?; // profiles per unit area of one particle per unit volume
//! assert!(kernel.column(9).sum() > kernel.column(0).sum()); // large particles are cut more often
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # How many profiles does a section of a torus have?
//!
//! ```
//! use stereology_kmatrix::{SectionLaw, SectionOptions};
//! use stereology_kmatrix::shape::{Body, ClosedMesh, TriangleMesh};
//!
//! let torus = ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.5, 32, 16))?;
//! let law = SectionLaw::of_body(&Body::from_mesh(torus), &SectionOptions::default().with_directions(256))?;
//! assert!(law.profiles_per_hit() > 1.5 && law.profiles_per_hit() < 1.7);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Why not Monte Carlo
//!
//! The paper needs 100,000 random sections for an error of 0.5 %. Its method is available as
//! [`SectionLaw::monte_carlo`], with polygons or with the paper's stencil buffer, and is the reference for the sweep in
//! the tests. The sweep reaches 0.01 % for 1,280 triangles in 0.5 s on one core. The paper also ignores that a plane
//! that hits a non-convex body shows more than one profile ([`Counting::Paper`]): 1.4 to 1.5 for a torus. Number
//! densities are then too large by that factor.

mod contour_area;
mod contours;
mod depth_measure;
mod directions;
mod distribution;
mod ellipsoid;
mod exact;
mod kernel;
mod monte_carlo;
mod plane;
mod raster;
mod saltikov;
mod sample;
mod section_law;
mod sweep;

/// The linear algebra of matrices and vectors in this crate's signatures.
pub use nalgebra;
/// The bodies whose kernels these are.
pub use stereology_shape as shape;

pub use exact::{Effort, SectionLawError, SectionOptions};
pub use kernel::{Counting, Sizes};
pub use monte_carlo::{LargestArea, MonteCarloOptions, Residual, Slicing};
pub use saltikov::{BinCountError, SphereKernel, condition_number, geometric_classes, profiles_per_area, scale};
pub use section_law::SectionLaw;
pub use stereology_metrics::{EdgesError, Progress};
