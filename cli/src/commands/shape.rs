//! `stereology shape`: a body as a mesh file.

use std::ffi::OsString;

use clap::{Args, ValueEnum};
use schemars::JsonSchema;
use serde::Serialize;
use stereology::shape::{Body, BodyKind, ClosedMesh, ControlSphere, MeshFormat, Subdivision, TriangleMesh, write_mesh};

use crate::answer::{Answer, Fields, Notes};
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure, body_of};
use crate::outputs::{Output, write_text};
use crate::values::positive;
use crate::warnings::Warning;
use stereology_report::significant;

/// Writes a shape as a mesh file
///
/// SPEC is a SHAPE (`sphere`, `ellipsoid:A,B,C`, `box:A,B,C`, `cylinder:D,L`, `rock:SEED`, a mesh file), a rough rock
/// `rock:SEED,ROUGHNESS` (0.02 is worn, 0.1 jagged), a superellipsoid `superellipsoid:A,B,C,E1,E2` (semi-axes and
/// exponents: near 0 a box, 1 an ellipsoid, 2 an octahedron), the convex hull of points `hull:FILE`, or a sphere edited
/// by its control points (.json), which is how the particles of the paper were modelled.
///
/// The FILE of a hull is a mesh file, whose vertices are used, or a text file (.csv, .xyz, .txt) with one point per
/// row: x, y, z separated by commas, semicolons, tabs or blanks. A header may name the columns x, y, z in any order;
/// without a header the first three columns are used. Rows that begin
/// with # are skipped.
///
/// Writing a sphere or an ellipsoid to a .json file gives control points to start from. Every other command accepts the
/// written file as SHAPE.
#[derive(Args, Debug)]
#[command(
    after_long_help = "Examples: stereology shape superellipsoid:1,1,0.5,0.5,0.5 -o pillow.obj\n          \
                             stereology shape sphere -o pebble.json     (edit it, then:)\n          \
                             stereology shape pebble.json --subdivide 1 --scheme loop -o pebble.ply\n          \
                             stereology shape hull:corners.csv -o grain.obj"
)]
pub struct Shape {
    /// Shape to write
    #[arg(value_name = "SPEC")]
    pub spec: OsString,
    /// Mesh file to write: .obj, .ply (double precision), .stl (single precision); or .json for control points
    #[arg(short, long, value_name = "FILE")]
    pub output: Output,
    /// Number of subdivisions, each of which splits every triangle into four; spheres and ellipsoids start from an
    /// icosahedron [default: 0; 5 for spheres and ellipsoids]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=7))]
    pub subdivide: Option<u32>,
    /// Subdivision scheme: flat, or smoothed by Loop's scheme
    #[arg(long, value_enum, default_value_t = Scheme::Midpoint)]
    pub scheme: Scheme,
    /// Merge vertices of a mesh file that are closer than this, in units of the mesh
    #[arg(long, value_name = "DISTANCE", value_parser = positive)]
    pub weld: Option<f64>,
}

/// How triangles are subdivided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Scheme {
    /// At the midpoints of the edges: the surface is unchanged
    Midpoint,
    /// Loop's scheme (1987), which smooths the surface
    Loop,
}

/// Largest number of triangles that is written.
const MOST_TRIANGLES: usize = 20_000_000;

/// JSON of `stereology shape`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ShapeFields {
    /// Description of the shape, as on the command line.
    shape: String,
    /// File that was written.
    output: String,
    /// Vertices written; null for control points.
    vertices: Option<usize>,
    /// Triangles written; null for control points.
    triangles: Option<usize>,
    /// Volume of the shape.
    volume: f64,
    /// Surface area of the shape.
    surface_area: f64,
    /// Mean caliper (mean width) of the convex hull.
    caliper_hull: f64,
    /// Mean width from the signed edge angles, which counts concave edges as negative.
    caliper_chi: f64,
    /// Area of the largest plane section.
    max_area: f64,
    /// Diameter of the circle with the area of the largest section.
    size: f64,
    /// Whether the shape is convex.
    convex: bool,
    /// What was repaired in the mesh.
    repairs: Vec<String>,
}

impl Fields for ShapeFields {
    const COMMAND: &'static str = "shape";
}

impl Shape {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let file = everywhere.outputs.file(&self.output)?;
        let wants_control_points = self
            .output
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
        if !wants_control_points {
            MeshFormat::from_path(self.output.name()).or_usage("-o")?;
        }
        let body = body_of(&self.spec, self.weld)?;
        let written = if wants_control_points {
            write_text(&file, &self.control_points(&body)?.to_json())?;
            None
        } else {
            let mesh = self.mesh(&body)?;
            write_mesh(&file, &mesh).at(&file)?;
            Some(mesh)
        };
        self.answer(&body, written.as_ref())
    }

    fn mesh(&self, body: &Body) -> Result<TriangleMesh, Failure> {
        let times = self.subdivide.unwrap_or(0);
        let Some(mesh) = body.mesh() else {
            return Ok(body.to_triangles(self.subdivide.unwrap_or(5)));
        };
        let triangles = mesh.triangles().len() << (2 * times);
        if triangles > MOST_TRIANGLES {
            return Err(Failure::usage(format!(
                "--subdivide {times} would make {triangles} triangles, more than {MOST_TRIANGLES}; use fewer subdivisions"
            )));
        }
        let scheme = match self.scheme {
            Scheme::Midpoint => Subdivision::Midpoint,
            Scheme::Loop => Subdivision::Loop,
        };
        let fine = mesh.subdivided(scheme, times);
        if times > 0 {
            // Smoothing can make the surface intersect itself.
            ClosedMesh::try_from(fine.clone())
                .map_err(|error| format!("{}, subdivided: {error}", self.spec.display()))
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
                    self.spec.display()
                )));
            }
        };
        let mut sphere = ControlSphere::sphere(2.0);
        for point in sphere.points_mut().iter_mut().flatten() {
            point.coords.component_mul_assign(&nalgebra::Vector3::from(semi_axes));
        }
        Ok(sphere)
    }

    fn answer(&self, body: &Body, written: Option<&TriangleMesh>) -> Result<Answer, Failure> {
        let mut notes = Notes::default();
        let fields = ShapeFields {
            shape: self.spec.display().to_string(),
            output: self.output.display().to_string(),
            vertices: written.map(|mesh| mesh.vertices.len()),
            triangles: written.map(|mesh| mesh.triangles.len()),
            volume: body.volume(),
            surface_area: body.surface_area(),
            caliper_hull: body.mean_width(),
            caliper_chi: body.signed_mean_width(),
            max_area: body.largest_section_area(),
            size: body.size(),
            convex: body.is_convex(),
            repairs: repairs(&self.spec.to_string_lossy(), body, &mut notes),
        };
        notes.line(format!(
            "{}: {} triangles, volume {}, surface area {}, mean caliper {}, size {} -> {}",
            self.spec.display(),
            fields.triangles.unwrap_or(0),
            significant(fields.volume),
            significant(fields.surface_area),
            significant(fields.caliper_hull),
            significant(fields.size),
            fields.output
        ));
        Answer::new(&fields, notes)
    }
}

/// What was repaired in the body's mesh, with a warning if anything was.
pub fn repairs(spec: &str, body: &Body, notes: &mut Notes) -> Vec<String> {
    let repairs: Vec<String> = body
        .mesh()
        .map_or(&[][..], |mesh| mesh.repairs())
        .iter()
        .map(ToString::to_string)
        .collect();
    if !repairs.is_empty() {
        notes.warn(Warning::new("mesh-repaired", format!("{spec}: {}", repairs.join("; "))));
    }
    repairs
}
