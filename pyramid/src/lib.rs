//! Steerable pyramid, histogram matching, and Heeger-Bergen texture synthesis in 2D and 3D.
mod bank;
mod filters;
mod steerable;

pub use steerable::{BandSummary, Bands, PyramidError, SteerablePyramid};
