//! Laws of the transforms, tested against the sum that defines them.
#![allow(
    clippy::cast_possible_truncation,
    clippy::float_cmp,
    reason = "tests use small numbers and compare exact ones"
)]

mod laws;
