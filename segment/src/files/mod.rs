//! Photographs, label maps and images of a segmentation in files.

mod coco;
pub(crate) mod compression;
mod geojson;
mod imagej_roi;
pub(crate) mod images;
pub(crate) mod label_map;
mod label_raster;
pub(crate) mod photo;
