//! Solids from one picture, without separable particles.
