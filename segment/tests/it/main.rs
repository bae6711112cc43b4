//! Laws of segmentation on drawn sections whose profiles are known.

#![allow(
    clippy::cast_possible_truncation,
    reason = "drawn pictures have small sizes and levels"
)]
#![allow(clippy::float_cmp, reason = "the same arithmetic gives the same bits")]
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod drawn;
mod files;
mod labels;
mod photos;
