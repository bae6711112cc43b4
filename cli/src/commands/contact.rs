//! `stereology contact`: contact distributions from images, volumes, formulas and files.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use ndarray::{Array2, Array3, ArrayD, Ix3};
use schemars::JsonSchema;
use serde::Serialize;
use stereology::grid::read_npy;
use stereology::imaging::otsu;
use stereology::microgeometry::{self, ContactDistribution, EstimateOptions, Law, contact_of_image, contact_of_volume};
use stereology::segment::{LabelFile, read_label_file};

use crate::answer::{Answer, Fields, Notes};
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::{Output, write_text};
use crate::pictures::{ImageLimit, warn};
use crate::values::{bins, not_negative, positive};

/// Memory for each pixel of an image, bytes.
const BYTES_PER_PIXEL: u64 = 60;

/// Measures the spherical contact distribution of two regions: the distances of their points to the interface between
/// them
///
/// `stereology displace` gives meshes a relief with this distribution. IMAGE is an image whose light pixels are the
/// positive region and whose dark pixels are the negative region, separated by Otsu's threshold unless --threshold is
/// given. It can also be a volume (.npy, axes z, y, x: pores and material), a label map (--labels), or a contact
/// distribution to edit (.json). Without IMAGE the distribution follows from formulas (--negative-law, --positive-law):
/// uniform:R, disc:R, exponential:S, rayleigh:S, boolean:R,LAMBDA, bell:MEAN,DEVIATION.
///
/// Distances are measured from the interface, which runs half way between pixels, and are corrected for the part that
/// the border of the image hides. --counting paper measures as Schroeder et al. 2005: from pixel to pixel, in whole
/// pixels, without a correction at the border.
#[derive(Args, Debug)]
#[command(
    after_long_help = "Examples: stereology contact gravel.png -o contact.json\n          stereology contact --negative-law exponential:2 --positive-law disc:6 --share 0.4 -o cells.json\n          stereology contact gravel.png --edit 5=0 --edit -1=0.2 -o edited.json"
)]
pub struct Contact {
    /// Image, volume (.npy), label map, or contact distribution (.json)
    #[arg(value_name = "IMAGE", required_unless_present = "positive_law")]
    pub image: Option<PathBuf>,
    #[command(flatten)]
    pub limit: ImageLimit,
    /// Grey value, 0 to 255; pixels above it are positive [default: Otsu's threshold]
    #[arg(long, value_name = "T", value_parser = threshold)]
    pub threshold: Option<f64>,
    /// IMAGE is a label map: all labels but 0 are positive
    #[arg(long, conflicts_with = "threshold")]
    pub labels: bool,
    /// Number of bins of the region with the largest distance [default: one per pixel]
    #[arg(long, value_name = "N", value_parser = bins)]
    pub bins: Option<usize>,
    /// Side of a pixel, in units of the distribution
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = positive)]
    pub pixel_size: f64,
    /// How distances are measured
    #[arg(long, value_enum, default_value_t = Counting::Interface)]
    pub counting: Counting,
    /// Swap the positive and the negative region
    #[arg(long)]
    pub invert: bool,
    /// Set the fraction of a bin, before all are normalised: bins 0, 1, ... are the positive region, -1, -2, ... the
    /// negative; may be repeated
    #[arg(long, value_name = "BIN=FRACTION", value_parser = edit, allow_hyphen_values = true)]
    pub edit: Vec<(i64, f64)>,
    /// Distribution of distances in the negative region, without IMAGE
    #[arg(long, value_name = "LAW", requires = "positive_law", conflicts_with = "image")]
    pub negative_law: Option<Law>,
    /// Distribution of distances in the positive region, without IMAGE
    #[arg(long, value_name = "LAW", requires = "negative_law", conflicts_with = "image")]
    pub positive_law: Option<Law>,
    /// Fraction of the positive region, with --negative-law and --positive-law
    #[arg(long, value_name = "PHI", default_value_t = 0.5, value_parser = crate::values::share)]
    pub share: f64,
    /// File for the distribution (.json)
    #[arg(short, long, value_name = "FILE")]
    pub output: Output,
}

/// How distances are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Counting {
    /// From the interface, corrected for the part hidden by the border
    Interface,
    /// From the interface, without correction: for images of a whole structure
    Seen,
    /// From pixel to pixel, in whole pixels, as in the paper
    Paper,
}

fn threshold(text: &str) -> Result<f64, String> {
    not_negative(text)
        .ok()
        .filter(|t| *t < 255.0)
        .ok_or_else(|| "a grey value from 0 to below 255 is needed".to_owned())
}

fn edit(text: &str) -> Result<(i64, f64), String> {
    let parts = text.split_once('=');
    let parsed = parts.and_then(|(bin, share)| Some((bin.trim().parse().ok()?, not_negative(share).ok()?)));
    parsed.ok_or_else(|| "a bin and its fraction are needed, such as 3=0.1 or -1=0".to_owned())
}

/// A distribution and how it was measured.
struct Source {
    of: ContactDistribution,
    threshold: Option<f64>,
    pixels: Option<usize>,
}

/// JSON of `stereology contact`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ContactFields {
    /// Width of a bin, in units of the distribution.
    bin_width: f64,
    /// Fraction of points in each bin of the negative region, from the interface outwards.
    negative: Vec<f64>,
    /// Fraction of points in each bin of the positive region, from the interface outwards.
    positive: Vec<f64>,
    /// Fraction of the positive region.
    positive_share: f64,
    /// Grey value above which pixels are positive; null if no threshold was used.
    threshold: Option<f64>,
    /// Pixels or voxels measured; null if nothing was measured.
    pixels: Option<usize>,
}

impl Fields for ContactFields {
    const COMMAND: &'static str = "contact";
}

impl Contact {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let file = everywhere.outputs.file(&self.output)?;
        let mut notes = Notes::default();
        let Source { of, threshold, pixels } = match (&self.image, self.negative_law, self.positive_law) {
            (Some(image), ..) => self.measure(image, &mut notes)?,
            (None, Some(negative), Some(positive)) => Source {
                of: ContactDistribution::from_laws(self.pixel_size, negative, positive, self.share)
                    .or_usage("--negative-law, --positive-law")?,
                threshold: None,
                pixels: None,
            },
            _ => return Err(Failure::usage("give an IMAGE, or --negative-law and --positive-law")),
        };
        let of = if self.invert { of.inverted() } else { of };
        let of = self
            .edit
            .iter()
            .try_fold(of, |of, &(bin, share)| of.edited(bin, share))
            .or_usage("--edit")?;
        write_text(&file, &of.to_json())?;
        notes.line(format!(
            "positive region {:.1} %, distances up to {:.4}; negative region {:.1} %, up to {:.4} -> {}",
            100.0 * of.positive_share(),
            of.positive().len() as f64 * of.bin_width(),
            100.0 - 100.0 * of.positive_share(),
            of.negative().len() as f64 * of.bin_width(),
            self.output.display()
        ));
        if let Some(threshold) = threshold {
            notes.line(format!("grey values above {threshold} are positive"));
        }
        let fields = ContactFields {
            bin_width: of.bin_width(),
            negative: of.negative().to_vec(),
            positive: of.positive().to_vec(),
            positive_share: of.positive_share(),
            threshold,
            pixels,
        };
        Answer::new(&fields, notes)
    }

    fn measure(&self, image: &Path, notes: &mut Notes) -> Result<Source, Failure> {
        let options = EstimateOptions {
            counting: match self.counting {
                Counting::Interface => microgeometry::Counting::Interface,
                Counting::Seen => microgeometry::Counting::InterfaceSeen,
                Counting::Paper => microgeometry::Counting::Paper,
            },
            pixel_size: self.pixel_size,
            bins: self.bins,
        };
        let ends_in = |ending: &str| image.extension().is_some_and(|of| of.eq_ignore_ascii_case(ending));
        if ends_in("json") {
            return Ok(Source {
                of: read_contact(image)?,
                threshold: None,
                pixels: None,
            });
        }
        if self.labels {
            let LabelFile {
                labels: map, findings, ..
            } = read_label_file(image).at(image)?;
            warn(notes, findings, image);
            let of = contact_of_image(map.mapv(|label| label != 0).view(), &options).at(image)?;
            return Ok(Source {
                of,
                threshold: None,
                pixels: Some(map.len()),
            });
        }
        if ends_in("npy") {
            let grey = volume(image)?;
            let threshold = self.threshold_for(grey.iter().copied(), image)?;
            let of = contact_of_volume(grey.mapv(|v| f64::from(v) > threshold).view(), &options).at(image)?;
            return Ok(Source {
                of,
                threshold: Some(threshold),
                pixels: Some(grey.len()),
            });
        }
        let photo = self.limit.read(image, BYTES_PER_PIXEL, notes)?;
        let grey = Array2::from_shape_fn((photo.height() as usize, photo.width() as usize), |(y, x)| {
            let [r, g, b] = photo.get_pixel(x as u32, y as u32).0.map(f64::from);
            (0.299 * r + 0.587 * g + 0.114 * b).round() as u8
        });
        let threshold = self.threshold_for(grey.iter().copied(), image)?;
        let of = contact_of_image(grey.mapv(|v| f64::from(v) > threshold).view(), &options).at(image)?;
        Ok(Source {
            of,
            threshold: Some(threshold),
            pixels: Some(grey.len()),
        })
    }

    fn threshold_for(&self, values: impl Iterator<Item = u8>, image: &Path) -> Result<f64, Failure> {
        match self.threshold {
            Some(threshold) => Ok(threshold),
            None => {
                let mut counts = [0_u64; 256];
                values.for_each(|level| counts[usize::from(level)] += 1);
                otsu(&counts)
                    .ok_or("all pixels have the same grey value, so there are no two regions")
                    .at(image)
            }
        }
    }
}

/// Reads a contact distribution.
pub fn read_contact(path: &Path) -> Result<ContactDistribution, Failure> {
    let text = std::fs::read_to_string(path).at(path)?;
    ContactDistribution::from_json(&text).at(path)
}

/// Grey values of a volume: u8 unchanged, floating point scaled from its least to its greatest value.
fn volume(path: &Path) -> Result<Array3<u8>, Failure> {
    let three = |n: usize| format!("has {n} axes; a volume has three: z, y, x");
    let grey: ArrayD<u8> = match read_npy::<u8>(path) {
        Ok(grey) => grey,
        Err(error) => match read_npy::<f32>(path) {
            Ok(values) => {
                let finite = || values.iter().copied().filter(|v| v.is_finite());
                let (low, high) = (finite().fold(f32::MAX, f32::min), finite().fold(f32::MIN, f32::max));
                values.mapv(|v| ((v - low) / (high - low) * 255.0).clamp(0.0, 255.0) as u8)
            }
            Err(_) => return Err(error).at(path),
        },
    };
    let axes = grey.ndim();
    grey.into_dimensionality::<Ix3>().map_err(|_| three(axes)).at(path)
}
