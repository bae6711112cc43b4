//! `stereology carve`: a mesh with the solid's texture as colours of its vertices.

use std::path::PathBuf;

use clap::Args;
use nalgebra::Point3;
use stereology::pipeline::Warning;
use stereology::shape::{read_mesh, write_coloured_mesh};
use stereology::volume::{CarveError, CarveOptions, turned};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::commands::render::Placement;
use crate::commands::slice::open_solid;
use crate::failure::{Explain, Failure};
use crate::numbers::counted;
use crate::outputs::check_file;
use crate::progress::Step;
use crate::values::{count, positive};

/// Carves a mesh from a finished solid: writes it with the solid's texture as colours of its vertices
///
/// DIR is an output folder of `stereology synthesize`. The mesh (.obj, .stl, .ply) is placed with its longest side on one period of the solid, or as --period
/// says, and keeps its coordinates. Its triangles are bisected until colours between the ends of each edge are what a viewer interpolates, or edges are as
/// short as a pixel of the photograph, or there are --triangles of them. .glb opens in Blender, three.js and Windows; .ply in MeshLab and Blender.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology carve out bunny.obj -o bunny.glb")]
pub struct Carve {
    /// Folder of a solid, written by `stereology synthesize`
    #[arg(value_name = "DIR")]
    pub solid: PathBuf,
    /// Mesh to carve: any triangles, closed or not
    #[arg(value_name = "MESH")]
    pub mesh: PathBuf,
    /// Length in the mesh that one period of the solid takes [default: the mesh's longest side]
    #[arg(long, value_name = "LENGTH", value_parser = positive)]
    pub period: Option<f64>,
    /// Turn the solid in the mesh, so that flat faces do not show its period
    #[arg(long)]
    pub turned: bool,
    /// Triangles at most
    #[arg(long, value_name = "N", default_value_t = CarveOptions::default().most_triangles, value_parser = count)]
    pub triangles: usize,
    /// File: .glb or .ply
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

impl Carve {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let ending = self.output.extension().map(|ending| ending.to_ascii_lowercase());
        if !ending.is_some_and(|ending| ending == "glb" || ending == "ply") {
            return Err(Failure::usage("-o needs a file that ends in .glb or .ply"));
        }
        check_file(&self.output, everywhere.force)?;
        let solid = open_solid(&self.solid)?.solid;
        let mesh = read_mesh(&self.mesh).at(&self.mesh)?;
        let placement = Placement::of(&mesh, &solid, self.period);
        let options = CarveOptions {
            most_triangles: self.triangles,
            ..CarveOptions::default()
        };
        let place: &(dyn Fn(&Point3<f64>) -> Point3<f64> + Sync) = if self.turned {
            &|p| turned(&placement.apply(p))
        } else {
            &|p| placement.apply(p)
        };
        let step = Step::begin("carving", everywhere.quiet);
        let carved = solid
            .carve(&mesh, place, &options, &|done| step.at(done))
            .map_err(|error| match error {
                CarveError::Cancelled => Failure::stopped(),
                error => Failure::run(format!("{}: {error}", self.mesh.display())),
            })?;
        drop(step);
        write_coloured_mesh(&self.output, &carved.coloured).at(&self.output)?;
        let mesh = &carved.coloured.mesh;
        let mut answer = Answer::new("carve");
        answer
            .field("vertices", mesh.vertices.len())
            .field("triangles", mesh.triangles.len())
            .field("coarse_edges", carved.coarse_edges)
            .line(format!(
                "{} triangles with colours written to {}",
                counted(mesh.triangles.len() as u64),
                self.output.display()
            ));
        if carved.coarse_edges > 0 {
            answer.warn(Warning::new(
                "coarse-texture",
                format!(
                    "{} edges are longer than the texture asks for: {} triangles were not enough; give more --triangles",
                    carved.coarse_edges, self.triangles
                ),
            ));
        }
        Ok(answer)
    }
}
