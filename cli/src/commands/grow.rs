//! `stereology grow`: stone synthesised inside a mesh around measurements.

mod measurements;

use std::ffi::{OsStr, OsString};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use ndarray::{Array3, Array4, ArrayView3, Axis};
use schemars::JsonSchema;
use serde::Serialize;
use stereology::exemplar::SolidError;
use stereology::files::voxel_table::ValueRange;
use stereology::grid::{Element, Format, SampleType, VolumeShape, VoxelSize, read_volume, write_volume};
use stereology::grow::{self, GrowOptions, Grown, LevelOptions, Search, Voxels, grow_image, synthesize_by_levels};
use stereology::metrics::seams;
use stereology::pipeline::finish_grown;
use stereology::shape::{Body, ClosedMesh, TriangleMesh, read_mesh};

use self::measurements::Unit;
use crate::answer::{Answer, Fields, Notes};
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure, body_of};
use crate::outputs::{Output, write_png};
use crate::pictures::ImageLimit;
use crate::progress::{Step, go_on};
use crate::signals::stopped;
use crate::values::{bytes, count, positive};
use crate::warnings::Warning;
use stereology_report::{counted, significant};

/// Memory for each pixel of an image, bytes.
const BYTES_PER_PIXEL: u64 = 60;

/// Fills a mesh with stone that looks like an image and agrees with measurements
///
/// Voxels whose centres lie inside MESH are filled outwards from seeds, the nearest first. For each voxel, the values
/// around it in a random plane are compared with the windows of IMAGE, and the centre of a similar window is copied
/// (Stone et al. 2014). Measured voxels keep their values; a connected component of measured voxels is one seed. The
/// rest of the box is 0.
///
/// MESH is a closed mesh (.obj, .stl, .ply), sphere, ellipsoid:A,B,C, box:A,B,C, cylinder:D,L or rock:SEED; or
/// picture:H,W, which synthesises an image (-o FILE.png) by Efros and Leung's method. IMAGE is an image, or a .npy,
/// .nrrd or .tif with any number of channels (grey and chemistry). The result has the same channels; it is u8 if IMAGE
/// holds bytes, otherwise f32.
#[derive(Args, Debug)]
#[command(
    after_long_help = "Example: stereology grow statue.obj soapstone.png --resolution 96 --measured drilled.csv -o statue.npy"
)]
pub struct Grow {
    /// Closed mesh, SHAPE, or picture:H,W
    pub mesh: OsString,
    /// Image of a section through the stone
    pub image: PathBuf,
    #[command(flatten)]
    pub limit: ImageLimit,
    /// Voxels along the mesh's longest side
    #[arg(long, value_name = "N", value_parser = count)]
    pub resolution: Option<usize>,
    /// Measurements: rows of x, y, z and one value per channel of IMAGE, in its units (0 to 255 for an image)
    #[arg(long, value_name = "CSV")]
    pub measured: Option<PathBuf>,
    /// Unit of the coordinates x, y, z of the measurements
    #[arg(long, value_enum, default_value_t = Unit::Auto)]
    pub measured_in: Unit,
    /// Number of random seeds besides the measurements [default: 12 without measurements, otherwise none]
    #[arg(long, value_name = "K", value_parser = seeds)]
    pub seeds: Option<usize>,
    /// Side of the window in pixels, odd, 3 to 15; 0 draws colours from the histogram, without texture
    #[arg(long, value_name = "PIXELS", default_value_t = 5)]
    pub window: usize,
    /// Planes of the windows
    #[arg(long, value_enum, default_value_t = Planes::Axis)]
    pub planes: Planes,
    /// How similar windows are found
    #[arg(long, value_enum, default_value_t = Way::Tree)]
    pub search: Way,
    /// Iterations of a finishing pass that removes the seams between cells, as `exemplar --method best` does; measured
    /// voxels are kept. 0 skips it; 10 suffice
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = finish)]
    pub finish: usize,
    /// For picture:H,W: synthesise row by row on this many levels, from coarse to fine (Wei and Levoy), instead of
    /// growing
    #[arg(long, value_name = "L", value_parser = count)]
    pub levels: Option<usize>,
    /// Also write the cell of each voxel, u32 from 1; 0 is outside the mesh
    #[arg(long, value_name = "FILE")]
    pub cells: Option<Output>,
    /// Refuse boxes of voxels that need more memory than this, in bytes times 2^30
    #[arg(long, value_name = "GIB", default_value_t = 4.0, value_parser = positive)]
    pub memory: f64,
    /// Also write the texel of IMAGE from which each voxel was copied, u32, row x width + column; 4294967295 where
    /// nothing was copied
    #[arg(long, value_name = "FILE")]
    pub sources: Option<Output>,
    /// File for the stone: .npy, .nrrd, .vti, .tif; .png for picture:H,W
    #[arg(short, long, value_name = "FILE")]
    pub output: Output,
}

/// Planes of the windows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Planes {
    /// The three coordinate planes
    Axis,
    /// The coordinate planes and ten diagonal planes
    Oblique,
}

/// How similar windows are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Way {
    /// About 400 windows from a tree, and those that continue the windows of the neighbours
    Tree,
    /// Every window of IMAGE
    Exact,
}

/// Image of the stone, values as stored.
struct Image {
    samples: Array3<f32>,
    is_bytes: bool,
}

/// A number of seeds, 0 to a million.
fn seeds(text: &str) -> Result<usize, String> {
    match text.trim().parse::<usize>() {
        Ok(number @ 0..=1_000_000) => Ok(number),
        _ => Err("a whole number from 0 to 1000000 is needed".to_owned()),
    }
}

/// A number of iterations, 0 to a thousand.
fn finish(text: &str) -> Result<usize, String> {
    match text.trim().parse::<usize>() {
        Ok(number @ 0..=1000) => Ok(number),
        _ => Err("a whole number from 0 to 1000 is needed".to_owned()),
    }
}

/// JSON of `stereology grow`.
#[derive(Debug, Default, Serialize, JsonSchema)]
pub struct GrowFields {
    /// Visibility of the seams between cells: contrast across them over contrast inside cells; null without seams. For
    /// solids.
    #[serde(skip_serializing_if = "Option::is_none")]
    seams: Option<Option<f64>>,
    /// Iterations of the finishing pass; with --finish.
    #[serde(skip_serializing_if = "Option::is_none")]
    finish: Option<usize>,
    /// Visibility of the seams before the finishing pass; with --finish.
    #[serde(skip_serializing_if = "Option::is_none")]
    seams_before_finish: Option<Option<f64>>,
    /// Voxels inside the mesh, or pixels of the image.
    voxels_inside: usize,
    /// Voxels that were filled.
    filled: usize,
    /// Measured voxels whose value changed; always 0.
    fixed_changed: usize,
    /// Number of cells.
    cells: usize,
    /// Measured voxels; for solids.
    #[serde(skip_serializing_if = "Option::is_none")]
    measured: Option<usize>,
    /// Connected components of the mesh that had no seed and got one; for solids.
    #[serde(skip_serializing_if = "Option::is_none")]
    added_seeds: Option<usize>,
    /// Voxels whose value was drawn from the histogram; for solids.
    #[serde(skip_serializing_if = "Option::is_none")]
    by_histogram: Option<usize>,
    /// Mean distance of a window from the window it was matched with; for solids.
    #[serde(skip_serializing_if = "Option::is_none")]
    mean_distance: Option<f64>,
    /// Side of the window in pixels.
    window: usize,
    /// Samples along each axis, and channels.
    shape: Vec<usize>,
    /// Side of a voxel in units of the mesh; for solids.
    #[serde(skip_serializing_if = "Option::is_none")]
    spacing: Option<f64>,
    /// Corner of the box in units of the mesh (x, y, z); for solids.
    #[serde(skip_serializing_if = "Option::is_none")]
    origin: Option<[f64; 3]>,
    /// Time per voxel in microseconds.
    microseconds_per_voxel: f64,
}

impl Fields for GrowFields {
    const COMMAND: &'static str = "grow";
}

impl Grow {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        if let Some(size) = self.mesh.to_str().and_then(|mesh| mesh.strip_prefix("picture:")) {
            return self.picture(size, everywhere);
        }
        let volume = |option: &str, output: &Output| {
            let format = Format::from_path(output.name()).or_usage(option)?;
            Ok::<_, Failure>((everywhere.outputs.volume(output, format)?, format))
        };
        let (file, format) = volume("-o", &self.output)?;
        let cells = self
            .cells
            .as_ref()
            .map(|output| volume("--cells", output))
            .transpose()?;
        let sources = self
            .sources
            .as_ref()
            .map(|output| volume("--sources", output))
            .transpose()?;
        let resolution = self.resolution.ok_or_else(|| {
            Failure::usage("--resolution N is missing: the number of voxels along the mesh's longest side")
        })?;
        if self.levels.is_some() {
            return Err(Failure::usage("--levels applies only to picture:H,W"));
        }
        let begin = Instant::now();
        let mut notes = Notes::default();
        let image = self.image(&mut notes)?;
        let mesh = closed_mesh(&self.mesh)?;
        for repair in mesh.repairs() {
            notes.warn(Warning::new("mesh-repaired", repair.to_string()));
        }
        let channels = image.samples.dim().2;
        let size = Voxels::size_of(&mesh, resolution).at(Path::new(&self.mesh))?;
        // Before the mask, which has a byte for each voxel.
        self.options(0, 0)
            .check_memory(size, 0, channels)
            .or_usage("--resolution, --memory")?;
        let voxels = Voxels::of_mesh(&mesh, resolution).at(Path::new(&self.mesh))?;
        let measured = match &self.measured {
            None => Vec::new(),
            Some(path) => {
                let range = if image.is_bytes {
                    ValueRange::Bytes
                } else {
                    ValueRange::Any
                };
                let found = measurements::read(path, self.measured_in, &voxels, channels, range)?;
                found.warnings.into_iter().for_each(|warning| {
                    notes.warn(warning);
                });
                found.voxels
            }
        };
        let options = self.options(everywhere.seed, if measured.is_empty() { 12 } else { 0 });
        let step = Step::begin("grow", everywhere.quiet);
        let (inside, samples) = (voxels.inside.view(), image.samples.view());
        let mut grown = grow::grow(inside, samples, &measured, &options, &|done| step.at(done))
            .map_err(|error| self.explained(&error))?;
        drop(step);
        let seams_grown = seams(grown.values.view(), grown.labels.view());
        if self.finish > 0 {
            let step = Step::begin("finish", everywhere.quiet);
            let (iterations, seed) = (self.finish, everywhere.seed);
            grown = finish_grown(&grown, inside, samples, &measured, iterations, seed, &|done| {
                step.at(done)
            })
            .map_err(|error| self.unfinished(&error))?;
        }
        go_on()?;
        let spacing = VoxelSize {
            sides: [voxels.spacing; 3],
            unit: everywhere.unit,
        };
        if image.is_bytes {
            write(&file, format, spacing, &grown.values.mapv(|v| v as u8))?;
        } else {
            write(&file, format, spacing, &grown.values)?;
        }
        for (output, numbers) in [(cells, &grown.labels), (sources, &grown.sources)] {
            if let Some((path, format)) = output {
                write(&path, format, spacing, &numbers.clone().insert_axis(Axis(3)))?;
            }
        }
        let found = seams(grown.values.view(), grown.labels.view());
        let mut fields = self.fields(&mut notes, &grown, &voxels, begin.elapsed().as_secs_f64());
        fields.seams = Some(found.visibility());
        if self.finish > 0 {
            fields.finish = Some(self.finish);
            fields.seams_before_finish = Some(seams_grown.visibility());
        }
        Answer::new(&fields, notes)
    }

    fn fields(&self, notes: &mut Notes, grown: &Grown, voxels: &Voxels, seconds: f64) -> GrowFields {
        let (nz, ny, nx, channels) = grown.values.dim();
        if grown.added_seeds > 0 {
            notes.warn(Warning::new(
                "seeds-added",
                format!("{} connected components of the voxels had no seed", grown.added_seeds),
            ));
        }
        let microseconds_per_voxel = 1e6 * seconds / grown.filled.max(1) as f64;
        notes
            .line(format!(
                "{} of {} voxels inside filled, {nx} x {ny} x {nz} voxels with side {} in units of the mesh: {}",
                counted(grown.filled as u64),
                counted(grown.inside as u64),
                significant(voxels.spacing),
                self.output.display()
            ))
            .line(format!(
                "{} cells; {} measured voxels, {} of them changed",
                grown.cells, grown.measured, grown.fixed_changed
            ))
            .line(format!(
                "{} microseconds per voxel",
                significant(microseconds_per_voxel)
            ))
            .seconds(seconds);
        GrowFields {
            voxels_inside: grown.inside,
            filled: grown.filled,
            fixed_changed: grown.fixed_changed,
            cells: grown.cells,
            measured: Some(grown.measured),
            added_seeds: Some(grown.added_seeds),
            by_histogram: Some(grown.by_histogram),
            mean_distance: Some(grown.mean_distance),
            window: self.window,
            shape: vec![nz, ny, nx, channels],
            spacing: Some(voxels.spacing),
            origin: Some(voxels.origin.into()),
            microseconds_per_voxel,
            ..GrowFields::default()
        }
    }

    fn options(&self, seed: u64, seeds: usize) -> GrowOptions {
        GrowOptions::default()
            .with_window(self.window)
            .with_seeds(self.seeds.unwrap_or(seeds))
            .with_planes(match self.planes {
                Planes::Axis => grow::Planes::Axis,
                Planes::Oblique => grow::Planes::Oblique,
            })
            .with_search(match self.search {
                Way::Tree => Search::default(),
                Way::Exact => Search::Exact,
            })
            .with_memory_limit(bytes(self.memory))
            .with_seed(seed)
    }

    /// Explains an error of the synthesis: names the option or the file that caused it.
    fn explained(&self, error: &grow::GrowError) -> Failure {
        use grow::GrowError as E;
        match error {
            E::Window { .. } => Failure::usage(format!("--window: {error}")),
            E::Memory { .. } => Failure::usage(format!("--resolution, --memory: {error}")),
            E::NoSeeds => Failure::usage("there is no seed; give --measured CSV, or --seeds K above 0"),
            E::Levels { .. } => Failure::usage(format!("--levels: {error}")),
            E::OutsideMask { .. } | E::Contradicting { .. } | E::Value { .. } => match &self.measured {
                Some(path) => Failure::run(format!("{}: {error}", path.display())),
                None => Failure::run(error),
            },
            E::EmptyMask => Failure::run(format!("{}: {error}", self.mesh.display())),
            _ => Failure::run(format!("{}: {error}", self.image.display())),
        }
    }

    /// An error of the finishing pass.
    fn unfinished(&self, error: &SolidError) -> Failure {
        let image = self.image.display();
        match error {
            SolidError::Cancelled | SolidError::ExemplarTooSmall { .. } => Failure::run(format!("{image}: {error}")),
            _ => Failure::run(format!("{image}: the stone cannot be finished: {error}")),
        }
    }

    fn picture(&self, size: &str, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let sides: Option<Vec<usize>> = size.split(',').map(|n| n.trim().parse().ok()).collect();
        let [height, width] = match sides.as_deref() {
            Some(&[height @ 1..=16_384, width @ 1..=16_384]) => [height, width],
            _ => {
                return Err(Failure::usage(
                    "picture:H,W needs two whole numbers of pixels, such as picture:256,256",
                ));
            }
        };
        let is_png = self.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
        let only_solids = [
            self.measured.is_some(),
            self.resolution.is_some(),
            self.cells.is_some(),
            self.sources.is_some(),
            self.finish > 0,
        ];
        if !is_png || only_solids.contains(&true) {
            return Err(Failure::usage(
                "picture:H,W needs -o FILE.png, and --resolution, --measured, --cells, --sources and --finish do not apply to it",
            ));
        }
        let file = everywhere.outputs.file(&self.output)?;
        let mut notes = Notes::default();
        let image = self.image(&mut notes)?;
        let channels = image.samples.dim().2;
        if !image.is_bytes || !(channels == 1 || channels == 3) {
            return Err(Failure::run(format!(
                "{}: picture:H,W needs a grey or RGB image of bytes",
                self.image.display()
            )));
        }
        let begin = Instant::now();
        let step = Step::begin("grow", everywhere.quiet);
        let progress = |done: f64| step.at(done);
        let made = match self.levels {
            None => grow_image(
                image.samples.view(),
                [height, width],
                &self.options(everywhere.seed, 1),
                &progress,
            ),
            Some(levels) => {
                let options = LevelOptions {
                    search: self.options(0, 0).search,
                    ..LevelOptions::default()
                        .with_levels(levels)
                        .with_window(self.window)
                        .with_seed(everywhere.seed)
                };
                synthesize_by_levels(image.samples.view(), [height, width], &options, &progress)
            }
        }
        .map_err(|error| self.explained(&error))?;
        drop(step);
        go_on()?;
        write_png(&file, &as_picture(&made.view()))?;
        let seconds = begin.elapsed().as_secs_f64();
        notes
            .line(format!("{width} x {height} pixels: {}", self.output.display()))
            .seconds(seconds);
        let fields = GrowFields {
            voxels_inside: height * width,
            filled: height * width,
            cells: 1,
            window: self.window,
            shape: vec![height, width, channels],
            microseconds_per_voxel: 1e6 * seconds / (height * width) as f64,
            ..GrowFields::default()
        };
        Answer::new(&fields, notes)
    }

    /// Bytes of an image; one channel if it is grey.
    fn of_photo(&self, path: &Path, notes: &mut Notes) -> Result<Image, Failure> {
        let photo = self.limit.read(path, BYTES_PER_PIXEL, notes)?;
        let is_grey = photo.pixels().all(|p| p[0] == p[1] && p[1] == p[2]);
        let shape = (
            photo.height() as usize,
            photo.width() as usize,
            if is_grey { 1 } else { 3 },
        );
        Ok(Image {
            samples: Array3::from_shape_fn(shape, |(y, x, c)| f32::from(photo.get_pixel(x as u32, y as u32)[c])),
            is_bytes: true,
        })
    }

    fn image(&self, notes: &mut Notes) -> Result<Image, Failure> {
        let path = &self.image;
        let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let stored = match ending.as_deref() {
            Some("npy" | "nrrd" | "nhdr") => read_volume(path).at(path)?,
            // A TIFF without bytes or colours may contain chemistry; images use more TIFF variants than
            // volumes.
            Some("tif" | "tiff") => match read_volume(path) {
                Ok(stored) if stored.samples.dim().3 != 4 => stored,
                _ => return self.of_photo(path, notes),
            },
            _ => return self.of_photo(path, notes),
        };
        let (slices, ..) = stored.samples.dim();
        if slices != 1 {
            return Err(Failure::run(format!(
                "{}: has {slices} slices; give a single image with axes (y, x), (y, x, 3) or (1, y, x, channel)",
                path.display()
            )));
        }
        Ok(Image {
            samples: stored.samples.index_axis_move(Axis(0), 0),
            is_bytes: stored.sample_type == SampleType::U8,
        })
    }
}

fn as_picture(made: &ArrayView3<'_, f32>) -> image::RgbImage {
    let (height, width, channels) = made.dim();
    image::RgbImage::from_fn(width as u32, height as u32, |x, y| {
        image::Rgb([0, 1, 2].map(|c| made[[y as usize, x as usize, if channels == 3 { c } else { 0 }]] as u8))
    })
}

/// The mesh of a file or a SHAPE; spheres and ellipsoids are triangulated finely.
pub fn closed_mesh(spec: &OsStr) -> Result<ClosedMesh, Failure> {
    let path = Path::new(spec);
    let is_file = path
        .extension()
        .is_some_and(|e| ["obj", "stl", "ply"].iter().any(|known| e.eq_ignore_ascii_case(known)));
    if is_file {
        return ClosedMesh::try_from(read_mesh(path).at(path)?).at(path);
    }
    let numbers = |prefix: &str| -> Option<Vec<f64>> {
        spec.to_str()?
            .strip_prefix(prefix)?
            .split(',')
            .map(|n| n.trim().parse().ok())
            .collect()
    };
    // Checks the numbers, and creates all other shapes.
    let body: Body = body_of(spec, None)?;
    if let Some(mesh) = body.mesh() {
        return Ok(mesh.clone());
    }
    let axes = match numbers("ellipsoid:").as_deref() {
        Some(&[a, b, c]) => [a, b, c],
        _ => [0.5; 3],
    };
    let ball = TriangleMesh::icosphere(2.0, 5);
    ClosedMesh::try_from(ball.mapped(|p| nalgebra::Point3::new(axes[0] * p.x, axes[1] * p.y, axes[2] * p.z))).or_fail()
}

fn write<T: Element>(path: &Path, format: Format, spacing: VoxelSize, samples: &Array4<T>) -> Result<(), Failure> {
    let (nz, ny, nx, channels) = samples.dim();
    let shape = VolumeShape { nz, ny, nx, channels };
    write_volume::<T>(path, format, shape, spacing, |z, mut slab| {
        slab.assign(&samples.index_axis(Axis(0), z));
        if stopped() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    })
    .at(path)
}
