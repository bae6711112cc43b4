//! `stereology displace`: stochastic relief on a mesh.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use schemars::JsonSchema;
use serde::Serialize;
use stereology::grid::write_atomically;
use stereology::microgeometry::{
    Design, EdgeCensus, Method, Metric, MicrogeometryError, Offset, ReconstructOptions, Reconstruction, Weighting,
    displace, presets, reconstruct, refined, simplified, to_distribution_units,
};
use stereology::shape::{
    ColouredMesh, MeshFormat, Subdivision, TriangleMesh, corner_normals, read_mesh, self_intersections,
    write_coloured_mesh, write_mesh,
};

use crate::answer::{Answer, Fields, Notes};
use crate::commands::contact::read_contact;
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::{Output, write_text};
use crate::progress::Step;
use crate::values::{count, positive};
use crate::warnings::Warning;
use stereology_report::counted;

/// Displaces a mesh by a random relief with a given spherical contact distribution
///
/// MESH (.obj, .ply, .stl; closed or open, with one or several connected components) is scaled so that the longest side
/// of its bounding box is 2 U units of the contact distribution. Every triangle gets a label: a signed distance to the
/// interface between two regions. The labels follow the distribution in FILE, and no two differ by more than their
/// distance over the surface. Each vertex then moves along its normal by s k f(|label|), in halves of the longest side
/// of the bounding box. Another --seed gives another relief of the same kind.
///
/// The mesh must be fine enough for the relief: edges about as long as the width of a bin (--edge-length). S,K,F is a
/// direction s (out, in, none), a scale k (typically 0.01 to 0.05) and a function f: x (sharp), sqrt (rounded), or a
/// table such as 0=0;2=0;3=1.
#[derive(Args, Debug)]
#[command(
    after_long_help = "Examples: stereology contact gravel.png -o contact.json\n          stereology displace bust.obj --contact contact.json --units 60 --negative in,0.02,sqrt --positive out,0.03,sqrt -o relief.glb\n          stereology displace bust.obj --contact contact.json --preset fig8-coral -o coral.ply\n          stereology displace vase.obj --design design.json --seed 7 -o vase7.glb"
)]
pub struct Displace {
    /// Mesh to displace
    #[arg(value_name = "MESH")]
    pub mesh: PathBuf,
    /// Contact distribution, written by `stereology contact`
    #[arg(long, value_name = "FILE", required_unless_present = "design")]
    pub contact: Option<PathBuf>,
    /// Half the longest side of the mesh's bounding box, in units of the distribution: more units give a finer
    /// structure
    #[arg(long, value_name = "U", required_unless_present_any = ["design", "preset"], value_parser = positive)]
    pub units: Option<f64>,
    /// Design from `stereology explore` or --design-out, which holds all settings; other options override it
    #[arg(long, value_name = "JSON")]
    pub design: Option<PathBuf>,
    /// Units and displacements of a row of the paper's table 1; an unknown name lists them
    #[arg(long, value_name = "NAME", conflicts_with = "design")]
    pub preset: Option<String>,
    /// How labels are assigned [default: tight]
    #[arg(long, value_enum)]
    pub method: Option<MethodArgument>,
    /// Displacement of the negative region [default: in,0.02,sqrt]
    #[arg(long, value_name = "S,K,F", allow_hyphen_values = true)]
    pub negative: Option<Offset>,
    /// Displacement of the positive region [default: out,0.03,sqrt]
    #[arg(long, value_name = "S,K,F", allow_hyphen_values = true)]
    pub positive: Option<Offset>,
    /// Subdivide triangles until no edge is longer than this, in units of the mesh
    #[arg(long, value_name = "E", value_parser = positive)]
    pub edge_length: Option<f64>,
    /// Subdivision scheme
    #[arg(long, value_enum, default_value_t = Scheme::Midpoint)]
    pub subdivision: Scheme,
    /// Weight of a triangle in the distribution [default: area; count for --method paper]
    #[arg(long, value_enum)]
    pub weight: Option<Weight>,
    /// Stretch structures along an axis by a factor
    #[arg(long, value_name = "X,Y,Z,FACTOR", value_parser = stretch, allow_hyphen_values = true)]
    pub stretch: Option<([f64; 3], f64)>,
    /// Simplify the result to this many triangles, smaller where the relief has more detail
    #[arg(long, value_name = "N", value_parser = count)]
    pub triangles: Option<usize>,
    /// Vertex colours, in .glb and .ply
    #[arg(long, value_enum, default_value_t = Colours::None)]
    pub colours: Colours,
    /// Also write the labels, with columns triangle and label
    #[arg(long, value_name = "CSV")]
    pub labels_out: Option<Output>,
    /// Also write the design: all settings, for --design
    #[arg(long, value_name = "JSON")]
    pub design_out: Option<Output>,
    /// Mesh file to write: .obj, .ply, .glb or .stl
    #[arg(short, long, value_name = "MESH")]
    pub output: Output,
}

/// How labels are assigned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MethodArgument {
    /// Look ahead and pack labels tightly
    Tight,
    /// Exactly as in the paper
    Paper,
}

/// Subdivision scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Scheme {
    /// At the midpoints of long edges: the surface is unchanged
    Midpoint,
    /// Loop's scheme, which smooths the surface
    Loop,
}

/// Weight of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Weight {
    /// Its area
    Area,
    /// One, as in the paper
    Count,
}

/// Vertex colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Colours {
    /// Grey
    None,
    /// Red for the positive region, blue for the negative
    Region,
    /// From blue through white to red, by label
    Label,
}

fn stretch(text: &str) -> Result<([f64; 3], f64), String> {
    let numbers: Result<Vec<f64>, String> = text.split(',').map(crate::values::finite).collect();
    match numbers?[..] {
        [x, y, z, factor] if factor > 0.0 && x.hypot(y).hypot(z) > 0.0 => Ok(([x, y, z], factor)),
        _ => Err("an axis and a factor above zero are needed, such as 0,1,0,4".to_owned()),
    }
}

/// JSON of `stereology displace`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct DisplaceFields {
    /// Triangles that were labelled.
    triangles: usize,
    /// Triangles written, after simplification.
    triangles_written: usize,
    /// Fraction of the triangles for which the distribution had no label left.
    left_over_fraction: f64,
    /// Fraction of the labels that are in another bin than requested.
    misplaced_fraction: f64,
    /// Pairs of labels that differ by more than their distance over the surface.
    violations: usize,
    /// Wasserstein-1 distance of the labels from the distribution, in bins.
    emd_labels: f64,
    /// The same for distances measured on the finished mesh; null if there is only one region.
    emd_measured: Option<f64>,
    /// Bins that could not be filled.
    shortfalls: Vec<ShortfallRow>,
    /// Connected components of the mesh.
    pieces: usize,
    /// Edges with one triangle.
    border_edges: usize,
    /// Edges with more than two triangles.
    crowded_edges: usize,
    /// Pairs of triangles of the displaced mesh that intersect; counted up to 1000.
    self_intersections: usize,
}

/// A bin that could not be filled.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ShortfallRow {
    /// Bin: 0, 1, ... in the positive region, -1, -2, ... in the negative.
    bin: i64,
    /// Requested fraction of the mesh.
    wanted: f64,
    /// Fraction of the mesh in the bin.
    got: f64,
}

impl Fields for DisplaceFields {
    const COMMAND: &'static str = "displace";
}

impl Displace {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let began = Instant::now();
        let is_glb = ends_in(self.output.name(), "glb");
        if !is_glb {
            MeshFormat::from_path(self.output.name()).or_usage("-o (or .glb)")?;
        }
        if self.colours != Colours::None && !is_glb && !ends_in(self.output.name(), "ply") {
            return Err(Failure::usage("--colours need a file that ends in .glb or .ply"));
        }
        let file = everywhere.outputs.file(&self.output)?;
        let of = |option: &Option<Output>| {
            option
                .as_ref()
                .map(|output| everywhere.outputs.file(output))
                .transpose()
        };
        let (labels_out, design_out) = (of(&self.labels_out)?, of(&self.design_out)?);
        let design = self.choices(everywhere)?;
        let mut mesh = read_mesh(&self.mesh).at(&self.mesh)?;
        mesh.weld();
        if let Some(edge_length) = design.edge_length {
            // A design stores the length in halves of the box side, so that it fits any mesh.
            let scheme = match self.subdivision {
                Scheme::Midpoint => Subdivision::Midpoint,
                Scheme::Loop => Subdivision::Loop,
            };
            let length = self.edge_length.unwrap_or_else(|| edge_length * half_side(&mesh));
            mesh = refined(&mesh, scheme, length).at(&self.mesh)?;
        }
        let step = Step::begin("labels", everywhere.quiet);
        let made = self.labels(&mesh, &design, &|done| step.at(done))?;
        drop(step);
        let displaced = displace(&mesh, &made.labels, &design.negative, &design.positive).at(&self.mesh)?;
        let (mut relief, mut values) = (displaced.mesh, displaced.values);
        if let Some(most) = self.triangles {
            let simple = simplified(&relief, &values, most);
            (relief, values) = (simple.mesh, simple.values);
        }
        crate::progress::go_on()?;
        if let Some(path) = &labels_out {
            write_labels(path, &made.labels)?;
        }
        if let Some(path) = &design_out {
            let mut design = design.clone();
            if let Some(length) = self.edge_length {
                design.edge_length = Some(length / half_side(&mesh));
            }
            write_text(path, &design.to_json())?;
        }
        self.write(
            &file,
            &relief,
            &values,
            design.contact.positive().len().max(1) as f64 * design.contact.bin_width(),
        )?;
        let census = EdgeCensus::of(&mesh);
        let crossings = self_intersections(&relief);
        self.answer(&made, &relief, census, crossings, began)
    }

    /// The settings: the design, overridden by the preset, overridden by the options.
    fn choices(&self, everywhere: &Everywhere) -> Result<Design, Failure> {
        let preset =
            match &self.preset {
                None => None,
                Some(name) => {
                    let all = presets();
                    let names: Vec<&str> = all.iter().map(|preset| preset.name).collect();
                    let names = names.join(", ");
                    let found = all.into_iter().find(|preset| preset.name == name.as_str());
                    Some(found.ok_or_else(|| {
                        Failure::usage(format!("--preset {name} is unknown; the presets are {names}"))
                    })?)
                }
            };
        let mut design = match (&self.design, &self.contact) {
            (Some(path), _) => {
                let text = std::fs::read_to_string(path).at(path)?;
                Design::from_json(&text).at(path)?
            }
            (None, Some(path)) => {
                let offset = |text: &str| text.parse::<Offset>().or_fail();
                let mut design = Design::new(
                    read_contact(path)?,
                    1.0,
                    offset("in,0.02,sqrt")?,
                    offset("out,0.03,sqrt")?,
                );
                design.seed = everywhere.seed;
                design
            }
            (None, None) => return Err(Failure::usage("give --contact FILE or --design JSON")),
        };
        if let (Some(_), Some(path)) = (&self.design, &self.contact) {
            design.contact = read_contact(path)?;
        }
        if let Some(preset) = preset {
            (design.units, design.negative, design.positive) = (preset.units, preset.negative, preset.positive);
        }
        if everywhere.seed != 0 {
            design.seed = everywhere.seed;
        }
        let overrule = |to: &mut Offset, by: &Option<Offset>| {
            if let Some(by) = by {
                *to = by.clone();
            }
        };
        overrule(&mut design.negative, &self.negative);
        overrule(&mut design.positive, &self.positive);
        design.units = self.units.unwrap_or(design.units);
        design.edge_length = self.edge_length.or(design.edge_length);
        design.stretch = self.stretch.or(design.stretch);
        match self.method {
            Some(MethodArgument::Tight) => design.method = Method::Tight,
            Some(MethodArgument::Paper) => design.method = Method::Paper,
            None => {}
        }
        Ok(design)
    }

    fn labels(
        &self,
        mesh: &TriangleMesh,
        design: &Design,
        progress: &(dyn Fn(f64) -> std::ops::ControlFlow<()> + Sync),
    ) -> Result<Reconstruction, Failure> {
        let scaled = to_distribution_units(mesh, design.units).at(&self.mesh)?;
        let mut options = ReconstructOptions::default()
            .with_method(design.method)
            .with_seed(design.seed);
        options.weighting = self.weight.map(|weight| match weight {
            Weight::Area => Weighting::Area,
            Weight::Count => Weighting::Count,
        });
        if let Some((axis, factor)) = design.stretch {
            options.metric = Metric::along(axis.into(), factor).or_usage("--stretch")?;
        }
        reconstruct(&scaled, &design.contact, &options, progress).map_err(|error| match error {
            MicrogeometryError::Cancelled => Failure::stopped(),
            error => Failure::run(format!("{}: {error}", self.mesh.display())),
        })
    }

    fn write(&self, file: &Path, relief: &TriangleMesh, values: &[f64], far: f64) -> Result<(), Failure> {
        if self.colours == Colours::None && !ends_in(self.output.name(), "glb") {
            return write_mesh(file, relief).at(file);
        }
        let coloured = ColouredMesh {
            normals: corner_normals(relief),
            colours: values.iter().map(|&x| self.colours.of(x, far)).collect(),
            mesh: relief.clone(),
        };
        write_coloured_mesh(file, &coloured).at(file)
    }

    fn answer(
        &self,
        made: &Reconstruction,
        relief: &TriangleMesh,
        census: EdgeCensus,
        crossings: usize,
        began: Instant,
    ) -> Result<Answer, Failure> {
        let shortfalls = made.shortfalls.iter().map(|short| ShortfallRow {
            bin: short.bin,
            wanted: short.wanted,
            got: short.got,
        });
        let fields = DisplaceFields {
            triangles: made.labels.len(),
            triangles_written: relief.triangles.len(),
            left_over_fraction: made.left_over,
            misplaced_fraction: made.misplaced,
            violations: made.violations,
            emd_labels: made.emd_labels,
            emd_measured: made.emd_measured,
            shortfalls: shortfalls.collect(),
            pieces: made.components,
            border_edges: census.border,
            crowded_edges: census.crowded,
            self_intersections: crossings,
        };
        let mut notes = Notes::default();
        notes
            .seconds(began.elapsed().as_secs_f64())
            .line(format!(
                "{} triangles labelled, {:.2} % of them after all labels of the distribution were used; {:.2} % of the labels are in another bin than requested",
                counted(made.labels.len() as u64),
                100.0 * made.left_over,
                100.0 * made.misplaced
            ))
            .line(format!(
                "distance from the distribution in bins: {:.3} for the labels, {}",
                made.emd_labels,
                made.emd_measured.map_or_else(
                    || "not measurable on the mesh, which has one region only".to_owned(),
                    |emd| format!("{emd:.3} measured on the mesh")
                ),
            ))
            .line(format!(
                "{} triangles written to {}",
                counted(relief.triangles.len() as u64),
                self.output.display()
            ));
        if census.border > 0 {
            notes.line(format!(
                "the mesh is open: {} edges have one triangle, where distances end",
                counted(census.border as u64)
            ));
        }
        if made.components > 1 {
            notes.line(format!(
                "{} connected components, each with its part of the distribution",
                made.components
            ));
        }
        if census.crowded > 0 {
            notes.warn(Warning::new(
                "crowded-edges",
                format!("{} edges have more than two triangles", census.crowded),
            ));
        }
        if crossings > 0 {
            let at_least = if crossings >= 1000 { "at least " } else { "" };
            notes.warn(Warning::new(
                "sharp-relief",
                format!("{at_least}{crossings} pairs of triangles of the displaced mesh intersect"),
            ));
        }
        if made.misplaced > WARN_MISPLACED {
            notes.warn(Warning::new(
                "unrealisable-distribution",
                format!(
                    "{:.1} % of the labels are not in the bins that the distribution requires; the first bin that could not be filled is bin {}",
                    100.0 * made.misplaced,
                    made.shortfalls.first().map_or(0, |short| short.bin)
                ),
            ));
        }
        Answer::new(&fields, notes)
    }
}

/// Fraction of labels in other bins above which there is a warning.
const WARN_MISPLACED: f64 = 0.02;

impl Colours {
    /// Colour of a vertex with value `x`; `far` is the largest distance from the interface.
    fn of(self, x: f64, far: f64) -> [f32; 4] {
        let share = (x.abs() / far).sqrt().min(1.0) as f32;
        let [r, g, b] = match (self, x < 0.0) {
            (Self::None, _) => [0.75, 0.73, 0.7],
            (Self::Region, true) => [0.22, 0.36, 0.62],
            (Self::Region, false) => [0.78, 0.3, 0.22],
            (Self::Label, true) => [1.0 - 0.8 * share, 1.0 - 0.65 * share, 1.0 - 0.3 * share],
            (Self::Label, false) => [1.0 - 0.2 * share, 1.0 - 0.8 * share, 1.0 - 0.85 * share],
        };
        [r, g, b, 1.0]
    }
}

fn ends_in(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|of| of.eq_ignore_ascii_case(ending))
}

/// Half the longest side of the bounding box; 1 for a mesh without extent, which is refused later.
fn half_side(mesh: &TriangleMesh) -> f64 {
    let side = mesh.bounding_box().map_or(0.0, |(low, high)| (high - low).max());
    if side > 0.0 { 0.5 * side } else { 1.0 }
}

fn write_labels(path: &Path, labels: &[f64]) -> Result<(), Failure> {
    write_atomically(path, |out| {
        writeln!(out, "triangle,label")?;
        for (triangle, label) in labels.iter().enumerate() {
            writeln!(out, "{triangle},{label}")?;
        }
        Ok(())
    })
    .at(path)
}
