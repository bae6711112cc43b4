//! Laws of the transforms, judged by the sum that defines them.
#![allow(
    clippy::cast_possible_truncation,
    clippy::float_cmp,
    reason = "tests make small numbers and compare exact ones"
)]

mod laws;
