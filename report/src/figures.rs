//! Content of the report of a synthesis.

use image::RgbImage;
use stereology::pipeline::{OutlineComparison, ResidualSpectra, ShapeDensity, Verdict};

/// A warning with its advice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remark {
    /// Fixed code.
    pub code: String,
    /// What was found.
    pub message: String,
    /// What to do about it.
    pub advice: Option<String>,
}

/// Content of the report of a synthesis: plain numbers and images.
#[derive(Clone, Debug)]
pub struct SynthesisReport {
    /// Name of the photograph, without its folder.
    pub photo_name: String,
    /// Unit of length: `px`, or `units`.
    pub unit: String,
    /// The command that repeats the computation.
    pub command: String,
    /// Every parameter with its value, in the order of the help.
    pub parameters: Vec<(String, String)>,
    /// Warnings of all steps.
    pub remarks: Vec<Remark>,
    /// Whether to trust the result.
    pub verdict: Verdict,
    /// The photograph and its profiles.
    pub photo: PhotoFigures,
    /// Profiles and particles by size.
    pub sizes: SizeFigures,
    /// The packing.
    pub packing: PackingFigures,
    /// The solid compared with the photograph.
    pub comparison: ComparisonFigures,
}

/// What was found in the photograph.
#[derive(Clone, Debug)]
pub struct PhotoFigures {
    /// The photograph.
    pub picture: RgbImage,
    /// The photograph with outlines.
    pub overlay: RgbImage,
    /// Profiles counted by the edge rule.
    pub profiles: u64,
    /// All profiles found.
    pub profiles_found: u64,
    /// Fraction of the area inside profiles.
    pub area_fraction: f64,
    /// Profiles per unit area.
    pub number_per_area: f64,
    /// Colour categories: encoded mean colour 0 to 1, number of profiles, mean profile size.
    pub categories: Vec<CategoryFigures>,
    /// Mean colour of the binder, encoded, 0 to 1.
    pub binder: [f64; 3],
}

/// One colour category.
#[derive(Clone, Copy, Debug)]
pub struct CategoryFigures {
    /// Mean colour, encoded, 0 to 1.
    pub colour: [f64; 3],
    /// Number of profiles.
    pub profiles: u64,
    /// Mean profile size.
    pub mean_size: f64,
}

/// Profiles per area and particles per volume, by size.
#[derive(Clone, Debug)]
pub struct SizeFigures {
    /// Edges of the profile bins.
    pub profile_edges: Vec<f64>,
    /// Profiles counted, by bin (weighted).
    pub observed: Vec<f64>,
    /// Expected profiles of the estimated particles, by bin.
    pub refolded: Vec<f64>,
    /// Edges of the particle size bins.
    pub particle_edges: Vec<f64>,
    /// Particles per unit volume, by bin; `None` below the detection limit.
    pub number_density: Vec<Option<f64>>,
    /// Confidence interval of each, if there is a bootstrap.
    pub interval: Option<Vec<(f64, f64)>>,
    /// Particles per unit volume in the packing, by the same bins.
    pub packed: Vec<f64>,
    /// All particles per unit volume.
    pub total: f64,
    /// Interval of the total.
    pub total_interval: Option<(f64, f64)>,
    /// Mean particle size.
    pub mean_size: f64,
    /// Volume fraction that follows from the unfolded densities.
    pub volume_fraction: f64,
    /// Shapes and their fractions.
    pub shapes: Vec<(String, f64)>,
    /// Particles per volume under several shapes.
    pub by_shape: Vec<ShapeDensity>,
    /// Method and kernel by name.
    pub method: String,
    /// Deviance of the refolded counts and its degrees of freedom.
    pub deviance: f64,
    /// See `deviance`.
    pub degrees_of_freedom: f64,
    /// Condition number of the kernel.
    pub condition_number: f64,
    /// Negative densities set to zero.
    pub clamped_bins: u64,
}

/// The packing.
#[derive(Clone, Debug)]
pub struct PackingFigures {
    /// Number of particles.
    pub particles: u64,
    /// Sides of the box.
    pub sides: [f64; 3],
    /// Fraction of the volume inside particles.
    pub fraction: f64,
    /// The requested fraction.
    pub requested_fraction: f64,
    /// Iterations of the packing.
    pub iterations: u64,
    /// One period of the solid with three visible faces.
    pub cube: RgbImage,
}

/// The solid's sections compared with the photograph.
#[derive(Clone, Debug)]
pub struct ComparisonFigures {
    /// Sections of the solid at the photograph's scale.
    pub sections: Vec<RgbImage>,
    /// Sections measured exactly.
    pub exact: SectionFigures,
    /// Sections rendered and segmented like the photograph.
    pub resegmented: Option<SectionFigures>,
    /// Outlines of the drawn sections.
    pub outlines: Option<OutlineComparison>,
    /// Profile size histogram of the exact sections over `SizeFigures::profile_edges`, scaled to the photograph's area.
    pub profiles_synthetic: Vec<f64>,
    /// Radial power spectra of the residual in photograph and sections.
    pub spectrum: Option<ResidualSpectra>,
}

/// How sections of the solid compare with the photograph.
#[derive(Clone, Copy, Debug)]
pub struct SectionFigures {
    /// Profiles measured.
    pub profiles: u64,
    /// Wasserstein-1 distance of profile sizes over their mean.
    pub size_w1: f64,
    /// Fraction of the area inside profiles, photograph, by the same measurement.
    pub area_fraction_photo: f64,
    /// Fraction of the area inside profiles, sections.
    pub area_fraction_synthetic: f64,
    /// Distance of the colours (Wasserstein-1, mean over channels), encoded, 0 to 1.
    pub colour_distance: f64,
}
