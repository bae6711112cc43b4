//! The composed chain, against the sample whose solid is known and against analytic spheres.

#![allow(
    clippy::unwrap_used,
    clippy::float_cmp,
    clippy::cast_possible_truncation,
    reason = "tests: a failed step is a failed test, equal means equal"
)]

mod comparisons;
mod files;
mod finishing;
mod sample;
mod size_error;
mod spheres;
