//! Laws of growth.
#![expect(clippy::unwrap_used, reason = "a failing test panics")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::float_cmp,
    reason = "random numbers of tests are small, copied values are equal"
)]

mod growth;
