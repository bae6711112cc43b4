//! `stereology render`: a rendering of the solid, or of a mesh carved from it.

use std::ffi::OsStr;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use nalgebra::{Point3, UnitVector3, Vector3};
use schemars::JsonSchema;
use serde::Serialize;
use stereology::render::{BlockOptions, Camera, RenderError, RenderOptions};
use stereology::renderings::render_solid;
use stereology::shape::{TriangleMesh, read_mesh};
use stereology::volume::{Solid, turned};

use crate::answer::{Answer, Fields, Notes};
use crate::commands::solid_files::open_solid;
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::{Output, write_png};
use crate::progress::Step;
use crate::values::{Triple, count, not_negative, positive};

/// Renders a finished solid: one period as a block, or a mesh carved from it
///
/// DIR is an output folder of `stereology synthesize` or `assemble`, or a packing.json. Without --mesh the block is
/// rendered with three faces visible, as in the paper. The longest side of a mesh (.obj, .stl, .ply) spans one period
/// of the solid, unless --period gives another length, and its surface shows the colours of the solid there.
///
/// Light is traced from surface to surface. Images are free of noise at any number of samples; with 8 x 8 per pixel
/// (--samples 8) they are unbiased.
#[derive(Args, Debug)]
#[command(
    after_long_help = "Example: stereology render out --mesh bunny.obj --up y --camera 2,1.5,3 -o bunny.png\n         stereology render out --mesh bunny.obj --up y --turntable 72 -o bunny.png; ffmpeg -i bunny_%03d.png bunny.mp4"
)]
pub struct Render {
    /// Folder of a solid, written by `stereology synthesize` or `assemble`, or a packing.json
    #[arg(value_name = "DIR")]
    pub solid: PathBuf,
    /// Mesh to carve and render
    #[arg(long, value_name = "MESH")]
    pub mesh: Option<PathBuf>,
    /// Length of one period of the solid, in units of the mesh [default: the mesh's longest side]
    #[arg(long, value_name = "LENGTH", value_parser = positive, requires = "mesh")]
    pub period: Option<f64>,
    /// Rotate the solid within the mesh or block, so that flat faces do not show its period
    #[arg(long)]
    pub turned: bool,
    /// Direction from the centre to the camera [default: from the front, above]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub camera: Option<Triple>,
    /// Axis that points up; y in most mesh files
    #[arg(long, value_enum, default_value_t = Axis::Z)]
    pub up: Axis,
    /// Width and height of the image in pixels
    #[arg(long, value_name = "PX", default_value_t = 768, value_parser = count)]
    pub size: usize,
    /// Samples per pixel along each axis, 1 to 16
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub samples: u32,
    /// Clear coat, from 0 (matt) to 1 (polished) [default: 0 for the block, 0.5 for a mesh]
    #[arg(long, value_name = "G", value_parser = not_negative)]
    pub gloss: Option<f64>,
    /// Render this many images in one turn around the upright axis; _000, _001, ... is added to the name of the PNG
    /// file
    #[arg(long, value_name = "N", value_parser = count)]
    pub turntable: Option<usize>,
    /// Image to write
    #[arg(short, long, value_name = "PNG")]
    pub output: Output,
}

/// An axis of the solid or the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    fn direction(self) -> UnitVector3<f64> {
        match self {
            Self::X => Vector3::x_axis(),
            Self::Y => Vector3::y_axis(),
            Self::Z => Vector3::z_axis(),
        }
    }
}

/// JSON of `stereology render`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct RenderFields {
    /// Width of an image in pixels.
    width: u32,
    /// Height of an image in pixels.
    height: u32,
    /// Number of images written.
    pictures: usize,
}

impl Fields for RenderFields {
    const COMMAND: &'static str = "render";
}

impl Render {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let names = self.names();
        let files: Vec<PathBuf> = names
            .iter()
            .map(|name| everywhere.outputs.file_called(name))
            .collect::<Result<_, _>>()?;
        let solid = open_solid(&self.solid, everywhere)?.solid;
        let (mesh, seen) = self.scene(&solid)?;
        let options = RenderOptions {
            samples: self.samples,
            gloss: self.gloss.unwrap_or(seen.render.gloss),
            ..seen.render.with_size(self.size as u32, self.size as u32)
        };
        let mut camera = self.camera_of(seen.camera)?;
        if self.turntable.is_some() {
            camera = camera.clear_of(&mesh);
        }
        let place: &(dyn Fn(&Point3<f64>) -> Point3<f64> + Sync) = if self.turned { &turned } else { &|p| *p };
        let step = Step::begin("rendering", everywhere.quiet);
        for (k, file) in files.iter().enumerate() {
            let part = |done: f64| step.at((k as f64 + done) / files.len() as f64);
            let from = Camera {
                azimuth: camera.azimuth + 360.0 * k as f64 / files.len() as f64,
                ..camera
            };
            let picture = render_solid(&solid, &mesh, place, &from, &options, &part).map_err(|error| match error {
                RenderError::Cancelled => Failure::stopped(),
                RenderError::Options { .. } => Failure::usage(error.to_string()),
                error => Failure::run(match &self.mesh {
                    Some(path) => format!("{}: {error}", path.display()),
                    None => error.to_string(),
                }),
            })?;
            write_png(file, &picture)?;
        }
        drop(step);
        let written = match names.as_slice() {
            [file] => format!("written to {}", file.display()),
            [first, .., last] => format!("each, {} to {}", first.display(), last.display()),
            [] => String::new(),
        };
        let mut notes = Notes::default();
        notes.line(format!("{} x {} pixels {written}", options.width, options.height));
        let fields = RenderFields {
            width: options.width,
            height: options.height,
            pictures: files.len(),
        };
        Answer::new(&fields, notes)
    }

    /// The image, or those of a turntable.
    fn names(&self) -> Vec<PathBuf> {
        let Some(frames) = self.turntable else {
            return vec![self.output.name().to_owned()];
        };
        let part = |part: Option<&OsStr>| part.map_or_else(String::new, |part| part.to_string_lossy().into_owned());
        let (stem, ending) = (part(self.output.name().file_stem()), part(self.output.extension()));
        let digits = (frames - 1).to_string().len().max(3);
        (0..frames)
            .map(|k| {
                self.output
                    .name()
                    .with_file_name(format!("{stem}_{k:0digits$}.{ending}"))
            })
            .collect()
    }

    /// The mesh to render, in coordinates of the solid, and its default camera and options.
    fn scene(&self, solid: &Solid) -> Result<(TriangleMesh, BlockOptions), Failure> {
        let block = BlockOptions::default();
        let Some(path) = &self.mesh else {
            let sides = solid.period().sides();
            return Ok((TriangleMesh::cuboid(sides.into()).mapped(|p| p + 0.5 * sides), block));
        };
        let mut mesh = read_mesh(path).at(path)?;
        let placement = Placement::of(&mesh, solid, self.period);
        mesh.vertices.iter_mut().for_each(|v| *v = placement.apply(v));
        let (camera, picture) = (Camera::default(), RenderOptions::default());
        Ok((
            mesh,
            BlockOptions {
                camera,
                render: picture,
            },
        ))
    }

    fn camera_of(&self, usual: Camera) -> Result<Camera, Failure> {
        let up = self.up.direction();
        let Some(Triple(towards)) = self.camera else {
            return Ok(Camera { up, ..usual });
        };
        let towards = Vector3::from(towards);
        if !(towards.norm().is_finite() && towards.norm() > 0.0) {
            return Err(Failure::usage("--camera needs a direction, such as 1,-1.6,0.8"));
        }
        let Camera { azimuth, elevation, .. } = Camera::from_side(&towards, up);
        Ok(Camera {
            azimuth,
            elevation,
            up,
            ..usual
        })
    }
}

/// Position of a mesh in the solid.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    from: Vector3<f64>,
    scale: f64,
}

impl Placement {
    /// Moves the mesh to the origin and scales it so that `period` (by default its longest side) is one period of the
    /// solid.
    pub fn of(mesh: &TriangleMesh, solid: &Solid, period: Option<f64>) -> Self {
        let fold = |start: f64, further: fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64>| {
            let vertices = mesh.vertices.iter();
            vertices.fold(Vector3::repeat(start), |far, v| further(&far, &v.coords))
        };
        let (low, high) = (fold(f64::INFINITY, Vector3::inf), fold(f64::NEG_INFINITY, Vector3::sup));
        let scale = solid.period().sides().max() / period.unwrap_or_else(|| (high - low).max());
        // A mesh without extent stays in place; the renderer refuses it.
        if scale.is_finite() && scale > 0.0 {
            Self { from: low, scale }
        } else {
            Self {
                from: Vector3::zeros(),
                scale: 1.0,
            }
        }
    }

    /// Length in the solid of a unit of the mesh.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Point of the solid at a point of the mesh.
    pub fn apply(&self, p: &Point3<f64>) -> Point3<f64> {
        Point3::from((p.coords - self.from) * self.scale)
    }
}
