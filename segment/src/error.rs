//! Errors of reading, segmenting and writing.

use std::path::PathBuf;

/// Why a photograph or a label map could not be read, segmented or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SegmentError {
    /// The file cannot be opened.
    #[error("{}: cannot be opened ({source}); check the path and the permissions", path.display())]
    Open {
        /// File as given.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file holds no bytes.
    #[error("{}: the file is empty; give a PNG, JPEG, TIFF, WebP, BMP or GIF", path.display())]
    EmptyFile {
        /// File as given.
        path: PathBuf,
    },
    /// The file is not an image of a known format, or is truncated.
    #[error("{}: not a readable image ({reason}); give a complete PNG, JPEG, TIFF, WebP, BMP or GIF", path.display())]
    Decode {
        /// File as given.
        path: PathBuf,
        /// Error of the decoder.
        reason: String,
    },
    /// Too few pixels to hold particles and a binder.
    #[error(
        "the photo is {width} x {height} pixels; at least 16 x 16 are needed to distinguish particles from a binder"
    )]
    TooSmall {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// More pixels than are allowed.
    #[error(
        "the photo is {width} x {height} pixels, more than {most}; it would take about {gigabytes} gigabytes of memory: allow more pixels, or crop or shrink the photo"
    )]
    TooLarge {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Pixels allowed.
        most: u64,
        /// Memory that segmenting it would take.
        gigabytes: f64,
    },
    /// Every pixel has the same colour.
    #[error(
        "the photo has a single colour, {colour:?}; there is nothing to segment: check that the right file was exported"
    )]
    SingleColour {
        /// That colour.
        colour: [u8; 3],
    },
    /// Nothing differs clearly from the binder.
    #[error(
        "no particle of at least {min_area} pixels differs clearly from the binder; give the binder's colour, lower the minimum area, or import a label map drawn by hand or by another tool"
    )]
    NoParticles {
        /// Requested minimum area, pixels.
        min_area: usize,
    },
    /// The label map does not fit the photo.
    #[error(
        "the label map is {}x{} pixels, the photo {}x{}; export the labels at the photo's size, not rotated or cropped",
        labels[0], labels[1], photo[0], photo[1]
    )]
    LabelSize {
        /// Width and height of the label map.
        labels: [usize; 2],
        /// Width and height of the photo.
        photo: [usize; 2],
    },
    /// The label map has no label but 0.
    #[error("the label map contains no profile: every pixel is 0, which is the binder")]
    NoLabels,
    /// The label map holds classes, not profiles.
    #[error(
        "the label map contains only the values {values} besides 0, in {components} connected components: a mask of classes (binder and particle; or binder, inside, edge), not a number for each profile; export the label image \
         instead (segmenteverygrain: the GeoJSON or the instance labels; ImageJ: Analyze Particles, Count Masks; scikit-image: measure.label)"
    )]
    ClassMask {
        /// The values.
        values: String,
        /// Their number of connected components.
        components: usize,
    },
    /// The label file cannot be read as labels, or written.
    #[error("{}: {reason}", path.display())]
    LabelFormat {
        /// File as given.
        path: PathBuf,
        /// What was found.
        reason: String,
    },
    /// An option is out of range.
    #[error("{option} = {value}: {requirement}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Value given.
        value: f64,
        /// What it must be.
        requirement: &'static str,
    },
    /// An edge rule that needs more than a photo shows.
    #[error(
        "the edge rule {rule} needs the whole size of profiles that the photo's edge cuts; use associated-point, miles-lantuejoul, or all"
    )]
    EdgeRule {
        /// Name of the rule.
        rule: &'static str,
    },
    /// A file could not be written.
    #[error(transparent)]
    Write(#[from] stereology_grid::GridError),
    /// The progress function asked to stop.
    #[error("cancelled")]
    Cancelled,
}
