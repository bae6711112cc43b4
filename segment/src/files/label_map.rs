//! Label maps in files: one number per profile, 0 for the binder; or outlines of the profiles.

use std::{
    io::{self, BufReader, Cursor},
    path::Path,
};

use ndarray::{Array2, ArrayView2};
use serde_json::Value;
use stereology_grid::write_atomically;

use crate::error::SegmentError;
use crate::files::coco;
use crate::files::geojson;
use crate::files::imagej_roi;
use crate::files::label_raster::{dimensions, ending, narrow, parse_npy, parse_png, parse_tiff, write_npy, write_tiff};
use crate::files::photo::read_bytes;
use crate::labels::outline::{Outline, fill_outlines, outlines};
use stereology_metrics::Finding;

/// A label map from a file, and findings on how it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelFile {
    /// Axes (y, x); 0 is the binder.
    pub labels: Array2<u32>,
    /// `first-page`, `overlapping-labels`, `lost-labels`.
    pub findings: Vec<Finding>,
}

/// Reads a label map for a photo of `size` pixels, (height, width), whatever tool made it; the format is recognised by
/// the contents.
///
/// | file | from | |
/// |---|---|---|
/// | TIFF, 1 to 64 bits | ImageGrains, StarDist, Cellpose, ImageJ, napari | stored numbers, never inverted for display; floats if whole; first page |
/// | PNG, 1 to 16 bits, grey or palette | Cellpose, VOC | stored numbers or palette indices |
/// | .npy | NumPy, Cellpose | whole numbers of any kind, two axes |
/// | GeoJSON polygons | segmenteverygrain, QGIS | x column, y row, pixel centres at whole numbers; where all y ≤ 0, QGIS's: y up, pixel corners at whole numbers |
/// | ImageJ regions, .zip or .roi | Fiji's ROI manager, StarDist | polygons, rectangles, ovals, paths; points and lines are left out |
/// | COCO annotations | labelling tools, networks | polygons and run-length masks of the one image of the photo's size |
///
/// # Errors
///
/// The file cannot be opened or is damaged; its numbers are not labels; it contains pickled objects; outlines extend
/// beyond the photo. Label arrays of another size are refused by [`crate::Segmentation::from_labels`].
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
    read(path.as_ref(), Some(size))
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
    Ok(read(path.as_ref(), None)?.labels)
}

fn read(path: &Path, size: Option<(usize, usize)>) -> Result<LabelFile, SegmentError> {
    let bytes = read_bytes(path)?;
    let refuse = |reason: String| SegmentError::LabelFormat {
        path: path.into(),
        reason,
    };
    let plain = |labels| LabelFile {
        labels,
        findings: Vec::new(),
    };
    let starts = |start: &[u8]| bytes.starts_with(start);
    if [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"]
        .iter()
        .any(|magic| starts(*magic))
    {
        let (labels, findings) = parse_tiff(&bytes).map_err(refuse)?;
        return Ok(LabelFile { labels, findings });
    }
    if starts(b"\x89PNG") {
        return Ok(plain(parse_png(&bytes).map_err(refuse)?));
    }
    if starts(b"\x93NUMPY") {
        return Ok(plain(parse_npy(&bytes).map_err(refuse)?));
    }
    if starts(b"\x80") {
        return Err(refuse("it is a pickled Python object, which may run code when read; save the label array itself as TIFF, PNG or .npy".into()));
    }
    let zipped = starts(b"PK");
    let text = bytes
        .iter()
        .find(|b| !b.is_ascii_whitespace() && !b"\xef\xbb\xbf".contains(b));
    if !zipped && !starts(imagej_roi::MAGIC) && text != Some(&b'{') {
        return Err(refuse("its first bytes are of no known kind of label file; give a TIFF, a PNG, a .npy array, GeoJSON or COCO polygons, or an ImageJ ROI zip".into()));
    }
    let size = size
        .ok_or_else(|| refuse("a file of outlines does not state the photo's size; give the photo as well".into()))?;
    let mut without_area = 0;
    let found = if zipped {
        let (found, lines) = imagej_roi::parse_archive(&bytes).map_err(refuse)?;
        without_area = lines;
        found
    } else if starts(imagej_roi::MAGIC) {
        let components = imagej_roi::parse(&bytes).map_err(refuse)?;
        let outline = components.map(|components| Outline { id: 1, components });
        outline.into_iter().collect()
    } else {
        let start = bytes.iter().position(|b| *b == b'{').unwrap_or(0);
        let json: Value = serde_json::from_reader(BufReader::new(&bytes[start..]))
            .map_err(|e| refuse(format!("is not JSON ({e})")))?;
        if json.get("annotations").is_some() {
            coco::parse(&json, size).map_err(refuse)?
        } else {
            geojson::parse(&json).map_err(refuse)?
        }
    };
    drawn(&found, without_area, size).map_err(refuse)
}

/// Label map of outlines, with findings on overlaps and losses.
fn drawn(found: &[Outline], without_area: usize, (height, width): (usize, usize)) -> Result<LabelFile, String> {
    let corners = || found.iter().flat_map(|o| o.components.iter().flatten().flatten());
    let beyond = corners()
        .find(|c| !(c[0] >= -2.0 && c[1] >= -2.0 && c[0] <= width as f64 + 2.0 && c[1] <= height as f64 + 2.0));
    if let Some([x, y]) = beyond {
        return Err(format!(
            "an outline extends to x = {x}, y = {y}, but the photo is {width}x{height} pixels; export outlines in pixels of this photo, not rotated, cropped or in map units"
        ));
    }
    let (labels, overlap) = fill_outlines(found, (height, width));
    let mut findings = Vec::new();
    if overlap > 0 {
        findings.push(Finding::new(
            "overlapping-labels",
            format!("{overlap} pixels lie in more than one outline; they were assigned to the smaller one"),
        ));
    }
    let drawn = crate::labels::profile::distinct(&labels).len();
    let lost = found.len() - drawn + without_area;
    if lost > 0 {
        findings.push(Finding::new("lost-labels", format!("{lost} of {} outlines contain no pixel centre of their own (points, lines, slivers, or covered by others) and are left out", found.len() + without_area)));
    }
    Ok(LabelFile { labels, findings })
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
