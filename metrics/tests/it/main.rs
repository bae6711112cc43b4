//! Laws of the measures, on materials whose statistics are known.
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::float_cmp,
    clippy::unwrap_used,
    reason = "random numbers of tests are small"
)]

mod block_tests;
mod bodies;
mod boolean_models;
