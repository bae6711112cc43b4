//! Label maps in files: one number per profile, 0 for the binder; or outlines of the profiles.

use std::{
    io::{self, Cursor},
    path::Path,
};

use image::ImageFormat;
use image::metadata::Orientation;
use ndarray::{Array2, ArrayView2};
use serde_json::Value;
use stereology_grid::write_atomically;

use crate::error::SegmentError;
use crate::files::drawn::Drawing;
use crate::files::label_raster::{
    dimensions, ending, narrow, parse_image, parse_npy, parse_tiff, write_npy, write_tiff,
};
use crate::files::photo::read_bytes;
use crate::files::tiff::is_tiff;
use crate::files::{coco, geojson, imagej_roi, labelme, via};
use crate::labels::outline::outlines;
use stereology_metrics::Finding;

/// A label map from a file, and findings on how it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelFile {
    /// Axes (y, x); 0 is the binder.
    pub labels: Array2<u32>,
    /// Of arrays: `first-page`, `main-page`, `binder-numbers`, `binder-colour`, `colour-labels`, `labels-turned`,
    /// `exif-orientation`. Of outlines: `overlapping-labels`, `lost-labels`, `clipped-outlines`, `other-slices`.
    pub findings: Vec<Finding>,
    /// How the file says that its array is turned to be upright; not applied.
    pub(crate) orientation: Orientation,
}

/// Reads a label map for a photo of `size` pixels, (height, width), whatever tool made it; the format is recognised by
/// the contents.
///
/// | file | from | |
/// |---|---|---|
/// | TIFF, 1 to 64 bits | ImageGrains, StarDist, Cellpose, ImageJ, napari, OpenCV | stored numbers, never inverted for display; floats if whole; NaN, and watershed's -1 and 1, are the binder; the page of the photo's size |
/// | PNG, 1 to 16 bits, grey or palette | Cellpose, VOC | stored numbers or palette indices |
/// | TIFF, PNG, BMP, GIF, WebP in colours | COCO panoptic, Segment Anything | one colour is one label; black and the transparent are the binder |
/// | .npy | NumPy, Cellpose | whole numbers of any kind, two axes |
/// | GeoJSON polygons: collections, lists, one feature per line | segmenteverygrain, QGIS, QuPath | x column, y row, pixel centres at whole numbers; where all y ≤ 0, QGIS's: y up, pixel corners at whole numbers, as QuPath's |
/// | ImageJ regions, .zip or .roi | Fiji's ROI manager, StarDist | polygons, rectangles, ovals, paths; of one slice; points and lines are left out |
/// | COCO annotations | labelling tools, networks | polygons and run-length masks of the image of the photo's size |
/// | LabelMe, VIA | the tools of these names | polygons, rectangles, circles, ellipses, masks |
///
/// # Errors
///
/// The file cannot be opened or is damaged; its numbers are not labels; it contains pickled objects; many outlines lie
/// outside the photo; an image is neither of the photo's size nor turned by a quarter.
///
/// # Examples
///
/// ```
/// use ndarray::array;
/// use stereology_segment::{read_labels_for, write_labels};
///
/// # let folder = tempfile::tempdir()?;
/// let labels = array![[0, 1, 1], [0, 0, 70_000_u32]];
/// for name in ["l.tif", "l.npy", "l.geojson", "l.zip", "l.json"] {
///     let file = folder.path().join(name);
///     write_labels(&file, labels.view())?;
///     assert_eq!(read_labels_for(&file, labels.dim())?.labels, labels);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_labels_for(path: impl AsRef<Path>, size: (usize, usize)) -> Result<LabelFile, SegmentError> {
    read(path.as_ref(), Some(size), None)
}

/// Reads a label map whose file states its size, with findings on how it was read; otherwise as [`read_labels`].
///
/// # Errors
///
/// As [`read_labels`].
///
/// # Examples
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// let file = folder.path().join("labels.png");
/// image::RgbImage::from_fn(4, 3, |x, _| image::Rgb([0, 90, 7].map(|v| if x > 1 { v } else { 0 }))).save(&file)?;
/// assert_eq!(stereology_segment::read_label_file(&file)?.findings[0].code, "colour-labels");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_label_file(path: impl AsRef<Path>) -> Result<LabelFile, SegmentError> {
    read(path.as_ref(), None, None)
}

/// Reads a label map whose file states its size, axes (y, x), 0 the binder: TIFF, PNG or .npy. See [`read_labels_for`],
/// which reads outlines too and returns findings.
///
/// # Errors
///
/// As [`read_labels_for`]; and for files of outlines, which do not state the photo's size.
///
/// # Examples
///
/// ```
/// use ndarray::array;
/// use stereology_segment::{read_labels, write_labels};
///
/// # let folder = tempfile::tempdir()?;
/// let file = folder.path().join("labels.png");
/// let labels = array![[0, 1, 1], [0, 0, 65_535_u32]];
/// write_labels(&file, labels.view())?;
/// assert_eq!(read_labels(&file)?, labels);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_labels(path: impl AsRef<Path>) -> Result<Array2<u32>, SegmentError> {
    Ok(read(path.as_ref(), None, None)?.labels)
}

/// Reads a label file for a photo of a size, (height, width), and a file name, as far as they are known.
pub(crate) fn read(path: &Path, size: Option<(usize, usize)>, name: Option<&str>) -> Result<LabelFile, SegmentError> {
    let bytes = read_bytes(path)?;
    parse(&bytes, size, name).map_err(|reason| SegmentError::LabelFormat {
        path: path.into(),
        reason,
    })
}

/// The labels that the bytes of a file stand for.
pub(crate) fn parse(bytes: &[u8], size: Option<(usize, usize)>, name: Option<&str>) -> Result<LabelFile, String> {
    let starts = |start: &[u8]| bytes.starts_with(start);
    let raster = if is_tiff(bytes) {
        Some(parse_tiff(bytes, size)?)
    } else if starts(b"\x93NUMPY") {
        Some(parse_npy(bytes)?)
    } else {
        match image::guess_format(bytes) {
            Ok(ImageFormat::Jpeg) => {
                return Err("it is a JPEG, which changes numbers and colours when it is saved; export the labels as PNG, TIFF or .npy".into());
            }
            Ok(ImageFormat::Png | ImageFormat::Bmp | ImageFormat::Gif | ImageFormat::WebP) => {
                Some(parse_image(bytes, size)?)
            }
            _ => None,
        }
    };
    if let Some(raster) = raster {
        return Ok(LabelFile {
            labels: raster.labels,
            findings: raster.findings,
            orientation: raster.orientation,
        });
    }
    if starts(b"\x80") {
        return Err("it is a pickled Python object, which may run code when read; save the label array itself as TIFF, PNG or .npy".into());
    }
    let drawing = |size: Option<(usize, usize)>| -> Result<(Drawing, (usize, usize)), String> {
        let size = size.ok_or("a file of outlines does not state the photo's size; give the photo as well")?;
        if starts(b"PK") {
            return Ok((imagej_roi::parse_archive(bytes)?, size));
        }
        if starts(imagej_roi::MAGIC) {
            return Ok((imagej_roi::parse_file(bytes)?, size));
        }
        Ok((parse_json(bytes, size, name)?, size))
    };
    let first = bytes
        .iter()
        .find(|b| !b.is_ascii_whitespace() && !b"\xef\xbb\xbf".contains(b));
    if !starts(b"PK") && !starts(imagej_roi::MAGIC) && !matches!(first, Some(b'{' | b'[' | 0x1e)) {
        return Err("its first bytes are of no known kind of label file; give a TIFF, a PNG, a .npy array, polygons of GeoJSON, COCO, LabelMe or VIA, or an ImageJ ROI zip".into());
    }
    let (drawing, size) = drawing(size)?;
    let (labels, findings) = drawing.filled(size)?;
    Ok(LabelFile {
        labels,
        findings,
        orientation: Orientation::NoTransforms,
    })
}

/// Outlines of JSON: COCO, LabelMe, VIA, or GeoJSON, which may have one feature per line.
fn parse_json(bytes: &[u8], size: (usize, usize), name: Option<&str>) -> Result<Drawing, String> {
    // A mark of the byte order, and the separators of GeoJSON's sequences, are no JSON.
    let start = bytes.iter().position(|b| matches!(b, b'{' | b'[')).unwrap_or(0);
    let mut text = bytes[start..].to_vec();
    text.iter_mut().filter(|b| **b == 0x1e).for_each(|b| *b = b' ');
    let values = serde_json::Deserializer::from_slice(&text).into_iter();
    let values: Vec<Value> = values
        .collect::<Result<_, _>>()
        .map_err(|e| format!("is not JSON ({e})"))?;
    let Some(json) = values.first() else {
        return Err("is not JSON".into());
    };
    let results = json
        .as_array()
        .is_some_and(|list| list.iter().any(|a| a.get("segmentation").is_some()));
    if json.get("annotations").is_some_and(Value::is_array) || results {
        return coco::parse(json, size, name);
    }
    if json.get("shapes").is_some() {
        return labelme::parse(json, size);
    }
    match via::pictures(json) {
        Some(pictures) => via::parse(&pictures, name),
        None => geojson::parse(&values),
    }
}

/// Writes a label map in the format of the file name's extension: .tif or .tiff (u16 where the largest label fits, else
/// u32), .png (u16), .npy (u32), .geojson, .zip (ImageJ regions), .json (COCO); the file appears whole or not at all.
///
/// # Errors
///
/// The file cannot be written; another extension; a label beyond 65,535 for a PNG, or a map beyond 32,767 pixels for
/// ImageJ's regions.
///
/// # Examples
///
/// See [`read_labels_for`].
pub fn write_labels(path: impl AsRef<Path>, labels: ArrayView2<'_, u32>) -> Result<(), SegmentError> {
    let path = path.as_ref();
    let refuse = |reason: &str| {
        Err(SegmentError::LabelFormat {
            path: path.into(),
            reason: reason.into(),
        })
    };
    let (height, width) = labels.dim();
    let rings = || outlines(&labels.to_owned());
    match ending(path).as_str() {
        "tif" | "tiff" => write_atomically(path, |out| write_tiff(out, labels).map_err(io::Error::other))?,
        "png" => {
            let Some(samples) = narrow(labels) else {
                return refuse("a PNG stores labels up to 65,535, and there are larger ones; write a TIFF or a .npy");
            };
            let (w, h) = dimensions((height, width));
            let Some(image) = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(w, h, samples) else {
                return refuse("the map is too large for a PNG");
            };
            let mut bytes = Cursor::new(Vec::new());
            let encoded = image.write_to(&mut bytes, image::ImageFormat::Png);
            write_atomically(path, |out| {
                encoded.map_err(io::Error::other)?;
                io::Write::write_all(out, bytes.get_ref())
            })?;
        }
        "npy" => write_atomically(path, |out| write_npy(out, labels))?,
        "geojson" => write_atomically(path, |out| geojson::write(out, &rings()))?,
        "json" => write_atomically(path, |out| coco::write(out, &rings(), (height, width)))?,
        "zip" if height.max(width) > 32_767 => {
            return refuse("ImageJ's regions extend to at most 32,767 pixels; write a TIFF");
        }
        "zip" => write_atomically(path, |out| imagej_roi::write(out, &rings()))?,
        _ => return refuse("the extension is none of .tif, .png, .npy, .geojson, .json (COCO), .zip (ImageJ regions)"),
    }
    Ok(())
}
