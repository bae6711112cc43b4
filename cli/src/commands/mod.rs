//! The commands, one module each.

pub mod assemble;
pub mod carve;
pub mod contact;
pub mod displace;
pub mod exemplar;
pub mod explore;
pub mod export;
pub mod grow;
pub mod kmatrix;
pub mod measure;
pub mod pack;
mod pack_quality;
pub mod pyramid;
pub mod render;
pub mod schema;
pub mod segment;
pub mod shape;
pub mod slice;
mod solid_files;
mod synthesis_verdict;
pub mod synthesize;
pub mod texture;
pub mod unfold;
