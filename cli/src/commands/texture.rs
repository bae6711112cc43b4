//! `stereology texture`: Heeger-Bergen synthesis.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::{Args, ValueEnum};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, RgbImage};
use ndarray::{Array3, Axis};
use stereology::grid::{Format, VolumeShape, write_atomically, write_volume};
use stereology::pyramid::{
    self, Exemplar, TextureOptions, TextureReport, synthesize_image_with_report, synthesize_oriented_volume,
    synthesize_volume_with_report,
};
use stereology::segment::read_photo;

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::check_file;
use crate::progress::{Step, go_on, stopped};
use crate::values::{Extent, count};
use crate::warnings::Warning;

/// Makes a picture or a volume with the texture of a picture, of any size, that repeats without a seam
///
/// Heeger-Bergen synthesis with a steerable pyramid. --size N or NZ,NY,NX makes a volume every slice of which looks like IMAGE; H,W makes a picture. Good for
/// textures without large forms (stone, sand, paste); particles are the business of `stereology synthesize`.
///
/// Two or three pictures make a volume that looks different along its axes (--mode oriented): the first shows the slices normal to z (rows along y,
/// columns along x), the second those normal to y (rows along z, columns along x), the third those normal to x (rows along z, columns along y); of two, the
/// second stands for y and x. They must be at the same scale.
///
/// Writes u8 colours: .png (picture), .npy, .nrrd, .vti or .tif (volume).
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology texture granite.png --size 128 -o granite.npy")]
pub struct Texture {
    /// Picture of the texture; or two or three, one an axis: normal to z, y, x
    #[arg(value_name = "IMAGE", required = true, num_args = 1..=3)]
    pub images: Vec<PathBuf>,
    /// Samples: N or NZ,NY,NX (volume), H,W (picture)
    #[arg(long, value_name = "N[,N[,N]]")]
    pub size: Extent,
    #[command(flatten)]
    pub choices: Choices,
    /// How a volume is made [default: slices; oriented for two or three pictures]
    #[arg(long, value_enum)]
    pub mode: Option<Mode>,
    /// File for the result; its ending tells the format
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

/// How to synthesise.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Texture")]
#[group(id = "texture-choices")]
pub struct Choices {
    /// Rounds of matching
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = count)]
    pub iterations: usize,
    /// Levels of the pyramid [default: by size]
    #[arg(long, value_name = "L", value_parser = count)]
    pub levels: Option<usize>,
    /// Orientations of the pyramid
    #[arg(long, value_name = "K", default_value_t = 4, value_parser = count)]
    pub orientations: usize,
    /// Which cuts of a volume of mode `slices` look like the picture
    #[arg(long, value_enum, default_value_t = Cuts::All)]
    pub cuts: Cuts,
    /// How values are given another distribution
    #[arg(long, value_enum, default_value_t = Matching::Table)]
    pub matching: Matching,
    /// How the picture's borders are kept out of its statistics
    #[arg(long, value_enum, default_value_t = Edges::PeriodicComponent)]
    pub borders: Edges,
}

/// Which cuts look like the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Cuts {
    /// Cuts in all directions
    All,
    /// Slices along the axes: a third faster
    Axes,
}

/// How values are given another distribution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Matching {
    /// By a table of 4096 bins: fast
    Table,
    /// By rank: exact
    Exact,
}

/// How the picture's borders are kept out of its statistics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Edges {
    /// The picture's periodic component
    PeriodicComponent,
    /// The picture and its mirror images
    Mirror,
    /// Not at all: for pictures that repeat without a seam
    Wrap,
}

/// How a volume is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Mode {
    /// Every slice of the three axes matches the picture
    Slices,
    /// Every slice matches the picture in each direction of its own too; one picture an axis, if given
    Oriented,
    /// The spectrum a slice should show, and corrected band variances: faster
    Spectrum,
    /// The plain method of 1995 and 2004 in three dimensions, whose slices lose contrast
    Volume,
}

impl Mode {
    /// How the volume is made.
    pub fn way(self) -> pyramid::Mode {
        match self {
            Self::Slices => pyramid::Mode::Slices,
            Self::Oriented => pyramid::Mode::Oriented,
            Self::Spectrum => pyramid::Mode::Spectrum,
            Self::Volume => pyramid::Mode::Volume,
        }
    }

    /// Its name.
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
            .with_mode(mode.way())
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

/// What is made.
enum Target {
    Picture([usize; 2]),
    Volume([usize; 3], Format),
}

impl Texture {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let several = self.images.len() > 1;
        let mode = self.mode.unwrap_or(if several { Mode::Oriented } else { Mode::Slices });
        if several && mode != Mode::Oriented {
            return Err(Failure::usage(format!(
                "--mode {} takes one picture: several are for --mode oriented",
                mode.name()
            )));
        }
        let options = self.choices.options(mode, everywhere.seed);
        let target = self.target()?;
        if several && matches!(target, Target::Picture(_)) {
            return Err(Failure::usage(
                "a picture is made from one picture, a volume from up to three",
            ));
        }
        check_file(&self.output, everywhere.force)?;
        let path = &self.images[0];
        let pictures = self
            .images
            .iter()
            .map(|path| read_photo(path).at(path))
            .collect::<Result<Vec<_>, _>>()?;
        let channels = if pictures.iter().all(is_grey) { 1 } else { 3 };
        let samples: Vec<Array3<f32>> = pictures.iter().map(|picture| samples(picture, channels)).collect();
        let exemplars: Vec<Exemplar<'_>> = samples.iter().map(|samples| Exemplar::new(samples.view())).collect();
        let step = Step::begin("texture", everywhere.quiet);
        let said = AtomicUsize::new(0);
        let watch = |done: f64, report: &TextureReport| {
            let rounds = report.band_errors.len();
            if said.swap(rounds, Ordering::Relaxed) < rounds {
                step.say(&round_told(report));
            }
            step.at(done)
        };
        let (shape, report) = match target {
            Target::Picture(size) => {
                let (made, report) = synthesize_image_with_report(&exemplars[0], size, &options, &watch).at(path)?;
                go_on()?;
                write_picture(&self.output, &made)?;
                (made.shape().to_vec(), report)
            }
            Target::Volume(size, format) => {
                let (made, report) = if several {
                    synthesize_oriented_volume(&exemplars, size, &options, &watch)
                } else {
                    synthesize_volume_with_report(&exemplars[0], size, &options, &watch)
                }
                .at(path)?;
                go_on()?;
                let (nz, ny, nx, channels) = made.dim();
                write_volume::<u8>(
                    &self.output,
                    format,
                    VolumeShape { nz, ny, nx, channels },
                    [everywhere.scale; 3],
                    |z, mut slab| {
                        slab.zip_mut_with(&made.index_axis(Axis(0), z), |byte, &value| *byte = stored(value));
                        if stopped() {
                            ControlFlow::Break(())
                        } else {
                            ControlFlow::Continue(())
                        }
                    },
                )
                .at(&self.output)?;
                (made.shape().to_vec(), report)
            }
        };
        let mut answer = Answer::new("texture");
        answer
            .line(format!(
                "{} samples written to {}",
                shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(" x "),
                self.output.display()
            ))
            .line(format!(
                "mode {}, {} rounds, {} levels",
                mode.name(),
                self.choices.iterations,
                report.levels
            ))
            .line(format!(
                "bands off by, before each round: {}",
                listed(&report.band_errors)
            ));
        if !report.slice_errors.is_empty() {
            answer.line(format!(
                "cuts off by, after each round: {}; at the end: {:.4}",
                listed(&report.slice_errors),
                report.final_error
            ));
        }
        answer.line(if report.has_settled() {
            "settled: more rounds would change little"
        } else {
            "not settled: more --iterations may bring the bands nearer"
        });
        answer
            .field("shape", shape)
            .field("mode", mode.name())
            .field("iterations", self.choices.iterations)
            .field("levels", report.levels)
            .field("orientations", self.choices.orientations)
            .field("settled", report.has_settled())
            .field("final_error", report.final_error)
            .field("band_errors", report.band_errors)
            .field("slice_errors", report.slice_errors);
        for finding in &report.findings {
            answer.warn(Warning::new(finding.code, finding.message.clone()));
        }
        Ok(answer)
    }

    fn target(&self) -> Result<Target, Failure> {
        let is_picture = self
            .output
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
        let wrong = |what: &str| {
            Err(Failure::usage(format!(
                "--size and -o {} do not fit: {what}",
                self.output.display()
            )))
        };
        match (&self.size.0[..], is_picture) {
            (&[n], true) => Ok(Target::Picture([n, n])),
            (&[height, width], true) => Ok(Target::Picture([height, width])),
            (&[n], false) => Ok(Target::Volume([n; 3], Format::from_path(&self.output).or_usage("-o")?)),
            (&[nz, ny, nx], false) => Ok(Target::Volume(
                [nz, ny, nx],
                Format::from_path(&self.output).or_usage("-o")?,
            )),
            (&[_, _], false) => wrong("H,W makes a picture, so the file must end in .png"),
            _ => wrong("NZ,NY,NX makes a volume, so the file must end in .npy, .nrrd, .vti, .tif, .h5 or .zarr"),
        }
    }
}

/// The last round, for people who watch.
fn round_told(report: &TextureReport) -> String {
    let rounds = report.band_errors.len();
    let before = report.band_errors.last().copied().unwrap_or_default();
    let after = report.slice_errors.last();
    let after = after.map_or(String::new(), |error| format!(", cuts off by {error:.4} after it"));
    format!("texture round {rounds}: bands off by {before:.4} before it{after}")
}

/// Errors for people.
fn listed(errors: &[f64]) -> String {
    let words: Vec<String> = errors.iter().map(|error| format!("{error:.4}")).collect();
    words.join(" ")
}

fn is_grey(picture: &RgbImage) -> bool {
    picture
        .pixels()
        .all(|pixel| pixel.0[0] == pixel.0[1] && pixel.0[1] == pixel.0[2])
}

/// Values 0 to 1 of a picture (y, x, channel).
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
