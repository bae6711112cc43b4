//! Laws of the measures, on materials whose statistics are known.
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::float_cmp,
    reason = "random numbers of tests are small"
)]

mod boolean_models;
