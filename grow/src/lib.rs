//! Stone grown around measurements: the voxels of a closed mesh are filled outwards from seeds, each with the centre of
//! a window of an exemplar that is similar to what its own window contains so far.
//!
//! ```text
//! texel = one at random of those with d ≤ (1 + tolerance) min d                   (Efros & Leung 1999)
//! d = Σ w (voxel − texel)² / Σ w     sums over the known voxels of the window
//! w: normal weights of standard deviation side / 6.4
//! order: the voxels nearest to their own seed first, so that each seed's cell is its Voronoi cell
//!                                                                (Stone et al. 2014, section 4.1.1)
//! ```
//!
//! Windows lie in random planes through the voxel, turned or mirrored at random. Measured voxels keep their values to
//! the bit. Voxels whose windows do not contain each other are filled at the same time, by a schedule that gives the
//! same solid as filling one by one; a tree of the exemplar's patches replaces the comparison with every window, which
//! is the reference ([`Search::Exact`]).
//!
//! # Examples
//!
//! A block grown around one measurement:
//!
//! ```
//! use ndarray::Array3;
//! use std::ops::ControlFlow;
//! use stereology_grow::{GrowOptions, grow};
//!
//! let stone = Array3::from_shape_fn((32, 32, 1), |(y, x, _)| ((x / 3 + y / 5) % 4) as f32);
//! let block = Array3::from_elem((8, 8, 8), true);
//! let measured = [([4, 4, 4], vec![7.0])];
//! let grown = grow(block.view(), stone.view(), &measured, &GrowOptions::default(), &|_| ControlFlow::Continue(()))?;
//! assert_eq!((grown.inside, grown.filled, grown.fixed_changed, grown.cells), (512, 512, 0, 1));
//! assert_eq!(grown.values[[4, 4, 4, 0]], 7.0);
//! # Ok::<(), stereology_grow::GrowError>(())
//! ```
//!
//! The voxels of a mesh:
//!
//! ```
//! use stereology_grow::Voxels;
//! use stereology_shape::{ClosedMesh, TriangleMesh};
//!
//! let brick = ClosedMesh::try_from(TriangleMesh::cuboid([4.0, 2.0, 1.0]))?;
//! assert_eq!(Voxels::of_mesh(&brick, 8)?.inside.dim(), (2, 4, 8));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod exemplar;
mod filling;
mod flood_fill;
mod growth;
mod image;
mod neighbours;
mod numbers;
mod options;
mod patch_tree;
mod planes;
mod resolutions;
mod schedule;
mod search;
mod seeds;
mod voxels;

pub use error::GrowError;
pub use flood_fill::{FloodFill, flood_fill};
pub use growth::{Grown, grow};
pub use image::grow_image;
pub use options::GrowOptions;
pub use planes::Planes;
pub use resolutions::{LevelOptions, synthesize_by_levels};
pub use search::Search;
pub use stereology_metrics::Progress;
pub use voxels::Voxels;
