//! Section laws against closed forms, identities and the brute-force slicer.

mod brute_force;
mod identities;
mod meshes;
