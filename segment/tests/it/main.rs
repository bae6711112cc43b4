//! Laws of segmentation on drawn sections whose profiles are known.

mod drawn;
mod files;
mod labels;
mod photos;
