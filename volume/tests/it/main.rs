//! Properties of solids, tested against analytic spheres and brute force.
#![allow(clippy::float_cmp, reason = "what must be the same is the same to the last bit")]
#![expect(clippy::unwrap_used, reason = "a failing test panics")]

mod atlas;
mod bad_input;
mod carve;
mod colours;
mod points;
mod sections;
mod spheres;
mod voids;
mod voxels;
