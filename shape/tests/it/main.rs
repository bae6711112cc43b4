//! Properties of bodies, meshes and particles, on random and on analytic examples.

#![allow(
    clippy::unwrap_used,
    clippy::float_cmp,
    reason = "a test that cannot go on fails; some results are exact"
)]

mod bodies;
#[cfg(feature = "io")]
mod files;
#[cfg(feature = "io")]
mod glb;
mod meshes;
mod queries;
mod random_shapes;
mod sections;
mod spheres;
#[cfg(feature = "io")]
mod tables;
