//! `stereology carve`: a mesh with the solid's texture as vertex colours or as a texture image.

use std::path::PathBuf;

use clap::Args;
use nalgebra::Point3;
use schemars::JsonSchema;
use serde::Serialize;
use stereology::files::solid::SavedSolid;
use stereology::shape::{TriangleMesh, read_mesh, write_coloured_mesh, write_textured_mesh};
use stereology::volume::{BakeOptions, CarveError, CarveOptions, Solid, turned};

use crate::answer::{Answer, Fields, Notes};
use crate::commands::render::Placement;
use crate::commands::solid_files::open_solid;
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::Output;
use crate::progress::Step;
use crate::values::{count, positive};
use crate::warnings::Warning;
use stereology_report::{counted, significant};

/// Carves a mesh from a finished solid and writes it with the solid's texture as vertex colours
///
/// DIR is an output folder of `stereology synthesize` or `assemble`, or a packing.json. The longest side of the mesh
/// (.obj, .stl, .ply) spans one period of the solid, unless --period gives another length; its coordinates are kept,
/// except in a .glb of a solid with a unit of length, which is in metres. Triangles are bisected until linear
/// interpolation along every edge reproduces the colours, until edges are as short as a pixel of the photograph, or
/// until there are --triangles of them. .glb opens in Blender, three.js and Windows; .ply in MeshLab and Blender.
///
/// With --atlas the mesh keeps its triangles and the texture is baked into an image inside the .glb, as games and web
/// viewers expect.
#[derive(Args, Debug)]
#[command(
    after_long_help = "Example: stereology carve out bunny.obj -o bunny.glb\n         stereology carve out crate.obj --atlas 2048 -o crate.glb"
)]
pub struct Carve {
    /// Folder of a solid, written by `stereology synthesize` or `assemble`, or a packing.json
    #[arg(value_name = "DIR")]
    pub solid: PathBuf,
    /// Mesh to carve: any triangles, closed or not
    #[arg(value_name = "MESH")]
    pub mesh: PathBuf,
    /// Length of one period of the solid, in units of the mesh [default: the mesh's longest side]
    #[arg(long, value_name = "LENGTH", value_parser = positive)]
    pub period: Option<f64>,
    /// Rotate the solid within the mesh, so that flat faces do not show its period
    #[arg(long)]
    pub turned: bool,
    /// Maximum number of triangles
    #[arg(long, value_name = "N", default_value_t = CarveOptions::default().most_triangles, value_parser = count)]
    pub triangles: usize,
    /// Keep the triangles and bake the texture into a square image with this many pixels along a side, at most 16384;
    /// .glb only
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=16384), conflicts_with = "triangles")]
    pub atlas: Option<u32>,
    /// File: .glb or .ply
    #[arg(short, long, value_name = "FILE")]
    pub output: Output,
}

/// The file to write.
struct Written {
    file: PathBuf,
    /// Factor to its coordinates, if they are in metres.
    metres: Option<f64>,
}

/// JSON of `stereology carve`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct CarveFields {
    /// Vertices written.
    vertices: usize,
    /// Triangles written.
    triangles: usize,
    /// Edges that are longer than the texture requires; without --atlas.
    #[serde(skip_serializing_if = "Option::is_none")]
    coarse_edges: Option<usize>,
    /// Charts of the atlas; with --atlas.
    #[serde(skip_serializing_if = "Option::is_none")]
    charts: Option<usize>,
    /// Side of a pixel of the atlas, in the unit of length of the solid; with --atlas.
    #[serde(skip_serializing_if = "Option::is_none")]
    texel: Option<f64>,
    /// Fraction of the atlas that charts cover; with --atlas.
    #[serde(skip_serializing_if = "Option::is_none")]
    atlas_used: Option<f64>,
}

impl Fields for CarveFields {
    const COMMAND: &'static str = "carve";
}

impl Carve {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let ending = self.output.extension().map(|ending| ending.to_ascii_lowercase());
        let ends_in = |wanted: &str| ending.as_ref().is_some_and(|ending| ending == wanted);
        if !(ends_in("glb") || ends_in("ply")) {
            return Err(Failure::usage("-o needs a file that ends in .glb or .ply"));
        }
        if self.atlas.is_some() && !ends_in("glb") {
            return Err(Failure::usage("with --atlas, -o needs a file that ends in .glb"));
        }
        let file = everywhere.outputs.file(&self.output)?;
        let SavedSolid { solid, unit, .. } = open_solid(&self.solid, everywhere)?;
        let mesh = read_mesh(&self.mesh).at(&self.mesh)?;
        let placement = Placement::of(&mesh, &solid, self.period);
        // glTF prescribes metres.
        let metres = unit
            .filter(|_| ends_in("glb"))
            .map(|unit| placement.scale() * unit.in_metres());
        let written = Written { file, metres };
        let place: &(dyn Fn(&Point3<f64>) -> Point3<f64> + Sync) = if self.turned {
            &|p| turned(&placement.apply(p))
        } else {
            &|p| placement.apply(p)
        };
        match self.atlas {
            Some(pixels) => self.bake(&solid, &mesh, place, pixels, &written, everywhere),
            None => self.refine(&solid, &mesh, place, &written, everywhere),
        }
    }

    fn refine(
        &self,
        solid: &Solid,
        mesh: &TriangleMesh,
        place: &(dyn Fn(&Point3<f64>) -> Point3<f64> + Sync),
        written: &Written,
        everywhere: &Everywhere,
    ) -> Result<Answer, Failure> {
        let options = CarveOptions {
            most_triangles: self.triangles,
            ..CarveOptions::default()
        };
        let step = Step::begin("carving", everywhere.quiet);
        let mut carved = solid
            .carve(mesh, place, &options, &|done| step.at(done))
            .map_err(|error| self.failure(error))?;
        drop(step);
        let in_metres = in_metres(&mut carved.coloured.mesh, written.metres);
        write_coloured_mesh(&written.file, &carved.coloured).at(&written.file)?;
        let mesh = &carved.coloured.mesh;
        let mut notes = Notes::default();
        notes.line(format!(
            "{} triangles with vertex colours written to {}",
            counted(mesh.triangles.len() as u64),
            self.output.display()
        ));
        notes.lines(in_metres);
        if carved.coarse_edges > 0 {
            notes.warn(Warning::new(
                "coarse-texture",
                format!(
                    "{} edges are longer than the texture requires: {} triangles were not enough; give more --triangles",
                    carved.coarse_edges, self.triangles
                ),
            ));
        }
        let fields = CarveFields {
            vertices: mesh.vertices.len(),
            triangles: mesh.triangles.len(),
            coarse_edges: Some(carved.coarse_edges),
            charts: None,
            texel: None,
            atlas_used: None,
        };
        Answer::new(&fields, notes)
    }

    fn bake(
        &self,
        solid: &Solid,
        mesh: &TriangleMesh,
        place: &(dyn Fn(&Point3<f64>) -> Point3<f64> + Sync),
        pixels: u32,
        written: &Written,
        everywhere: &Everywhere,
    ) -> Result<Answer, Failure> {
        let options = BakeOptions {
            pixels,
            ..BakeOptions::default()
        };
        let step = Step::begin("baking", everywhere.quiet);
        let mut baked = solid
            .bake(mesh, place, &options, &|done| step.at(done))
            .map_err(|error| self.failure(error))?;
        drop(step);
        let in_metres = in_metres(&mut baked.textured.mesh, written.metres);
        write_textured_mesh(&written.file, &baked.textured).at(&written.file)?;
        let mut notes = Notes::default();
        notes.line(format!(
            "{} triangles in {} charts of an atlas of {pixels} x {pixels} pixels written to {}",
            counted(mesh.triangles.len() as u64),
            counted(baked.charts as u64),
            self.output.display()
        ));
        notes.lines(in_metres);
        if let Some(coarseness) = baked.coarseness.filter(|coarseness| *coarseness > COARSE) {
            notes.warn(Warning::new(
                "coarse-texture",
                format!(
                    "a pixel of the atlas is as wide as {coarseness:.1} pixels of the photograph; give a larger --atlas or a larger --period"
                ),
            ));
        }
        let fields = CarveFields {
            vertices: mesh.vertices.len(),
            triangles: mesh.triangles.len(),
            coarse_edges: None,
            charts: Some(baked.charts),
            texel: Some(baked.texel),
            atlas_used: Some(baked.used),
        };
        Answer::new(&fields, notes)
    }

    fn failure(&self, error: CarveError) -> Failure {
        match error {
            CarveError::Cancelled => Failure::stopped(),
            error => Failure::run(format!("{}: {error}", self.mesh.display())),
        }
    }
}

/// Multiplies the coordinates by a length in metres, if it is known, and states that.
fn in_metres(mesh: &mut TriangleMesh, metres: Option<f64>) -> Option<String> {
    let metres = metres?;
    mesh.vertices.iter_mut().for_each(|vertex| vertex.coords *= metres);
    Some(format!(
        "coordinates are in metres, as glTF prescribes: those of the mesh times {}",
        significant(metres)
    ))
}

/// Pixels of the photograph per pixel of the atlas from which detail is lost.
const COARSE: f64 = 2.0;
