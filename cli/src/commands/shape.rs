//! `stereology shape`: a body as a mesh file.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use stereology::shape::{Body, BodyKind, ClosedMesh, ControlSphere, MeshFormat, Subdivision, TriangleMesh, write_mesh};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::{Explain, Failure, body_welding};
use crate::numbers::significant;
use crate::outputs::{check_file, write_text};
use crate::values::positive;
use crate::warnings::Warning;

/// A shape as a mesh file
///
/// SPEC is a SHAPE (`sphere`, `ellipsoid:A,B,C`, `box:A,B,C`, `cylinder:D,L`, `rock:SEED`, a mesh file), a rough rock `rock:SEED,ROUGHNESS` (0.02 worn, 0.1
/// jagged), a superellipsoid `superellipsoid:A,B,C,E1,E2` (semi-axes; exponents: near 0 a box, 1 an ellipsoid, 2 an octahedron), the convex hull of points
/// `hull:FILE`, or a sphere edited by its control points (.json), as the paper's particles were made.
///
/// The FILE of a hull is a mesh file, of which the vertices are taken, or text (.csv, .xyz, .txt): a point a row, x, y, z separated by commas, semicolons,
/// tabs or blanks. A header may name the columns x, y, z in any order; without one the first three are taken. Rows that begin with # are skipped.
///
/// A sphere or an ellipsoid written to a .json file gives the control points to start from. What is written can be given as SHAPE to every other command.
#[derive(Args, Debug)]
#[command(
    after_long_help = "Examples: stereology shape superellipsoid:1,1,0.5,0.5,0.5 -o pillow.obj\n          \
                             stereology shape sphere -o pebble.json     (edit it, then:)\n          \
                             stereology shape pebble.json --subdivide 1 --scheme loop -o pebble.ply\n          \
                             stereology shape hull:corners.csv -o grain.obj"
)]
pub struct Shape {
    /// What to write
    #[arg(value_name = "SPEC")]
    pub spec: String,
    /// Mesh file to write: .obj, .ply (all digits), .stl (single precision); or .json for control points
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// How often each triangle is split in four; spheres and ellipsoids are icospheres split this often [default: 0; 5 for spheres and ellipsoids]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=7))]
    pub subdivide: Option<u32>,
    /// Flat, or rounded by Loop's scheme
    #[arg(long, value_enum, default_value_t = Scheme::Midpoint)]
    pub scheme: Scheme,
    /// Join vertices of a mesh file that are nearer than this to each other, in its units
    #[arg(long, value_name = "DISTANCE", value_parser = positive)]
    pub weld: Option<f64>,
}

/// How triangles are split.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Scheme {
    /// At the middles of their edges: the same solid
    Midpoint,
    /// Smoothed (Loop 1987)
    Loop,
}

/// More triangles than this are refused.
const MOST_TRIANGLES: usize = 20_000_000;

impl Shape {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        check_file(&self.output, everywhere.force)?;
        let wants_control_points = self
            .output
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
        if !wants_control_points {
            MeshFormat::from_path(&self.output).or_usage("-o")?;
        }
        let body = body_welding(&self.spec, self.weld)?;
        let mut answer = Answer::new("shape");
        let written = if wants_control_points {
            write_text(&self.output, &self.control_points(&body)?.to_json())?;
            None
        } else {
            let mesh = self.mesh(&body)?;
            write_mesh(&self.output, &mesh).at(&self.output)?;
            Some(mesh)
        };
        self.tell(&body, written.as_ref(), &mut answer);
        Ok(answer)
    }

    fn mesh(&self, body: &Body) -> Result<TriangleMesh, Failure> {
        let times = self.subdivide.unwrap_or(0);
        let Some(mesh) = body.mesh() else {
            return Ok(body.to_triangles(self.subdivide.unwrap_or(5)));
        };
        let triangles = mesh.triangles().len() << (2 * times);
        if triangles > MOST_TRIANGLES {
            return Err(Failure::usage(format!(
                "--subdivide {times} would make {triangles} triangles, more than {MOST_TRIANGLES}; subdivide less"
            )));
        }
        let scheme = match self.scheme {
            Scheme::Midpoint => Subdivision::Midpoint,
            Scheme::Loop => Subdivision::Loop,
        };
        let fine = mesh.subdivided(scheme, times);
        if times > 0 {
            // Smoothing must not have made the surface cross itself.
            ClosedMesh::try_from(fine.clone())
                .map_err(|error| format!("{}, subdivided: {error}", self.spec))
                .or_fail()?;
        }
        Ok(fine)
    }

    fn control_points(&self, body: &Body) -> Result<ControlSphere, Failure> {
        let semi_axes = match body.kind() {
            BodyKind::Sphere { diameter } => [0.5 * diameter; 3],
            BodyKind::Ellipsoid { semi_axes } => semi_axes,
            _ => {
                return Err(Failure::usage(format!(
                    "{} has no control points: only spheres and ellipsoids are written to .json; give -o a name that ends in .obj, .ply or .stl",
                    self.spec
                )));
            }
        };
        let mut sphere = ControlSphere::sphere(2.0);
        for point in sphere.points_mut().iter_mut().flatten() {
            point.coords.component_mul_assign(&nalgebra::Vector3::from(semi_axes));
        }
        Ok(sphere)
    }

    fn tell(&self, body: &Body, written: Option<&TriangleMesh>, answer: &mut Answer) {
        let name = |path: &Path| path.display().to_string();
        answer
            .field("shape", self.spec.as_str())
            .field("output", name(&self.output))
            .field("vertices", written.map(|mesh| mesh.vertices.len()))
            .field("triangles", written.map(|mesh| mesh.triangles.len()))
            .field("volume", body.volume())
            .field("surface_area", body.surface_area())
            .field("caliper_hull", body.mean_width())
            .field("caliper_chi", body.signed_mean_width())
            .field("max_area", body.largest_section_area())
            .field("size", body.size())
            .field("convex", body.is_convex())
            .line(format!(
                "{}: {} triangles, volume {}, surface {}, mean caliper {}, size {} -> {}",
                self.spec,
                written.map_or(0, |mesh| mesh.triangles.len()),
                significant(body.volume()),
                significant(body.surface_area()),
                significant(body.mean_width()),
                significant(body.size()),
                name(&self.output)
            ));
        tell_repairs(&self.spec, body, answer);
    }
}

/// What was mended of a mesh: the field `repairs`, and a warning if there was anything.
pub fn tell_repairs(spec: &str, body: &Body, answer: &mut Answer) {
    let repairs: Vec<String> = body
        .mesh()
        .map_or(&[][..], |mesh| mesh.repairs())
        .iter()
        .map(ToString::to_string)
        .collect();
    if !repairs.is_empty() {
        answer.warn(Warning::new("mesh-repaired", format!("{spec}: {}", repairs.join("; "))));
    }
    answer.field("repairs", repairs);
}
