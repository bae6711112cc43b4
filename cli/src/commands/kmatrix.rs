//! `stereology kmatrix`: the section law of a body.

use clap::{Args, ValueEnum};
use serde_json::json;
use stereology::kmatrix::{
    LargestArea, MonteCarloOptions, SectionLaw, SectionOptions, Sizes, Slicing, condition_number, geometric_classes,
};
use stereology::shape::Body;

use super::shape::tell_repairs;
use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::{Explain, Failure, body_welding};
use crate::numbers::significant;
use crate::progress::Step;
use crate::values::{bins, count, positive};
use crate::warnings::Warning;

/// Random sections beyond which a tolerance is out of reach of --method monte-carlo.
const MOST_SECTIONS: f64 = 2e7;

/// How often a random plane shows a body of each size as a profile of each size
///
/// Cuts SHAPE by isotropic uniform random planes and tells the law of the profile sizes: the K matrix of the paper (eq. 5), the mean caliper and the
/// largest section. Spheres and ellipsoids have closed forms; for meshes the areas are exact in depth for each direction, and an error bar tells what the
/// finite number of directions leaves open. SHAPE is `sphere`, `ellipsoid:A,B,C`, `box:A,B,C`, `cylinder:D,L`, `rock:SEED` or a closed mesh (.obj, .stl,
/// .ply); what `stereology shape` takes as SPEC is one too. An open mesh, or one that cuts through itself, is refused.
///
/// Row i, column j of `matrix`: relative to one plane hit by a particle of the largest size, how many profiles of bin i a particle at the upper edge of
/// bin j shows. Column j sums to j/N.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology kmatrix box:1,1,2 --bins 10 --tolerance 0.001 --json")]
pub struct Kmatrix {
    /// Body: sphere, ellipsoid:A,B,C, box:A,B,C, cylinder:D,L, rock:SEED or a mesh file
    pub shape: String,
    /// Number of profile bins, and of size bins
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = bins)]
    pub bins: usize,
    /// Largest standard error of the matrix to stop at [default: 0.001]
    #[arg(long, value_name = "T", value_parser = positive, conflicts_with = "directions")]
    pub tolerance: Option<f64>,
    /// Number of directions (with monte-carlo: of sections), instead of a tolerance
    #[arg(long, value_name = "N", value_parser = count)]
    pub directions: Option<usize>,
    /// Exact in depth for each direction, or the paper's random sections
    #[arg(long, value_enum, default_value_t = Method::Exact)]
    pub method: Method,
    /// The paper's normalisation, `caliper` = mean caliper of the hull: counts one profile a hit (the same for convex bodies). `paper` compares both
    #[arg(long)]
    pub paper: bool,
    /// Pixels along a side of the picture of --method raster
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u16).range(8..=4096))]
    pub resolution: u16,
    /// Join vertices of a mesh file that are nearer than this to each other, in its units
    #[arg(long, value_name = "DISTANCE", value_parser = positive)]
    pub weld: Option<f64>,
}

/// How the section law is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Exact in depth for each of many directions
    Exact,
    /// 100,000 random sections, as in the paper, cut as polygons
    MonteCarlo,
    /// 100,000 random sections as the paper cut them: drawn, pixels covered an odd number of times inside, the largest area met for A_max
    Raster,
}

impl Kmatrix {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let body = body_welding(&self.shape, self.weld)?;
        let law = self.law(&body, everywhere)?;
        let matrix = law.k_matrix(self.bins);
        let rows: Vec<Vec<f64>> = matrix.row_iter().map(|row| row.iter().copied().collect()).collect();
        let x: Vec<f64> = (1..=100).map(|i| f64::from(i) / 100.0).collect();
        let f: Vec<f64> = x.iter().map(|&x| law.cdf(x)).collect();
        let standard_error = law.standard_error(self.bins);
        let caliper = if self.paper {
            law.caliper_hull()
        } else {
            law.caliper_effective()
        };
        let mesh = body.mesh();

        let mut answer = Answer::new("kmatrix");
        answer
            .field("shape", self.shape.as_str())
            .field("triangles", mesh.map(|mesh| mesh.triangles().len()))
            .field("volume", law.volume())
            .field("surface_area", law.surface_area())
            .field("caliper_hull", law.caliper_hull())
            .field("caliper_effective", law.caliper_effective())
            .field("caliper_chi", law.caliper_chi())
            .field("caliper_holes", law.caliper_holes())
            .field(
                "caliper_effective_standard_error",
                law.caliper_effective_standard_error(),
            )
            .field("profiles_per_hit", law.profiles_per_hit())
            .field("max_area", law.max_area())
            .field("mean_area", law.mean_profile_area())
            .field("mean_square_area", law.mean_square_profile_area())
            .field("mean_section_area", law.mean_section_area())
            .field("mean_square_section_area", law.mean_square_section_area())
            .field("self_energy", law.self_energy())
            .field("normalisation", if self.paper { "paper" } else { "profiles" })
            .field("caliper", caliper)
            .field(
                "paper",
                self.paper.then(|| {
                    json!({
                        "caliper": law.caliper_hull(),
                        "caliper_of_profiles": law.caliper_effective(),
                        "densities_too_large_by": law.profiles_per_hit(),
                    })
                }),
            )
            .field(
                "condition_numbers",
                json!({
                    "equal_diameters": condition_number(&matrix),
                    "saltikov_areas": saltikov_condition(&law, self.bins),
                }),
            )
            .field("bins", self.bins)
            .field("matrix", rows.clone())
            .field("standard_error", standard_error)
            .field("cdf", json!({ "x": x, "f": f }))
            .field("directions", law.directions())
            .field("rotations", law.rotations());
        tell_repairs(&self.shape, &body, &mut answer);
        self.warn(&body, &law, &mut answer);
        self.describe(&law, &rows, &mut answer);
        Ok(answer)
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
                    // The error falls with the root of the number of sections; a little more, so that once is mostly enough.
                    let needed = 1.1 * options.iterations as f64 * (reached / asked).powi(2);
                    if needed > MOST_SECTIONS {
                        return Err(Failure::run(format!(
                            "--tolerance {asked} would need about {needed:.0} random sections; take a larger tolerance, or --method exact"
                        )));
                    }
                    options = options.with_iterations(needed.ceil() as usize);
                }
            }
        }
    }

    fn warn(&self, body: &Body, law: &SectionLaw, answer: &mut Answer) {
        if self.method == Method::Exact && law.chi_discrepancy() > 6.1 && body.mesh().is_some() {
            answer.warn(Warning::new(
                "self-intersection",
                format!("{}: sections show another number of profiles than the surface's curvature says; the mesh probably cuts through itself", self.shape),
            ));
        }
        if self.paper && (law.profiles_per_hit() - 1.0).abs() > 0.005 {
            answer.warn(Warning::new(
                "paper-normalisation",
                format!(
                    "a plane that hits this body shows {} profiles on average; the paper's normalisation counts one, so densities come out that much too large",
                    significant(law.profiles_per_hit())
                ),
            ));
        }
    }

    fn describe(&self, law: &SectionLaw, rows: &[Vec<f64>], answer: &mut Answer) {
        answer
            .line(format!(
                "{}: volume {}, surface {}",
                self.shape,
                significant(law.volume()),
                significant(law.surface_area())
            ))
            .line(format!(
                "mean caliper {} (effective {}), {} profiles a hit, largest section {}",
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
                "K, {} profile bins down, size bins across (x 1000):",
                self.bins
            ));
        for row in rows {
            let cells: Vec<String> = row.iter().map(|k| format!("{:5.0}", 1000.0 * k)).collect();
            answer.line(cells.join(" "));
        }
    }
}

/// Condition number of the kernel of Saltikov's geometric classes; none if it cannot be inverted.
fn saltikov_condition(law: &SectionLaw, classes: usize) -> Option<f64> {
    let edges: Vec<f64> = geometric_classes(classes);
    let kernel = law.kernel(&edges, &edges, Sizes::UpperEdge).ok()?;
    Some(condition_number(&kernel)).filter(|number| number.is_finite())
}
