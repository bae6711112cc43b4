//! `stereology texture`: Heeger-Bergen synthesis.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::{Args, ValueEnum};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, RgbImage};
use ndarray::{Array3, Axis};
use schemars::JsonSchema;
use serde::Serialize;
use stereology::grid::{Format, VolumeShape, VoxelSize, write_atomically, write_volume};
use stereology::pipeline::{TextureLimits, image_texture_limits, texture_limits};
use stereology::pyramid::{
    self, Exemplar, TextureOptions, TextureReport, Watch, synthesize_image_with_report, synthesize_oriented_volume,
    synthesize_volume_with_report,
};

use crate::answer::{Answer, Fields, Notes};
use crate::commands::measure::ClassifierFields;
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::Output;
use crate::pictures::ImageLimit;
use crate::progress::{Step, go_on};
use crate::signals::stopped;
use crate::values::{Extent, count};
use crate::warnings::Warning;

/// Memory for each pixel of the example image, bytes.
const BYTES_PER_PIXEL: u64 = 150;

/// Synthesises a periodic texture image or volume from an example image
///
/// Heeger-Bergen synthesis with a steerable pyramid. --size N or NZ,NY,NX gives a volume whose slices all look like
/// IMAGE; --size H,W gives an image. The result has any size and repeats without a seam. The method suits textures
/// without large structures (stone, sand, paste); for materials with particles use `stereology synthesize`.
///
/// Two or three images give a volume that looks different along its axes (--mode oriented): the first shows slices
/// normal to z (rows along y, columns along x), the second slices normal to y (rows along z, columns along x), the
/// third slices normal to x (rows along z, columns along y). If there are two, the second is used for y and x. All
/// images must have the same scale.
///
/// Writes u8 colours: .png (image), .npy, .nrrd, .vti, .tif, .h5 or .zarr (volume).
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology texture granite.png --size 128 -o granite.npy")]
pub struct Texture {
    /// Example of the texture; or two or three, one per axis: normal to z, y, x
    #[arg(value_name = "IMAGE", required = true, num_args = 1..=3)]
    pub images: Vec<PathBuf>,
    #[command(flatten)]
    pub limit: ImageLimit,
    /// Size of the result in samples: N or NZ,NY,NX (volume), H,W (image)
    #[arg(long, value_name = "N[,N[,N]]")]
    pub size: Extent,
    #[command(flatten)]
    pub choices: Choices,
    /// How a volume is synthesised [default: slices; oriented for two or three images]
    #[arg(long, value_enum)]
    pub mode: Option<Mode>,
    /// File to write; its extension selects the format
    #[arg(short, long, value_name = "FILE")]
    pub output: Output,
}

/// How to synthesise.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Texture")]
#[group(id = "texture-choices")]
pub struct Choices {
    /// Number of iterations
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = count)]
    pub iterations: usize,
    /// Number of pyramid levels [default: depends on the size]
    #[arg(long, value_name = "L", value_parser = count)]
    pub levels: Option<usize>,
    /// Number of orientations of the pyramid
    #[arg(long, value_name = "K", default_value_t = 4, value_parser = count)]
    pub orientations: usize,
    /// Which sections of a volume match the image, with mode slices
    #[arg(long, value_enum, default_value_t = Cuts::All)]
    pub cuts: Cuts,
    /// How histograms are matched
    #[arg(long, value_enum, default_value_t = Matching::Table)]
    pub matching: Matching,
    /// How the borders of the image are kept out of its statistics
    #[arg(long, value_enum, default_value_t = Edges::PeriodicComponent)]
    pub borders: Edges,
}

/// Which sections match the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Cuts {
    /// Sections in all directions
    All,
    /// Slices along the axes: faster by a third
    Axes,
}

/// How histograms are matched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Matching {
    /// With a table of 4096 bins: fast
    Table,
    /// By rank: exact
    Exact,
}

/// How the borders of the image are kept out of its statistics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Edges {
    /// Use the periodic component of the image
    PeriodicComponent,
    /// Use the image and its mirror images
    Mirror,
    /// No treatment: for images that repeat without a seam
    Wrap,
}

/// How a volume is synthesised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Mode {
    /// Every slice along the three axes matches the image
    Slices,
    /// Every slice also matches the image in each of its own directions; accepts one image per axis
    Oriented,
    /// Matches the spectrum of slices and corrects sub-band variances: faster
    Spectrum,
    /// The method of 1995 and 2004 in three dimensions, whose slices lose contrast
    Volume,
}

impl Mode {
    /// The mode of the library.
    pub fn mode(self) -> pyramid::Mode {
        match self {
            Self::Slices => pyramid::Mode::Slices,
            Self::Oriented => pyramid::Mode::Oriented,
            Self::Spectrum => pyramid::Mode::Spectrum,
            Self::Volume => pyramid::Mode::Volume,
        }
    }

    /// Name of the mode.
    pub fn name(self) -> &'static str {
        match self {
            Self::Slices => "slices",
            Self::Oriented => "oriented",
            Self::Spectrum => "spectrum",
            Self::Volume => "volume",
        }
    }
}

impl Choices {
    /// The options of the synthesis.
    pub fn options(&self, mode: Mode, seed: u64) -> TextureOptions {
        let options = TextureOptions::default()
            .with_mode(mode.mode())
            .with_iterations(self.iterations)
            .with_orientations(self.orientations)
            .with_cuts(match self.cuts {
                Cuts::All => pyramid::Cut::All,
                Cuts::Axes => pyramid::Cut::Axes,
            })
            .with_matching(match self.matching {
                Matching::Table => pyramid::Matching::Table,
                Matching::Exact => pyramid::Matching::Exact,
            })
            .with_edges(match self.borders {
                Edges::PeriodicComponent => pyramid::Edges::PeriodicComponent,
                Edges::Mirror => pyramid::Edges::Mirror,
                Edges::Wrap => pyramid::Edges::Wrap,
            })
            .with_seed(seed);
        match self.levels {
            Some(levels) => options.with_levels(levels),
            None => options,
        }
    }
}

/// What is synthesised.
enum Target {
    Picture([usize; 2]),
    Volume([usize; 3], Format),
}

/// A texture that was written, and what is known about it.
struct Made {
    shape: Vec<usize>,
    report: TextureReport,
    limits: TextureLimits,
}

/// JSON of `stereology texture`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct TextureFields {
    /// Samples along each axis, and channels.
    shape: Vec<usize>,
    /// How the volume was synthesised.
    mode: &'static str,
    /// Number of iterations.
    iterations: usize,
    /// Number of pyramid levels.
    levels: usize,
    /// Number of orientations of the pyramid.
    orientations: usize,
    /// Whether further iterations would change little.
    settled: bool,
    /// Error of the statistics of the sections of the result.
    final_error: f64,
    /// Whether a classifier distinguishes blocks of the slices from blocks of the image; null with fewer
    /// than 8 blocks of 16 pixels on a side.
    classifier: Option<ClassifierFields>,
    /// Error of the sub-band statistics before each iteration.
    band_errors: Vec<f64>,
    /// Error of the statistics of the sections after each iteration; empty for images.
    slice_errors: Vec<f64>,
}

impl Fields for TextureFields {
    const COMMAND: &'static str = "texture";
}

impl Texture {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let several = self.images.len() > 1;
        let mode = self.mode.unwrap_or(if several { Mode::Oriented } else { Mode::Slices });
        if several && mode != Mode::Oriented {
            return Err(Failure::usage(format!(
                "--mode {} takes one image; several images need --mode oriented",
                mode.name()
            )));
        }
        let options = self.choices.options(mode, everywhere.seed);
        let target = self.target()?;
        if several && matches!(target, Target::Picture(_)) {
            return Err(Failure::usage(
                "an image is synthesised from one image, a volume from up to three",
            ));
        }
        let file = match target {
            Target::Picture(_) => everywhere.outputs.file(&self.output)?,
            Target::Volume(_, format) => everywhere.outputs.volume(&self.output, format)?,
        };
        let mut notes = Notes::default();
        let pictures = self
            .images
            .iter()
            .map(|path| self.limit.read(path, BYTES_PER_PIXEL, &mut notes))
            .collect::<Result<Vec<_>, _>>()?;
        let channels = if pictures.iter().all(is_grey) { 1 } else { 3 };
        let samples: Vec<Array3<f32>> = pictures.iter().map(|picture| samples(picture, channels)).collect();
        let step = Step::begin("texture", everywhere.quiet);
        let shown = AtomicUsize::new(0);
        let watch = |done: f64, report: &TextureReport| {
            let iterations = report.band_errors.len();
            if shown.swap(iterations, Ordering::Relaxed) < iterations {
                step.print(&last_iteration(report));
            }
            step.at(done)
        };
        let made = self.synthesize((target, &file), &samples, &options, &watch, everywhere)?;
        self.note(&mut notes, &made, mode);
        let Made { shape, report, limits } = made;
        let fields = TextureFields {
            shape,
            mode: mode.name(),
            iterations: self.choices.iterations,
            levels: report.levels,
            orientations: self.choices.orientations,
            settled: report.has_settled(),
            final_error: report.final_error,
            classifier: limits.blocks.as_ref().map(ClassifierFields::of),
            band_errors: report.band_errors,
            slice_errors: report.slice_errors,
        };
        Answer::new(&fields, notes)
    }

    /// Synthesises and writes the texture.
    fn synthesize(
        &self,
        (target, file): (Target, &Path),
        samples: &[Array3<f32>],
        options: &TextureOptions,
        watch: Watch<'_>,
        everywhere: &Everywhere,
    ) -> Result<Made, Failure> {
        let exemplars: Vec<Exemplar<'_>> = samples.iter().map(|samples| Exemplar::new(samples.view())).collect();
        Ok(match target {
            Target::Picture(size) => {
                let (made, report) =
                    synthesize_image_with_report(&exemplars[0], size, options, watch).at(&self.images[0])?;
                go_on()?;
                write_picture(file, &made)?;
                let limits = image_texture_limits(samples[0].view(), made.view(), everywhere.seed);
                Made {
                    shape: made.shape().to_vec(),
                    report,
                    limits,
                }
            }
            Target::Volume(size, format) => {
                let (made, report) = if exemplars.len() > 1 {
                    synthesize_oriented_volume(&exemplars, size, options, watch)
                } else {
                    synthesize_volume_with_report(&exemplars[0], size, options, watch)
                }
                .at(&self.images[0])?;
                go_on()?;
                let (nz, ny, nx, channels) = made.dim();
                write_volume::<u8>(
                    file,
                    format,
                    VolumeShape { nz, ny, nx, channels },
                    VoxelSize {
                        sides: [everywhere.scale; 3],
                        unit: everywhere.unit,
                    },
                    |z, mut slab| {
                        slab.zip_mut_with(&made.index_axis(Axis(0), z), |byte, &value| *byte = stored(value));
                        if stopped() {
                            ControlFlow::Break(())
                        } else {
                            ControlFlow::Continue(())
                        }
                    },
                )
                .at(file)?;
                let views: Vec<_> = samples.iter().map(|samples| samples.view()).collect();
                let limits = texture_limits(&views, made.view(), report.final_error, everywhere.seed);
                Made {
                    shape: made.shape().to_vec(),
                    report,
                    limits,
                }
            }
        })
    }

    /// What was made, and how well.
    fn note(&self, notes: &mut Notes, made: &Made, mode: Mode) {
        notes
            .line(format!(
                "{} samples written to {}",
                made.shape
                    .iter()
                    .map(ToString::to_string)
                    .collect::<Vec<_>>()
                    .join(" x "),
                self.output.display()
            ))
            .line(format!(
                "mode {}, {} iterations, {} levels",
                mode.name(),
                self.choices.iterations,
                made.report.levels
            ))
            .line(format!(
                "error of the sub-band statistics before each iteration: {}",
                listed(&made.report.band_errors)
            ));
        if !made.report.slice_errors.is_empty() {
            notes.line(format!(
                "error of the section statistics after each iteration: {}; at the end: {:.4}",
                listed(&made.report.slice_errors),
                made.report.final_error
            ));
        }
        notes.line(if made.report.has_settled() {
            "converged: further iterations would change little"
        } else {
            "not converged: more --iterations may reduce the error of the sub-band statistics"
        });
        for finding in &made.report.findings {
            notes.warn(Warning::new(finding.code, finding.message.clone()));
        }
        if let Some(test) = &made.limits.blocks {
            notes.line(format!(
                "classifier: {:.0} % of {} blocks of {} pixels are distinguished from the image's, p {:.3}",
                100.0 * test.accuracy,
                2 * test.blocks,
                test.side,
                test.p_value
            ));
        }
        if let Some(finding) = &made.limits.finding {
            notes.warn(finding.clone());
        }
    }

    fn target(&self) -> Result<Target, Failure> {
        let is_picture = self
            .output
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
        let wrong = |what: &str| {
            Err(Failure::usage(format!(
                "--size does not fit -o {}: {what}",
                self.output.display()
            )))
        };
        match (&self.size.0[..], is_picture) {
            (&[n], true) => Ok(Target::Picture([n, n])),
            (&[height, width], true) => Ok(Target::Picture([height, width])),
            (&[n], false) => Ok(Target::Volume(
                [n; 3],
                Format::from_path(self.output.name()).or_usage("-o")?,
            )),
            (&[nz, ny, nx], false) => Ok(Target::Volume(
                [nz, ny, nx],
                Format::from_path(self.output.name()).or_usage("-o")?,
            )),
            (&[_, _], false) => wrong("H,W gives an image, so the file must end in .png"),
            _ => wrong("NZ,NY,NX gives a volume, so the file must end in .npy, .nrrd, .vti, .tif, .h5 or .zarr"),
        }
    }
}

/// Errors of the last iteration, shown with the progress.
fn last_iteration(report: &TextureReport) -> String {
    let iterations = report.band_errors.len();
    let before = report.band_errors.last().copied().unwrap_or_default();
    let after = report.slice_errors.last();
    let after = after.map_or(String::new(), |error| {
        format!(", of the section statistics after it {error:.4}")
    });
    format!("iteration {iterations}: error of the sub-band statistics before it {before:.4}{after}")
}

/// A list of errors as text.
fn listed(errors: &[f64]) -> String {
    let words: Vec<String> = errors.iter().map(|error| format!("{error:.4}")).collect();
    words.join(" ")
}

fn is_grey(picture: &RgbImage) -> bool {
    picture
        .pixels()
        .all(|pixel| pixel.0[0] == pixel.0[1] && pixel.0[1] == pixel.0[2])
}

/// Values 0 to 1 of an image (y, x, channel).
fn samples(picture: &RgbImage, channels: usize) -> Array3<f32> {
    Array3::from_shape_fn(
        (picture.height() as usize, picture.width() as usize, channels),
        |(y, x, channel)| f32::from(picture.get_pixel(x as u32, y as u32).0[channel]) / 255.0,
    )
}

fn stored(value: f32) -> u8 {
    (value * 255.0).round().clamp(0.0, 255.0) as u8
}

fn write_picture(path: &Path, made: &Array3<f32>) -> Result<(), Failure> {
    let (height, width, channels) = made.dim();
    let bytes: Vec<u8> = made.iter().map(|&value| stored(value)).collect();
    let colour = if channels == 1 {
        ExtendedColorType::L8
    } else {
        ExtendedColorType::Rgb8
    };
    write_atomically(path, |out| {
        PngEncoder::new(out)
            .write_image(&bytes, width as u32, height as u32, colour)
            .map_err(std::io::Error::other)
    })
    .at(path)
}
