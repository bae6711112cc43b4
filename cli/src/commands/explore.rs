//! `stereology explore`: a gallery of random reliefs on one mesh.

use std::fs;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use clap::Args;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use stereology::microgeometry::{
    Design, EdgeCensus, Exploration, Metric, Offset, ReconstructOptions, displace, reconstruct, refined,
    to_distribution_units,
};
use stereology::render::{Camera, RenderOptions, render_mesh};
use stereology::shape::{Subdivision, TriangleMesh, read_mesh};
use stereology_report::{Candidate, Displacement, Gallery, Histogram};

use crate::answer::{Answer, Fields, Notes};
use crate::commands::contact::read_contact;
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::{Output, OutputFolder, write_json, write_png, write_text};
use crate::progress::{Step, go_on};
use crate::values::{count, positive};

/// Generates many random reliefs on one mesh and shows them in a gallery
///
/// The contact distribution, the units, and the directions, scales and functions of the displacements are drawn at
/// random within ranges; options fix them. DIR/index.html is a web page that shows an image of each candidate with its
/// parameters and can filter and sort them. DIR/designs holds a design of each for `stereology displace MESH --design`.
/// --near searches in the neighbourhood of one design.
#[derive(Args, Debug)]
#[command(
    after_long_help = "Examples: stereology explore bust.obj --count 500 -o gallery\n          stereology explore bust.obj --count 48 --near gallery/designs/0042.json --spread 0.2 -o closer\n          stereology explore bust.obj --count 100 --contact gravel.json --units 30,60 -o gravels"
)]
pub struct Explore {
    /// Mesh to displace
    #[arg(value_name = "MESH")]
    pub mesh: PathBuf,
    /// Number of candidates
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = count)]
    pub count: usize,
    /// Contact distribution of all candidates
    #[arg(long, value_name = "FILE")]
    pub contact: Option<PathBuf>,
    /// Range of the units: half the longest side of the bounding box, in units of the distribution
    #[arg(long, value_name = "LOW,HIGH", value_parser = range)]
    pub units: Option<[f64; 2]>,
    /// Range of the typical distances to the interface, in bins
    #[arg(long, value_name = "LOW,HIGH", value_parser = range)]
    pub lengths: Option<[f64; 2]>,
    /// Range of the fraction of the positive region
    #[arg(long, value_name = "LOW,HIGH", value_parser = range)]
    pub shares: Option<[f64; 2]>,
    /// Range of the scale k for the function sqrt; a third of it is used for x
    #[arg(long, value_name = "LOW,HIGH", value_parser = range)]
    pub scales: Option<[f64; 2]>,
    /// Displacement of the negative region in all candidates
    #[arg(long, value_name = "S,K,F", allow_hyphen_values = true)]
    pub negative: Option<Offset>,
    /// Displacement of the positive region in all candidates
    #[arg(long, value_name = "S,K,F", allow_hyphen_values = true)]
    pub positive: Option<Offset>,
    /// Search in the neighbourhood of this design
    #[arg(long, value_name = "JSON")]
    pub near: Option<PathBuf>,
    /// Size of the neighbourhood: parameters are multiplied by up to exp(SPREAD)
    #[arg(long, value_name = "SPREAD", default_value_t = 0.25, value_parser = positive, requires = "near")]
    pub spread: f64,
    /// Subdivide triangles until no edge is longer than this, in units of the mesh
    #[arg(long, value_name = "E", value_parser = positive)]
    pub edge_length: Option<f64>,
    /// Side of an image in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 240, value_parser = clap::value_parser!(u32).range(32..=1024))]
    pub pixels: u32,
    /// Direction of the camera: azimuth and elevation in degrees
    #[arg(long, value_name = "AZIMUTH,ELEVATION", default_value = "30,20", value_parser = crate::values::pair, allow_hyphen_values = true)]
    pub view: [f32; 2],
    /// Folder for the gallery
    #[arg(short, long, value_name = "DIR")]
    pub output: Output,
}

fn range(text: &str) -> Result<[f64; 2], String> {
    let ends: Result<Vec<f64>, String> = text.split(',').map(positive).collect();
    match ends?[..] {
        [low, high] if low <= high => Ok([low, high]),
        _ => Err("a range is needed, the lower end first, such as 30,60".to_owned()),
    }
}

/// JSON of `stereology explore`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ExploreFields {
    /// Number of candidates.
    candidates: usize,
    /// Triangles of the mesh, after subdivision.
    triangles: usize,
    /// Edges with one triangle.
    border_edges: usize,
    /// Mean Wasserstein-1 distance of the labels from the distribution, in bins.
    mean_emd_labels: f64,
    /// The same for distances measured on the meshes.
    mean_emd_measured: f64,
    /// Ranges from which the parameters were drawn.
    ranges: Ranges,
}

impl Fields for ExploreFields {
    const COMMAND: &'static str = "explore";
}

/// Ranges from which the parameters of the candidates are drawn.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Ranges {
    /// Half the longest side of the bounding box, in units of the distribution.
    units: [f64; 2],
    /// Typical distances to the interface, in bins.
    lengths: [f64; 2],
    /// Fraction of the positive region.
    shares: [f64; 2],
    /// Scale of the displacement.
    scales: [f64; 2],
    /// Whether the contact distribution was given or drawn.
    contact: &'static str,
    /// Displacement of the negative region, if it was given.
    negative: Option<String>,
    /// Displacement of the positive region, if it was given.
    positive: Option<String>,
    /// Size of the neighbourhood of a design, if one was given.
    spread: Option<f64>,
}

impl Explore {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let began = Instant::now();
        let exploration = self.exploration()?;
        exploration.check().or_usage("--units, --lengths, --shares, --scales")?;
        let near = match &self.near {
            Some(path) => {
                let text = fs::read_to_string(path).at(path)?;
                Some(Design::from_json(&text).at(path)?)
            }
            None => None,
        };
        let folder = everywhere.outputs.folder(&self.output)?;
        let mut mesh = read_mesh(&self.mesh).at(&self.mesh)?;
        mesh.weld();
        if let Some(length) = self.edge_length {
            mesh = refined(&mesh, Subdivision::Midpoint, length).at(&self.mesh)?;
        }
        let half = to_half_side(&mesh);
        for part in ["designs", "pictures"] {
            let place = folder.file(part);
            fs::create_dir_all(&place).at(&place)?;
        }
        let step = Step::begin("candidates", everywhere.quiet);
        let done = AtomicUsize::new(0);
        let candidates: Vec<Candidate> = (1..=self.count)
            .into_par_iter()
            .map(|number| {
                let mut design = match &near {
                    Some(near) => exploration.near(near, self.spread, everywhere.seed, number as u64),
                    None => exploration.design(everywhere.seed, number as u64),
                }
                .or_usage("--near, --spread")?;
                if let Some(length) = self.edge_length {
                    design.edge_length = Some(length / half);
                }
                let row = self.candidate(&mesh, &design, number, &folder)?;
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                if step.at(done as f64 / self.count as f64).is_break() {
                    return Err(Failure::stopped());
                }
                Ok(row)
            })
            .collect::<Result<_, Failure>>()?;
        drop(step);
        let name = self
            .mesh
            .file_name()
            .map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let ranges = ranges(&exploration, near.is_some().then_some(self.spread));
        let mean = |of: fn(&Candidate) -> Option<f64>| {
            candidates.iter().filter_map(of).sum::<f64>() / candidates.len().max(1) as f64
        };
        let fields = ExploreFields {
            candidates: candidates.len(),
            triangles: mesh.triangles.len(),
            border_edges: EdgeCensus::of(&mesh).border,
            mean_emd_labels: mean(|of| Some(of.emd_labels)),
            mean_emd_measured: mean(|of| of.emd_measured),
            ranges: ranges.clone(),
        };
        let gallery = Gallery {
            mesh: name,
            triangles: mesh.triangles.len(),
            seed: everywhere.seed,
            command: everywhere.invocation.command.clone(),
            ranges,
            candidates,
        };
        write_text(&folder.file("index.html"), &gallery.page().or_fail()?)?;
        let mut answer = Answer::new(&fields, Notes::default())?;
        write_json(&folder.file("summary.json"), &answer.summary())?;
        go_on()?;
        answer.notes.seconds(began.elapsed().as_secs_f64()).line(format!(
            "{} candidates: open {}",
            self.count,
            self.output.name().join("index.html").display()
        ));
        Ok(answer)
    }

    fn exploration(&self) -> Result<Exploration, Failure> {
        let usual = Exploration::default();
        Ok(Exploration {
            contact: self.contact.as_deref().map(read_contact).transpose()?,
            units: self.units.unwrap_or(usual.units),
            lengths: self.lengths.unwrap_or(usual.lengths),
            shares: self.shares.unwrap_or(usual.shares),
            scales: self.scales.unwrap_or(usual.scales),
            negative: self.negative.clone(),
            positive: self.positive.clone(),
        })
    }

    /// Generates one candidate: its design, its image and its row of the table.
    fn candidate(
        &self,
        mesh: &TriangleMesh,
        design: &Design,
        number: usize,
        folder: &OutputFolder,
    ) -> Result<Candidate, Failure> {
        let scaled = to_distribution_units(mesh, design.units).at(&self.mesh)?;
        let mut options = ReconstructOptions::default()
            .with_method(design.method)
            .with_seed(design.seed);
        if let Some((axis, factor)) = design.stretch {
            options.metric = Metric::along(axis.into(), factor).or_fail()?;
        }
        let made = reconstruct(&scaled, &design.contact, &options, &|_| ControlFlow::Continue(())).at(&self.mesh)?;
        let relief = displace(mesh, &made.labels, &design.negative, &design.positive)
            .at(&self.mesh)?
            .mesh;
        let heights = relief
            .vertices
            .iter()
            .zip(&mesh.vertices)
            .map(|(a, b)| (a - b).norm_squared());
        let roughness = (heights.sum::<f64>() / mesh.vertices.len().max(1) as f64).sqrt() / to_half_side(mesh);
        let camera = Camera {
            azimuth: f64::from(self.view[0]),
            elevation: f64::from(self.view[1]),
            ..Camera::default()
        };
        let picture = RenderOptions {
            ground: false,
            gloss: 0.15,
            ..RenderOptions::default()
                .with_size(self.pixels, self.pixels)
                .with_samples(2)
        };
        let clay = |_: &nalgebra::Point3<f64>| [0.78_f32, 0.7, 0.6];
        let picture = render_mesh(&relief, &clay, &camera, &picture).at(&self.mesh)?;
        let name = format!("{number:04}");
        write_png(&folder.file(&format!("pictures/{name}.png")), &picture)?;
        write_text(&folder.file(&format!("designs/{name}.json")), &design.to_json())?;
        let displacement = |of: &Offset| Displacement {
            direction: of.direction.name(),
            scale: of.scale,
            profile: of.profile.to_string(),
        };
        let digits = |x: f64| (x * 1e4).round() / 1e4;
        let rounded = |fractions: &[f64]| fractions.iter().map(|&fraction| digits(fraction)).collect();
        Ok(Candidate {
            name,
            units: digits(design.units),
            positive_share: digits(design.contact.positive_share()),
            mean_distance: digits(mean_distance(design)),
            negative: displacement(&design.negative),
            positive: displacement(&design.positive),
            roughness: digits(roughness),
            emd_labels: digits(made.emd_labels),
            emd_measured: made.emd_measured.map(digits),
            misplaced: digits(made.misplaced),
            histogram: Histogram {
                negative: rounded(design.contact.negative()),
                positive: rounded(design.contact.positive()),
            },
        })
    }
}

fn ranges(of: &Exploration, spread: Option<f64>) -> Ranges {
    Ranges {
        units: of.units,
        lengths: of.lengths,
        shares: of.shares,
        scales: of.scales,
        contact: if of.contact.is_some() { "given" } else { "drawn" },
        negative: of.negative.as_ref().map(ToString::to_string),
        positive: of.positive.as_ref().map(ToString::to_string),
        spread,
    }
}

/// Mean distance to the interface, in units of the distribution.
fn mean_distance(design: &Design) -> f64 {
    let of = |shares: &[f64]| -> f64 {
        shares
            .iter()
            .enumerate()
            .map(|(k, share)| (k as f64 + 0.5) * share)
            .sum()
    };
    design.contact.bin_width() * (of(design.contact.negative()) + of(design.contact.positive()))
}

fn to_half_side(mesh: &TriangleMesh) -> f64 {
    let side = mesh.bounding_box().map_or(0.0, |(low, high)| (high - low).max());
    if side > 0.0 { 0.5 * side } else { 1.0 }
}
