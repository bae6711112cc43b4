//! How the points of a phase are arranged: two-point correlation, lineal path, chord lengths, local porosity.

mod lineal_path;
mod local_porosity;
mod minkowski;
mod two_point;

pub use lineal_path::{Chords, chord_lengths, lineal_path};
pub use local_porosity::local_porosity;
pub use minkowski::{PlanarFunctionals, SpatialFunctionals, planar_functionals, spatial_functionals};
pub use two_point::{radial_mean, two_point};
