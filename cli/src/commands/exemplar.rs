//! `stereology exemplar`: a solid from one picture without particles.

mod given;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use image::RgbImage;
use ndarray::{Array2, Array3, Axis};
use serde_json::json;
use stereology::exemplar::{self, Domain, Exemplar as Picture, Solid, SolidError, SolidOptions, synthesize_solid};
use stereology::grid::{Element, Format, VolumeShape, write_volume};
use stereology::segment::read_photo;

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::{Explain, Failure};
use crate::numbers::significant;
use crate::outputs::check_file;
use crate::progress::{Step, go_on, stopped};
use crate::values::{Extent, count};

/// Makes a solid whose slices look like a picture, for materials without separate particles
///
/// Laminar carbons, wood, sediments, porous rock, gravel. Rows of the first IMAGE run along z and its columns along x: it shows the slices of constant y. A second IMAGE
/// (or the first again) shows the slices of constant x, rows along z, columns along y; with --views 3 a third (or the last) those of constant z, rows along y, columns along x.
/// Layered materials: --views 2, layers horizontal in the picture. All pictures at the same scale; the solid has their scale.
///
/// The solid repeats without a seam unless --open. A picture of exactly two greys is taken as a map of two phases, whose fractions the solid has exactly (--kind picture if it is none).
/// wei-levoy, kopf and chen-wang run as in urs-2012, voxel by voxel along --scan; best is ours. Judge the result with `stereology measure`.
#[derive(Args, Debug)]
#[command(
    after_long_help = "Example: stereology exemplar fringes.png --views 2 --size 128 -o carbon.npy\n         stereology measure fringes.png carbon.npy --slices xz,yz"
)]
pub struct Exemplar {
    /// Picture of the material; or two or three, one an axis: slices of constant y, x, z
    #[arg(value_name = "IMAGE", required = true, num_args = 1..=3)]
    pub images: Vec<PathBuf>,
    /// Voxels: N or NZ,NY,NX
    #[arg(long, value_name = "N[,N,N]")]
    pub size: Extent,
    /// How the solid is made
    #[arg(long, value_enum, default_value_t = Method::Best)]
    pub method: Method,
    /// Order in which the sequential solver visits the voxels
    #[arg(long, value_enum, default_value_t = Scan::Hilbert)]
    pub scan: Scan,
    /// 2: slices of constant y and x look like the pictures (layers); 3: those of constant z too [default: 3; as many as pictures, if two or three]
    #[arg(long, value_name = "N", value_parser = views)]
    pub views: Option<exemplar::Views>,
    /// Voxel by voxel, or all at once [default: batch for best, else sequential]
    #[arg(long, value_enum)]
    pub solver: Option<Solver>,
    /// How the picture's neighbourhood most like one of the solid is found
    #[arg(long, value_enum, default_value_t = Search::KCoherence)]
    pub search: Search,
    /// Levels, each half as fine as the one before [default: by the size of the picture's features]
    #[arg(long, value_name = "L", value_parser = count)]
    pub levels: Option<usize>,
    /// Side of the neighbourhood, pixels, odd
    #[arg(long, value_name = "PIXELS", default_value_t = 7)]
    pub neighbourhood: usize,
    /// Only what was visited before counts in a neighbourhood (sequential solver)
    #[arg(long)]
    pub causal: bool,
    /// Iterations a level
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = count)]
    pub iterations: usize,
    /// Similar pixels kept for each pixel, for k-coherence [default: 12 for best, 15 for chen-wang, else 4]
    #[arg(long, value_name = "K", value_parser = count)]
    pub similar: Option<usize>,
    /// What the picture's values are
    #[arg(long, value_enum, default_value_t = Kind::Auto)]
    pub kind: Kind,
    /// The solid does not repeat: opposite faces have nothing to do with each other
    #[arg(long)]
    pub open: bool,
    /// Voxels that are kept exactly: rows of x, y, z (numbers of voxels from 0) and the value, or r, g, b (0 to 255)
    #[arg(long, value_name = "CSV")]
    pub fixed: Option<PathBuf>,
    /// Closed mesh (fitted into the box), SHAPE, or .npy (z, y, x; not 0 is inside): nothing is written outside
    #[arg(long, value_name = "MESH|NPY")]
    pub mask: Option<PathBuf>,
    /// Also the pixel each voxel shows, u32, row x width + column, further pictures after the first; 4294967295 outside the mask
    #[arg(long, value_name = "FILE")]
    pub sources: Option<PathBuf>,
    /// File for the solid: .npy, .nrrd, .vti, .tif, .h5 or .zarr
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

/// How the solid is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// All at once, every voxel a pixel, all of the picture used alike
    Best,
    /// Mean of the best matches: loses contrast
    WeiLevoy,
    /// Weighted mean, colour histogram
    Kopf,
    /// A pixel, by position and index histograms
    ChenWang,
}

/// Order of the voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Scan {
    /// x fastest, then y, then z
    Lexicographic,
    /// Any order
    Random,
    /// Z-curve
    Morton,
    /// Hilbert's curve, from neighbour to neighbour
    Hilbert,
}

/// In which order voxels learn of each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Solver {
    /// Voxel by voxel, each seen by the next
    Sequential,
    /// First all are compared, then all are written
    Batch,
}

/// How neighbourhoods are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Search {
    /// All are compared: slow
    Exact,
    /// Tree-structured vector quantisation
    Tsvq,
    /// What continues the neighbours' matches, and its like
    KCoherence,
}

/// What a picture's values are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// Phases if there are exactly two greys, else a picture
    Auto,
    /// Greys or colours
    Picture,
    /// Each grey a phase of its own, up to 16
    Phases,
}

fn views(text: &str) -> Result<exemplar::Views, String> {
    match text.trim() {
        "2" => Ok(exemplar::Views::Two),
        "3" => Ok(exemplar::Views::Three),
        _ => Err("2 or 3".to_owned()),
    }
}

/// The pictures, checked, and what they are made of.
struct Pictures {
    exemplars: Vec<Picture>,
    phases: bool,
}

impl Exemplar {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let format = Format::from_path(&self.output).or_usage("-o")?;
        check_file(&self.output, everywhere.force)?;
        if let Some(path) = &self.sources {
            Format::from_path(path).or_usage("--sources")?;
            check_file(path, everywhere.force)?;
        }
        let size = match self.size.0[..] {
            [n] => [n; 3],
            [nz, ny, nx] => [nz, ny, nx],
            _ => return Err(Failure::usage("--size is N or NZ,NY,NX")),
        };
        let begin = Instant::now();
        let pictures = self.pictures()?;
        let options = self.options(everywhere.seed);
        let mut answer = Answer::new("exemplar");
        let mut domain = Domain::new(size).or_usage("--size")?;
        if self.open {
            domain = domain.open();
        }
        if let Some(path) = &self.mask {
            let mask = given::mask(path, size, &mut answer)?;
            domain = domain.with_mask(mask.view()).at(path)?;
        }
        if let Some(path) = &self.fixed {
            let scale = if pictures.phases { 1.0 } else { 255.0 };
            let fixed = given::voxels(path, pictures.exemplars[0].colours(), scale)?;
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
        write::<u8>(&self.output, format, shape, everywhere.scale, |z, y, x, channel| {
            (solid.values[[z, y, x, channel]] * scale).round().clamp(0.0, 255.0) as u8
        })?;
        if let Some(path) = &self.sources {
            let format = Format::from_path(path).or_usage("--sources")?;
            let shape = VolumeShape { channels: 1, ..shape };
            write::<u32>(path, format, shape, everywhere.scale, |z, y, x, _| {
                solid.sources[[z, y, x]]
            })?;
        }
        self.tell(&mut answer, &solid, &pictures, &options, begin.elapsed().as_secs_f64());
        Ok(answer)
    }

    fn tell(&self, answer: &mut Answer, solid: &Solid, pictures: &Pictures, options: &SolidOptions, seconds: f64) {
        let (nz, ny, nx, channels) = solid.values.dim();
        let each = 1e6 * seconds / solid.voxel_iterations as f64;
        let last = solid.levels.last().and_then(|level| level.energies.last());
        let levels: Vec<_> = solid
            .levels
            .iter()
            .map(|level| json!({ "size": level.size, "energies": level.energies }))
            .collect();
        answer
            .line(format!("{nx} x {ny} x {nz} voxels: {}", self.output.display()))
            .line(format!(
                "{} levels, energy {} at the end; {} % of the pictures' pixels used, as evenly as {} % would be",
                levels.len(),
                last.map_or_else(String::new, |energy| significant(*energy)),
                significant(100.0 * solid.coverage),
                significant(100.0 * solid.perplexity)
            ))
            .line(format!("{} microseconds a voxel and iteration", significant(each)))
            .field("shape", vec![nz, ny, nx, channels])
            .field("method", value_name(&self.method))
            .field(
                "solver",
                if options.solver() == exemplar::Solver::Batch {
                    "batch"
                } else {
                    "sequential"
                },
            )
            .field("views", options.views.count())
            .field("phases", pictures.phases)
            .field("levels", levels)
            .field("voxel_iterations", solid.voxel_iterations)
            .field("microseconds_per_voxel_iteration", each)
            .field("coverage", solid.coverage)
            .field("perplexity", solid.perplexity)
            .seconds(seconds);
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
            .with_seed(seed);
        options.solver = self.solver.map(|solver| match solver {
            Solver::Sequential => exemplar::Solver::Sequential,
            Solver::Batch => exemplar::Solver::Batch,
        });
        options.levels = self.levels;
        options.similar = self.similar;
        options
    }

    fn pictures(&self) -> Result<Pictures, Failure> {
        let photos: Vec<RgbImage> = self
            .images
            .iter()
            .map(|path| read_photo(path).at(path))
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
                    "{}: a map of phases is a grey picture, each grey a phase; this one has colours",
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

    /// An error of the synthesis: of an option, of the file of given voxels, or of the pictures.
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
    scale: f64,
    value: impl Fn(usize, usize, usize, usize) -> T,
) -> Result<(), Failure> {
    write_volume::<T>(path, format, shape, [scale; 3], |z, mut slab| {
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
