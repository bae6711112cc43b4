//! Section laws against closed forms, identities and the brute-force slicer.
#![allow(clippy::unwrap_used, reason = "tests stop at the first surprise")]

mod brute_force;
mod closed_forms;
mod energies;
mod identities;
mod meshes;
mod paper;
mod random_meshes;
