//! `stereology render`: a picture of the solid, or of a mesh carved from it.

use std::path::PathBuf;

use clap::Args;
use nalgebra::{Point3, Vector3};
use stereology::render::{BlockOptions, Camera, RenderOptions, render_block, render_mesh_with_progress};
use stereology::shape::{TriangleMesh, read_mesh};
use stereology::volume::Solid;

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::commands::slice::open_solid;
use crate::failure::{Explain, Failure};
use crate::outputs::{check_file, write_png};
use crate::progress::{Step, go_on};
use crate::values::{Triple, count};

/// Renders a finished solid: one period of it as a block, or a mesh carved from it
///
/// DIR is an output folder of `stereology synthesize`. Without --mesh the block is drawn as the paper shows it, with three faces seen. A mesh (.obj, .stl,
/// .ply) is placed with its longest side on one period of the solid, and its surface shows the solid's colours there; its z axis points up.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology render out --mesh bunny.obj --camera 2,-3,1.5 -o bunny.png")]
pub struct Render {
    /// Folder of a solid, written by `stereology synthesize`
    #[arg(value_name = "DIR")]
    pub solid: PathBuf,
    /// Mesh to carve and show
    #[arg(long, value_name = "MESH")]
    pub mesh: Option<PathBuf>,
    /// Direction from the centre to the camera (z is up)
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub camera: Option<Triple>,
    /// Width and height of the picture in pixels
    #[arg(long, value_name = "PX", default_value_t = 768, value_parser = count)]
    pub size: usize,
    /// File for the picture
    #[arg(short, long, value_name = "PNG")]
    pub output: PathBuf,
}

impl Render {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        check_file(&self.output, everywhere.force)?;
        let solid = open_solid(&self.solid)?.solid;
        let size = self.size as u32;
        let step = Step::begin("rendering", everywhere.quiet);
        let picture = match &self.mesh {
            None => {
                let mut options = BlockOptions::default().with_size(size, size);
                if let Some(Triple(towards)) = self.camera {
                    options.camera = camera(options.camera, towards)?;
                }
                render_block(&|p| solid.colour_at(p), solid.period().sides(), &options).or_fail()?
            }
            Some(path) => {
                let mut mesh = read_mesh(path).at(path)?;
                let placement = Placement::of(&mesh, &solid, None);
                mesh.vertices.iter_mut().for_each(|v| *v = placement.apply(v));
                let towards = self.camera.unwrap_or(Triple([1.0, -1.6, 0.8])).0;
                let camera = camera(
                    Camera {
                        up: Vector3::z_axis(),
                        ..Camera::default()
                    },
                    towards,
                )?;
                let options = RenderOptions::default().with_size(size, size);
                render_mesh_with_progress(&mesh, &|p| solid.colour_at(p), &camera, &options, &|done| step.at(done))
                    .at(path)?
            }
        };
        drop(step);
        go_on()?;
        write_png(&self.output, &picture)?;
        let mut answer = Answer::new("render");
        answer
            .field("width", picture.width())
            .field("height", picture.height())
            .line(format!(
                "{} x {} pixels written to {}",
                picture.width(),
                picture.height(),
                self.output.display()
            ));
        Ok(answer)
    }
}

/// Where a mesh lies in the solid.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    from: Vector3<f64>,
    scale: f64,
}

impl Placement {
    /// From the origin on, one period of the solid as long as `period` of the mesh: its longest side if not given.
    pub fn of(mesh: &TriangleMesh, solid: &Solid, period: Option<f64>) -> Self {
        let fold = |start: f64, further: fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64>| {
            let vertices = mesh.vertices.iter();
            vertices.fold(Vector3::repeat(start), |far, v| further(&far, &v.coords))
        };
        let (low, high) = (fold(f64::INFINITY, Vector3::inf), fold(f64::NEG_INFINITY, Vector3::sup));
        let scale = solid.period().sides().max() / period.unwrap_or_else(|| (high - low).max());
        // A mesh without size stays where it is, to be refused by who looks at its triangles.
        if scale.is_finite() && scale > 0.0 {
            Self { from: low, scale }
        } else {
            Self {
                from: Vector3::zeros(),
                scale: 1.0,
            }
        }
    }

    /// Where in the solid a point of the mesh is.
    pub fn apply(&self, p: &Point3<f64>) -> Point3<f64> {
        Point3::from((p.coords - self.from) * self.scale)
    }
}

/// The camera in the direction `towards`, z up.
fn camera(from: Camera, towards: [f64; 3]) -> Result<Camera, Failure> {
    let [x, y, z] = towards;
    let length = x.hypot(y).hypot(z);
    if !(length.is_finite() && length > 0.0) {
        return Err(Failure::usage("--camera needs a direction, such as 1,-1.6,0.8"));
    }
    Ok(Camera {
        azimuth: x.atan2(-y).to_degrees(),
        elevation: (z / length).asin().to_degrees().clamp(-89.0, 89.0),
        ..from
    })
}
