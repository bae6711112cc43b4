//! Bodies from numbers: primitives, rocks, superellipsoids, control points.

pub(crate) mod control_sphere;
pub(crate) mod primitives;
pub(crate) mod rock;
pub(crate) mod spherical_harmonics;
pub(crate) mod superellipsoid;
