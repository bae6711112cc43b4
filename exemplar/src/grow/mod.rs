//! Stone grown around measurements: voxels of a closed mesh filled outwards from seeds, each chosen like a pixel of an exemplar whose surroundings look like what is already there.

mod error;
mod finish;
mod flood_fill;
mod growth;
mod patch_tree;
mod picture;
mod planes;
mod resolutions;
mod schedule;
mod voxels;

pub use error::GrowError;
pub use finish::finish;
pub use flood_fill::{FloodFill, flood_fill};
pub use growth::{GrowOptions, Grown, grow};
pub use patch_tree::Search;
pub use picture::grow_picture;
pub use planes::Planes;
pub use resolutions::{LevelOptions, synthesize_by_levels};
pub use voxels::{Voxels, connected_areas};
