//! Laws of the pyramids, of matching and of synthesis.
#![allow(
    clippy::cast_possible_truncation,
    clippy::float_cmp,
    reason = "tests use small numbers and compare exact ones"
)]

mod colours;
mod matching;
mod pyramid;
mod space;
mod spheres;
mod synthesis;
