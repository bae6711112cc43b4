//! Photographs, label maps and images of a segmentation in files.

mod coco;
mod colour_labels;
mod colour_profile;
pub(crate) mod compression;
pub(crate) mod decoding;
mod drawn;
mod geojson;
mod imagej_roi;
pub(crate) mod images;
pub(crate) mod label_map;
pub(crate) mod label_raster;
mod labelme;
pub(crate) mod photo;
mod photo_labels;
mod picture;
mod tiff;
mod value_range;
mod via;
