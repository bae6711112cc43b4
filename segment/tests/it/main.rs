//! Laws of segmentation on synthetic test images whose profiles are known.

#![allow(
    clippy::cast_possible_truncation,
    reason = "synthetic test images have small sizes and levels"
)]
#![allow(clippy::float_cmp, reason = "the same arithmetic gives the same bits")]
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod drawn;
mod files;
mod label_kinds;
mod labels;
mod made_files;
mod mutations;
mod photos;
mod pictures;
mod scales;
