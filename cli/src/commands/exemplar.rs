//! `stereology exemplar`: a solid from an image of a material without separate particles.

mod given;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use image::RgbImage;
use ndarray::{Array2, Array3, Axis};
use schemars::JsonSchema;
use serde::Serialize;
use stereology::exemplar::{self, Domain, Exemplar as Picture, Solid, SolidError, SolidOptions, synthesize_solid};
use stereology::grid::{Element, Format, VolumeShape, VoxelSize, write_volume};

use crate::answer::{Answer, Fields, Notes};
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::Output;
use crate::pictures::ImageLimit;
use crate::progress::{Step, go_on};
use crate::signals::stopped;
use crate::values::{Extent, bytes, count, positive};
use stereology_report::significant;

/// Memory for each pixel of an image, bytes.
const BYTES_PER_PIXEL: u64 = 60;

/// Synthesises a solid whose slices look like an image, for materials without separate particles
///
/// For example laminar carbons, wood, sediments, porous rock and gravel. Rows of the first IMAGE run along z and its
/// columns along x: it shows slices of constant y. A second IMAGE (or the first one) shows slices of constant x, with
/// rows along z and columns along y. With --views 3 a third IMAGE (or the last one) shows slices of constant z, with
/// rows along y and columns along x. For layered materials use --views 2 and an image with horizontal layers. All
/// images must have the same scale, which is also the scale of the solid.
///
/// The solid repeats without a seam unless --open is given. An image with exactly two grey levels is taken as a map of
/// two phases, and the solid has exactly their fractions (--kind picture prevents this). The methods wei-levoy, kopf
/// and chen-wang follow Urs et al. 2012, voxel by voxel along --scan; best is our own method. Measure the similarity of
/// the result with `stereology measure`.
#[derive(Args, Debug)]
#[command(
    after_long_help = "Example: stereology exemplar fringes.png --views 2 --size 128 -o carbon.npy\n         stereology measure fringes.png carbon.npy --slices xz,yz"
)]
pub struct Exemplar {
    /// Image of the material; or two or three, one per axis: slices of constant y, x, z
    #[arg(value_name = "IMAGE", required = true, num_args = 1..=3)]
    pub images: Vec<PathBuf>,
    #[command(flatten)]
    pub limit: ImageLimit,
    /// Number of voxels: N or NZ,NY,NX
    #[arg(long, value_name = "N[,N,N]")]
    pub size: Extent,
    /// Synthesis method
    #[arg(long, value_enum, default_value_t = Method::Best)]
    pub method: Method,
    /// Order in which the sequential solver visits voxels
    #[arg(long, value_enum, default_value_t = Scan::Hilbert)]
    pub scan: Scan,
    /// 2: slices of constant y and x look like the images (layers); 3: slices of constant z too [default: 3; with two
    /// or three images, their number]
    #[arg(long, value_name = "N", value_parser = views)]
    pub views: Option<exemplar::Views>,
    /// Whether voxels are updated one after the other or all at once [default: batch for best, otherwise sequential]
    #[arg(long, value_enum)]
    pub solver: Option<Solver>,
    /// How the most similar neighbourhood of the image is found
    #[arg(long, value_enum, default_value_t = Search::KCoherence)]
    pub search: Search,
    /// Number of resolution levels, each half as fine as the one before [default: depends on the size of the image's
    /// features]
    #[arg(long, value_name = "L", value_parser = count)]
    pub levels: Option<usize>,
    /// Side of the neighbourhood in pixels, odd
    #[arg(long, value_name = "PIXELS", default_value_t = 7)]
    pub neighbourhood: usize,
    /// Compare only voxels visited before (causal neighbourhood; sequential solver)
    #[arg(long)]
    pub causal: bool,
    /// Iterations per level
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = count)]
    pub iterations: usize,
    /// Number of similar pixels stored for each pixel, for k-coherence [default: 12 for best, 15 for chen-wang,
    /// otherwise 4]
    #[arg(long, value_name = "K", value_parser = count)]
    pub similar: Option<usize>,
    /// Meaning of the image's values
    #[arg(long, value_enum, default_value_t = Kind::Auto)]
    pub kind: Kind,
    /// Make a solid that does not repeat: opposite faces are independent
    #[arg(long)]
    pub open: bool,
    /// Voxels with fixed values: rows of x, y, z (voxel indices from 0) and the value, or r, g, b (0 to 255)
    #[arg(long, value_name = "CSV")]
    pub fixed: Option<PathBuf>,
    /// Closed mesh (fitted into the box), SHAPE, or .npy (z, y, x; not 0 inside); voxels outside stay 0
    #[arg(long, value_name = "MESH|NPY")]
    pub mask: Option<PathBuf>,
    /// Refuse solids that need more memory than this, in bytes times 2^30
    #[arg(long, value_name = "GIB", default_value_t = 4.0, value_parser = positive)]
    pub memory: f64,
    /// Also write the pixel from which each voxel was copied, u32, row x width + column, counted through all images;
    /// 4294967295 outside the mask
    #[arg(long, value_name = "FILE")]
    pub sources: Option<Output>,
    /// File for the solid: .npy, .nrrd, .vti, .tif, .h5 or .zarr
    #[arg(short, long, value_name = "FILE")]
    pub output: Output,
}

/// Synthesis method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// All voxels at once, each a copy of a pixel, with all pixels used evenly
    Best,
    /// Mean of the best matches, which loses contrast
    WeiLevoy,
    /// Weighted mean with colour histogram matching
    Kopf,
    /// A copied pixel, with position and index histogram matching
    ChenWang,
}

/// Order of the voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Scan {
    /// x fastest, then y, then z
    Lexicographic,
    /// Random order
    Random,
    /// Morton order (Z-curve)
    Morton,
    /// Hilbert curve, from neighbour to neighbour
    Hilbert,
}

/// How voxels are updated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Solver {
    /// One after the other; each voxel uses the new values of those before
    Sequential,
    /// All voxels are compared before any is written
    Batch,
}

/// How similar neighbourhoods are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Search {
    /// Exhaustive search: slow
    Exact,
    /// Tree-structured vector quantisation
    Tsvq,
    /// Candidates that continue the matches of the neighbours, and pixels similar to these
    KCoherence,
}

/// Meaning of an image's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// Phases if there are exactly two grey levels, otherwise an image
    Auto,
    /// Greys or colours
    Picture,
    /// Each grey level is a phase, up to 16
    Phases,
}

fn views(text: &str) -> Result<exemplar::Views, String> {
    match text.trim() {
        "2" => Ok(exemplar::Views::Two),
        "3" => Ok(exemplar::Views::Three),
        _ => Err("the number of views is 2 or 3".to_owned()),
    }
}

/// The images, checked, and whether they are phase maps.
struct Pictures {
    exemplars: Vec<Picture>,
    phases: bool,
}

/// JSON of `stereology exemplar`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ExemplarFields {
    /// Voxels along z, y and x, and channels.
    shape: [usize; 4],
    /// Synthesis method.
    method: String,
    /// How voxels were updated: batch or sequential.
    solver: &'static str,
    /// Number of families of slices that look like the images.
    views: usize,
    /// Whether the images were taken as phase maps.
    phases: bool,
    /// Resolution levels, the coarsest first.
    levels: Vec<Level>,
    /// Number of voxel updates, all iterations and levels together.
    voxel_iterations: u64,
    /// Time per voxel update in microseconds.
    microseconds_per_voxel_iteration: f64,
    /// Fraction of the pixels that were copied at least once.
    coverage: f64,
    /// Evenness of the copying: exponential of the entropy, over the number of pixels.
    perplexity: f64,
}

/// A resolution level of the synthesis.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Level {
    /// Voxels along z, y and x.
    size: [usize; 3],
    /// Energy after each iteration.
    energies: Vec<f64>,
}

impl Fields for ExemplarFields {
    const COMMAND: &'static str = "exemplar";
}

impl Exemplar {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let format = Format::from_path(self.output.name()).or_usage("-o")?;
        let file = everywhere.outputs.volume(&self.output, format)?;
        let sources = match &self.sources {
            None => None,
            Some(output) => {
                let format = Format::from_path(output.name()).or_usage("--sources")?;
                Some((everywhere.outputs.volume(output, format)?, format))
            }
        };
        let size = match self.size.0[..] {
            [n] => [n; 3],
            [nz, ny, nx] => [nz, ny, nx],
            _ => return Err(Failure::usage("--size must be N or NZ,NY,NX")),
        };
        let begin = Instant::now();
        let mut notes = Notes::default();
        let pictures = self.pictures(&mut notes)?;
        let options = self.options(everywhere.seed);
        let mut domain = Domain::new(size).or_usage("--size")?;
        // Before the mask, which has a byte for each voxel.
        options
            .check_memory(size, pictures.exemplars[0].channels())
            .or_usage("--size, --memory")?;
        if self.open {
            domain = domain.open();
        }
        if let Some(path) = &self.mask {
            let mask = given::mask(path, size, &mut notes)?;
            domain = domain.with_mask(mask.view()).at(path)?;
        }
        if let Some(path) = &self.fixed {
            let scale = if pictures.phases { 1.0 } else { 255.0 };
            let fixed = given::voxels(path, pictures.exemplars[0].colours(), scale, &mut notes)?;
            domain = domain.with_fixed(fixed).at(path)?;
        }
        let step = Step::begin("exemplar", everywhere.quiet);
        let solid = synthesize_solid(&pictures.exemplars, &domain, &options, &|done| step.at(done))
            .map_err(|error| self.explained(&error))?;
        drop(step);
        go_on()?;
        let scale = if pictures.phases { 1.0 } else { 255.0 };
        let (nz, ny, nx, channels) = solid.values.dim();
        let shape = VolumeShape { nz, ny, nx, channels };
        let voxel = VoxelSize {
            sides: [everywhere.scale; 3],
            unit: everywhere.unit,
        };
        write::<u8>(&file, format, shape, voxel, |z, y, x, channel| {
            (solid.values[[z, y, x, channel]] * scale).round().clamp(0.0, 255.0) as u8
        })?;
        if let Some((path, format)) = sources {
            let shape = VolumeShape { channels: 1, ..shape };
            write::<u32>(&path, format, shape, voxel, |z, y, x, _| solid.sources[[z, y, x]])?;
        }
        let fields = self.fields(&mut notes, &solid, &pictures, &options, begin.elapsed().as_secs_f64());
        Answer::new(&fields, notes)
    }

    fn fields(
        &self,
        notes: &mut Notes,
        solid: &Solid,
        pictures: &Pictures,
        options: &SolidOptions,
        seconds: f64,
    ) -> ExemplarFields {
        let (nz, ny, nx, channels) = solid.values.dim();
        let each = 1e6 * seconds / solid.voxel_iterations as f64;
        let last = solid.levels.last().and_then(|level| level.energies.last());
        let levels = solid.levels.iter().map(|level| Level {
            size: level.size,
            energies: level.energies.clone(),
        });
        notes
            .line(format!("{nx} x {ny} x {nz} voxels: {}", self.output.display()))
            .line(format!(
                "{} levels, final energy {}; {} % of the pixels of the images used, perplexity {} %",
                solid.levels.len(),
                last.map_or_else(String::new, |energy| significant(*energy)),
                significant(100.0 * solid.coverage),
                significant(100.0 * solid.perplexity)
            ))
            .line(format!("{} microseconds per voxel and iteration", significant(each)))
            .seconds(seconds);
        ExemplarFields {
            shape: [nz, ny, nx, channels],
            method: value_name(&self.method),
            solver: if options.solver() == exemplar::Solver::Batch {
                "batch"
            } else {
                "sequential"
            },
            views: options.views.count(),
            phases: pictures.phases,
            levels: levels.collect(),
            voxel_iterations: solid.voxel_iterations,
            microseconds_per_voxel_iteration: each,
            coverage: solid.coverage,
            perplexity: solid.perplexity,
        }
    }

    fn options(&self, seed: u64) -> SolidOptions {
        let three = self.images.len() != 2;
        let views = self.views.unwrap_or(if three {
            exemplar::Views::Three
        } else {
            exemplar::Views::Two
        });
        let mut options = SolidOptions::default()
            .with_method(match self.method {
                Method::Best => exemplar::Method::Best,
                Method::WeiLevoy => exemplar::Method::WeiLevoy,
                Method::Kopf => exemplar::Method::Kopf,
                Method::ChenWang => exemplar::Method::ChenWang,
            })
            .with_scan(match self.scan {
                Scan::Lexicographic => exemplar::Scan::Lexicographic,
                Scan::Random => exemplar::Scan::Random,
                Scan::Morton => exemplar::Scan::Morton,
                Scan::Hilbert => exemplar::Scan::Hilbert,
            })
            .with_search(match self.search {
                Search::Exact => exemplar::Search::Exact,
                Search::Tsvq => exemplar::Search::Tsvq,
                Search::KCoherence => exemplar::Search::KCoherence,
            })
            .with_views(views)
            .with_neighbourhood(self.neighbourhood)
            .with_causal(self.causal)
            .with_iterations(self.iterations)
            .with_memory_limit(bytes(self.memory))
            .with_seed(seed);
        options.solver = self.solver.map(|solver| match solver {
            Solver::Sequential => exemplar::Solver::Sequential,
            Solver::Batch => exemplar::Solver::Batch,
        });
        options.levels = self.levels;
        options.similar = self.similar;
        options
    }

    fn pictures(&self, notes: &mut Notes) -> Result<Pictures, Failure> {
        let photos: Vec<RgbImage> = self
            .images
            .iter()
            .map(|path| self.limit.read(path, BYTES_PER_PIXEL, notes))
            .collect::<Result<_, _>>()?;
        let grey = photos
            .iter()
            .all(|photo| photo.pixels().all(|p| p[0] == p[1] && p[1] == p[2]));
        let mut greys: Vec<u8> = photos.iter().flat_map(|photo| photo.pixels().map(|p| p[0])).collect();
        greys.sort_unstable();
        greys.dedup();
        let phases = match self.kind {
            Kind::Auto => grey && greys.len() == 2,
            Kind::Picture => false,
            Kind::Phases if grey => true,
            Kind::Phases => {
                return Err(Failure::run(format!(
                    "{}: a phase map is a grey image with one grey level per phase, but this image has colours",
                    self.images[0].display()
                )));
            }
        };
        let exemplars = photos.iter().zip(&self.images).map(|(photo, path)| {
            let (height, width) = (photo.height() as usize, photo.width() as usize);
            let at = |y: usize, x: usize, c: usize| photo.get_pixel(x as u32, y as u32)[c];
            if phases {
                Picture::phase_map(Array2::from_shape_fn((height, width), |(y, x)| u32::from(at(y, x, 0))).view())
            } else {
                let shape = (height, width, if grey { 1 } else { 3 });
                Picture::colour(Array3::from_shape_fn(shape, |(y, x, c)| f32::from(at(y, x, c)) / 255.0).view())
            }
            .at(path)
        });
        Ok(Pictures {
            exemplars: exemplars.collect::<Result<_, _>>()?,
            phases,
        })
    }

    /// Explains an error of the synthesis: names the option or the file that caused it.
    fn explained(&self, error: &SolidError) -> Failure {
        use SolidError as E;
        match error {
            E::Neighbourhood { .. } => Failure::usage(format!("--neighbourhood: {error}")),
            E::Levels { .. } => Failure::usage(format!("--levels: {error}")),
            E::Option { .. } => Failure::usage(error),
            E::Mismatch { .. } if self.causal => Failure::usage(format!("--causal: {error}")),
            E::FixedValue { .. } => match &self.fixed {
                Some(path) => Failure::run(format!("{}: {error}", path.display())),
                None => Failure::run(error),
            },
            E::Cancelled => Failure::stopped(),
            _ => Failure::run(format!("{}: {error}", self.images[0].display())),
        }
    }
}

/// The name of an option's value.
fn value_name(value: &impl ValueEnum) -> String {
    value
        .to_possible_value()
        .map_or_else(String::new, |value| value.get_name().to_owned())
}

fn write<T: Element>(
    path: &Path,
    format: Format,
    shape: VolumeShape,
    voxel: VoxelSize,
    value: impl Fn(usize, usize, usize, usize) -> T,
) -> Result<(), Failure> {
    write_volume::<T>(path, format, shape, voxel, |z, mut slab| {
        for (y, mut row) in slab.axis_iter_mut(Axis(0)).enumerate() {
            for ((x, channel), slot) in row.indexed_iter_mut() {
                *slot = value(z, y, x, channel);
            }
        }
        if stopped() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    })
    .at(path)
}
