//! Mesh and point files, and delimited text.

pub(crate) mod coloured_mesh_file;
pub(crate) mod glb;
pub(crate) mod mesh_file;
pub(crate) mod mesh_file_error;
pub(crate) mod obj;
pub(crate) mod ply;
pub(crate) mod point_file;
pub(crate) mod polygon;
pub(crate) mod stl;
pub(crate) mod table;
pub(crate) mod textured_mesh_file;
