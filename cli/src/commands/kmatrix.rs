//! `stereology kmatrix`: the distribution of the profile sizes of a body.

use std::ffi::OsString;

use clap::{Args, ValueEnum};
use schemars::JsonSchema;
use serde::Serialize;
use stereology::kmatrix::{
    LargestArea, MonteCarloOptions, SectionLaw, SectionOptions, Sizes, Slicing, condition_number, geometric_classes,
};
use stereology::shape::Body;

use crate::answer::{Answer, Fields, Notes};
use crate::commands::shape::repairs;
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure, body_of};
use crate::progress::Step;
use crate::values::{bins, count, positive};
use crate::warnings::Warning;
use stereology_report::significant;

/// Largest number of random sections that --method monte-carlo draws to reach a tolerance.
const MOST_SECTIONS: f64 = 2e7;

/// Computes which profile sizes random sections through a particle give
///
/// Sections SHAPE with isotropic uniform random planes and reports the distribution of the profile sizes: the K matrix
/// of the paper (eq. 5), the mean caliper and the largest section. Spheres and ellipsoids have closed forms. For meshes
/// the areas are integrated exactly over depth for each direction, and the standard error reports the effect of the
/// finite number of directions. SHAPE is `sphere`, `ellipsoid:A,B,C`, `box:A,B,C`, `cylinder:D,L`, `rock:SEED`, a
/// closed mesh (.obj, .stl, .ply) or any SPEC of `stereology shape`. An open or self-intersecting mesh is refused.
///
/// Element (i, j) of `matrix` is the expected number of profiles in bin i from a particle at the upper edge of size bin
/// j, per plane that hits a particle of the largest size. Column j sums to j/N.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology kmatrix box:1,1,2 --bins 10 --tolerance 0.001 --json")]
pub struct Kmatrix {
    /// Particle shape: sphere, ellipsoid:A,B,C, box:A,B,C, cylinder:D,L, rock:SEED or a mesh file
    pub shape: OsString,
    /// Number of profile bins, and of size bins
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = bins)]
    pub bins: usize,
    /// Stop when the largest standard error of the matrix is at most this [default: 0.001]
    #[arg(long, value_name = "T", value_parser = positive, conflicts_with = "directions")]
    pub tolerance: Option<f64>,
    /// Number of directions (monte-carlo and raster: of sections), instead of a tolerance
    #[arg(long, value_name = "N", value_parser = count)]
    pub directions: Option<usize>,
    /// How the distribution of profile sizes is computed
    #[arg(long, value_enum, default_value_t = Method::Exact)]
    pub method: Method,
    /// Use the paper's normalisation: `caliper` is the mean caliper of the hull, which assumes one profile per
    /// intersecting plane (true for convex bodies); `paper` in the JSON compares both
    #[arg(long)]
    pub paper: bool,
    /// Pixels along a side of the image of --method raster
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u16).range(8..=4096))]
    pub resolution: u16,
    /// Merge vertices of a mesh file that are closer than this, in units of the mesh
    #[arg(long, value_name = "DISTANCE", value_parser = positive)]
    pub weld: Option<f64>,
}

/// How the distribution of profile sizes is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Integrate exactly over depth for each of many directions
    Exact,
    /// 100,000 random sections, as in the paper, with polygonal profiles
    MonteCarlo,
    /// 100,000 random sections as in the paper: rasterised, filled by the even-odd rule, with the largest area found as
    /// A_max
    Raster,
}

/// JSON of `stereology kmatrix`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct KmatrixFields {
    /// Description of the shape, as on the command line.
    shape: String,
    /// Triangles of the mesh; null for spheres and ellipsoids.
    triangles: Option<usize>,
    /// Volume of the body.
    volume: f64,
    /// Surface area of the body.
    surface_area: f64,
    /// Mean caliper (mean width) of the convex hull.
    caliper_hull: f64,
    /// Mean caliper times profiles per intersecting plane: profiles per area over particles per volume.
    caliper_effective: f64,
    /// Mean number of profiles minus holes, as a length, from the signed edge angles of the mesh.
    caliper_chi: f64,
    /// Mean number of holes, as a length: caliper_effective - caliper_chi.
    caliper_holes: f64,
    /// Standard error of `caliper_effective`.
    caliper_effective_standard_error: f64,
    /// Mean number of profiles per plane that intersects the body.
    profiles_per_hit: f64,
    /// Area of the largest section.
    max_area: f64,
    /// Mean area of a profile.
    mean_area: f64,
    /// Mean square of the area of a profile.
    mean_square_area: f64,
    /// Mean area of a section, all its profiles together.
    mean_section_area: f64,
    /// Mean square of the area of a section.
    mean_square_section_area: f64,
    /// Self-energy: half the integral of 1 / |x - y| over pairs of points of the body.
    self_energy: f64,
    /// How `caliper` is normalised: profiles, or paper.
    normalisation: &'static str,
    /// The caliper that relates profiles per area to particles per volume.
    caliper: f64,
    /// Both normalisations, with --paper.
    paper: Option<PaperNormalisation>,
    /// Condition numbers of kernels with this many bins.
    condition_numbers: ConditionNumbers,
    /// Number of bins.
    bins: usize,
    /// K: rows are profile bins, columns size bins; column j sums to j/N.
    matrix: Vec<Vec<f64>>,
    /// Largest standard error of an element of the matrix.
    standard_error: f64,
    /// Distribution function of relative profile sizes.
    cdf: Cdf,
    /// Number of directions; 0 for closed forms.
    directions: usize,
    /// Number of random rotations of the set of directions.
    rotations: usize,
    /// What was repaired in the mesh.
    repairs: Vec<String>,
}

/// The paper's normalisation beside the one by profiles.
#[derive(Debug, Serialize, JsonSchema)]
pub struct PaperNormalisation {
    /// Mean caliper of the hull.
    caliper: f64,
    /// Mean caliper times profiles per intersecting plane.
    caliper_of_profiles: f64,
    /// Factor by which the paper's normalisation overestimates densities.
    densities_too_large_by: f64,
}

/// Condition numbers of two kernels.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ConditionNumbers {
    /// Bins of equal width in diameter.
    equal_diameters: f64,
    /// Saltikov's geometric classes of area; null if the kernel is singular.
    saltikov_areas: Option<f64>,
}

/// A distribution function in 100 points.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Cdf {
    /// Profile size over particle size.
    x: Vec<f64>,
    /// Fraction of profiles up to this size.
    f: Vec<f64>,
}

impl Fields for KmatrixFields {
    const COMMAND: &'static str = "kmatrix";
}

impl Kmatrix {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let body = body_of(&self.shape, self.weld)?;
        let law = self.law(&body, everywhere)?;
        let matrix = law.k_matrix(self.bins);
        let rows: Vec<Vec<f64>> = matrix.row_iter().map(|row| row.iter().copied().collect()).collect();
        let x: Vec<f64> = (1..=100).map(|i| f64::from(i) / 100.0).collect();
        let f: Vec<f64> = x.iter().map(|&x| law.cdf(x)).collect();
        let caliper = if self.paper {
            law.caliper_hull()
        } else {
            law.caliper_effective()
        };
        let mesh = body.mesh();

        let mut notes = Notes::default();
        let repairs = repairs(&self.shape.to_string_lossy(), &body, &mut notes);
        self.warn(&body, &law, &mut notes);
        self.describe(&law, &rows, &mut notes);
        let fields = KmatrixFields {
            shape: self.shape.display().to_string(),
            triangles: mesh.map(|mesh| mesh.triangles().len()),
            volume: law.volume(),
            surface_area: law.surface_area(),
            caliper_hull: law.caliper_hull(),
            caliper_effective: law.caliper_effective(),
            caliper_chi: law.caliper_chi(),
            caliper_holes: law.caliper_holes(),
            caliper_effective_standard_error: law.caliper_effective_standard_error(),
            profiles_per_hit: law.profiles_per_hit(),
            max_area: law.max_area(),
            mean_area: law.mean_profile_area(),
            mean_square_area: law.mean_square_profile_area(),
            mean_section_area: law.mean_section_area(),
            mean_square_section_area: law.mean_square_section_area(),
            self_energy: law.self_energy(),
            normalisation: if self.paper { "paper" } else { "profiles" },
            caliper,
            paper: self.paper.then(|| PaperNormalisation {
                caliper: law.caliper_hull(),
                caliper_of_profiles: law.caliper_effective(),
                densities_too_large_by: law.profiles_per_hit(),
            }),
            condition_numbers: ConditionNumbers {
                equal_diameters: condition_number(&matrix),
                saltikov_areas: saltikov_condition(&law, self.bins),
            },
            bins: self.bins,
            matrix: rows,
            standard_error: law.standard_error(self.bins),
            cdf: Cdf { x, f },
            directions: law.directions(),
            rotations: law.rotations(),
            repairs,
        };
        Answer::new(&fields, notes)
    }

    fn law(&self, body: &Body, everywhere: &Everywhere) -> Result<SectionLaw, Failure> {
        let step = Step::begin("sections", everywhere.quiet);
        let progress = |done: f64| step.at(done);
        match self.method {
            Method::Exact => {
                let options = SectionOptions::default()
                    .with_bins(self.bins)
                    .with_seed(everywhere.seed);
                let options = match (self.directions, self.tolerance) {
                    (Some(directions), _) => options.with_directions(directions),
                    (None, tolerance) => options.with_tolerance(tolerance.unwrap_or(1e-3)),
                };
                SectionLaw::of_body_with_progress(body, &options, &progress).or_fail()
            }
            Method::MonteCarlo | Method::Raster => {
                let mut options = MonteCarloOptions::default().with_seed(everywhere.seed);
                if self.method == Method::Raster {
                    let resolution = usize::from(self.resolution);
                    options = options
                        .with_slicing(Slicing::Raster { resolution })
                        .with_largest(LargestArea::Encountered);
                }
                if let Some(sections) = self.directions {
                    options = options.with_iterations(sections);
                }
                loop {
                    let law = SectionLaw::monte_carlo_with_progress(body, &options, &progress).or_fail()?;
                    let (reached, asked) = (law.standard_error(self.bins), self.tolerance.unwrap_or(f64::INFINITY));
                    if reached <= asked {
                        return Ok(law);
                    }
                    // The error falls with the square root of the number of sections; 10 % more makes one further run
                    // enough in most cases.
                    let needed = 1.1 * options.iterations as f64 * (reached / asked).powi(2);
                    if needed > MOST_SECTIONS {
                        return Err(Failure::run(format!(
                            "--tolerance {asked} would need about {needed:.0} random sections; use a larger tolerance, or --method exact"
                        )));
                    }
                    options = options.with_iterations(needed.ceil() as usize);
                }
            }
        }
    }

    fn warn(&self, body: &Body, law: &SectionLaw, notes: &mut Notes) {
        if self.method == Method::Exact && law.chi_discrepancy() > 6.1 && body.mesh().is_some() {
            notes.warn(Warning::new(
                "self-intersection",
                format!(
                    "{}: the number of profiles on sections disagrees with the curvature of the surface; the mesh probably intersects itself",
                    self.shape.display()
                ),
            ));
        }
        if self.paper && (law.profiles_per_hit() - 1.0).abs() > 0.005 {
            notes.warn(Warning::new(
                "paper-normalisation",
                format!(
                    "a plane that intersects this body shows {} profiles on average; the paper's normalisation assumes one, which overestimates densities by this factor",
                    significant(law.profiles_per_hit())
                ),
            ));
        }
    }

    fn describe(&self, law: &SectionLaw, rows: &[Vec<f64>], notes: &mut Notes) {
        notes
            .line(format!(
                "{}: volume {}, surface area {}",
                self.shape.display(),
                significant(law.volume()),
                significant(law.surface_area())
            ))
            .line(format!(
                "mean caliper {} (effective {}), {} profiles per intersecting plane, largest section {}",
                significant(law.caliper_hull()),
                significant(law.caliper_effective()),
                significant(law.profiles_per_hit()),
                significant(law.max_area())
            ))
            .line(if law.directions() == 0 {
                "closed form".to_owned()
            } else {
                format!(
                    "standard error {} from {} directions",
                    significant(law.standard_error(self.bins)),
                    law.directions()
                )
            })
            .line(format!(
                "K x 1000, {} profile bins (rows) and size bins (columns):",
                self.bins
            ));
        for row in rows {
            let cells: Vec<String> = row.iter().map(|k| format!("{:5.0}", 1000.0 * k)).collect();
            notes.line(cells.join(" "));
        }
    }
}

/// Condition number of the kernel of Saltikov's geometric classes; none if the kernel is singular.
fn saltikov_condition(law: &SectionLaw, classes: usize) -> Option<f64> {
    let edges: Vec<f64> = geometric_classes(classes);
    let kernel = law.kernel(&edges, &edges, Sizes::UpperEdge).ok()?;
    Some(condition_number(&kernel)).filter(|number| number.is_finite())
}
