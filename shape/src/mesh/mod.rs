//! Triangle meshes: any triangles, and those that enclose a solid.

pub(crate) mod closed_mesh;
pub(crate) mod coloured_mesh;
pub(crate) mod corner_normals;
pub(crate) mod hull;
pub(crate) mod index;
pub(crate) mod measures;
pub(crate) mod mesh_error;
pub(crate) mod near_points;
pub(crate) mod quickhull;
pub(crate) mod self_intersection;
pub(crate) mod subdivision;
pub(crate) mod textured_mesh;
pub(crate) mod topology;
pub(crate) mod triangle_mesh;
pub(crate) mod winding;
