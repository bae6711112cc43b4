//! Solids from one picture, without separable particles.
//!
//! # How like are a solid's slices to its picture?
//!
//! [`measure`] judges any solid, however it was made: grey levels, directions, fringes, two-point correlation, lineal path, local porosity, patches, sharpness, each beside its floor.
//!
//! # Stone around measurements
//!
//! [`grow`] fills a closed mesh outwards from measured voxels, each like a pixel of the picture whose surroundings look like what is there already.

pub mod grow;
pub mod measure;
