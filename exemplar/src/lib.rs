//! Solids from one picture, without separable particles.

pub mod grow;
pub mod measure;
