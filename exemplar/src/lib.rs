//! Solids from one picture, without separable particles.

pub mod measure;
