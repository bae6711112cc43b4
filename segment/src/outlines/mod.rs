//! Masks of particles: regions above thresholds, and their outlines at half contrast.

pub(crate) mod cores;
pub(crate) mod half_contrast;
pub(crate) mod regions;
