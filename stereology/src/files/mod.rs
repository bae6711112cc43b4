//! Files of profiles, densities, packings and solids: one module per format, with its `write` and its `read`.
//!
//! Lengths are in the unit of the run, colours are sRGB-encoded values / 255. Files hold neither times nor paths. Every
//! file is written completely or not at all, and numbers are read back bit for bit. Tables are read by
//! [`shape::Table`](crate::shape::Table), whatever their separator, encoding or decimal mark.
//!
//! | module | file | content |
//! |---|---|---|
//! | [`profiles`] | `profiles.csv` | a table of profiles |
//! | [`table_head`] | the first lines of a table | area, threshold, unit and edge rule of its rows |
//! | [`densities`] | `densities.csv` | particles per volume by size bin, type and category |
//! | [`packing`] | `packing.json` | particles in a periodic box |
//! | [`steps`] | `steps.json` | finished steps, for another run |
//! | [`solid`] | a folder | a packing with its colours and its residual |
//! | [`texture_source`] | `texture.npy` or a volume | the texture of an assembled solid |
//! | [`residual`] | `texture.npy` | the residual volume of a solid |
//! | [`colour_table`] | CSV | colours of particles |
//! | [`particle_table`] | CSV | particles, one per row |
//! | [`xyz`] | extended XYZ | particles and box, for OVITO |
//! | [`vtp`] | VTK poly data | particles as points, for ParaView |
//! | [`size_columns`] | | columns of a table of profiles that contradict each other |
//! | [`voxel_table`] | CSV | values at single voxels or points |

mod delimited;
mod error;
mod json;
mod labels;
mod profile_columns;

pub mod colour_table;
pub mod densities;
pub mod packing;
pub mod particle_table;
pub mod profiles;
pub mod residual;
pub mod size_columns;
pub mod solid;
pub mod steps;
pub mod table_head;
pub mod texture_source;
pub mod voxel_table;
pub mod vtp;
pub mod xyz;

pub use delimited::ReadTable;
pub use error::FileError;
