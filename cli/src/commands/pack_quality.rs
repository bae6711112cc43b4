//! Statistics, energies and image of a finished packing for `stereology pack`.

use std::fmt::Write;

use image::RgbImage;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::Serialize;
use stereology::anneal::{
    Distance, Packing, bond_order, carnahan_starling, orientation_tensor, radial_distribution, section_test,
};
use stereology::render::{RenderError, RenderOptions};
use stereology::renderings::render_packing;

use crate::answer::Notes;
use stereology_report::significant;

/// Bins of the radial distribution, from 0 to 3 contact distances.
const BINS: usize = 120;
const REACH: f64 = 3.0;
/// Largest distance of bonded centres, in contact distances.
const CUTOFF: f64 = 1.4;
/// Number of planes per axis, and of random arrangements they are compared with.
const PLANES: usize = 10;
const REPLICATES: usize = 99;

/// Statistics of a packing.
#[derive(Debug, Serialize, JsonSchema)]
pub struct QualityFields {
    /// Radial distribution function of the centres, by distance in contact distances.
    radial_distribution: RadialFields,
    /// Radial distribution function at contact; null if there are too few pairs.
    g_at_contact: Option<f64>,
    /// The same for a fluid of equal hard spheres (Carnahan-Starling).
    carnahan_starling: f64,
    /// Global bond-orientational order Q6.
    q6: f64,
    /// Mean local bond-orientational order q6.
    q6_local: f64,
    /// Number of bonds.
    bonds: usize,
    /// Eigenvalues of the orientation tensor; null for spheres.
    orientation_eigenvalues: Option<Vec<f64>>,
    /// Bingham's test statistic for isotropic orientations, chi-squared with five degrees of freedom; null for spheres.
    bingham: Option<f64>,
    /// Profiles on plane sections compared with the expectation.
    sections: SectionFields,
}

/// A radial distribution function.
#[derive(Debug, Serialize, JsonSchema)]
pub struct RadialFields {
    /// Edges of the bins, in contact distances.
    edges: Vec<f64>,
    /// Value in each bin; 1 without correlation.
    g: Vec<f64>,
}

/// Profiles on plane sections.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SectionFields {
    /// Profiles per unit area on the planes.
    profiles_per_area: f64,
    /// Expected profiles per unit area.
    expected_per_area: f64,
    /// Probability of such a difference in random arrangements.
    p_value: f64,
}

/// Computes the statistics of a packing, and a line of the summary.
pub fn quality(packing: &Packing, seed: u64, notes: &mut Notes) -> QualityFields {
    let (particles, period) = (packing.particles(), packing.period());
    let radial = radial_distribution(particles, period, Distance::Contacts, REACH, BINS);
    let order = bond_order(particles, period, CUTOFF);
    let sections = section_test(packing, PLANES, REPLICATES, seed);
    let tensor = orientation_tensor(particles, &Vector3::z());
    notes.line(format!(
        "sections show {} profiles per unit area, {} expected (p = {}); Q6 {} ({} without order)",
        significant(sections.profiles_per_area),
        significant(sections.expected_per_area),
        significant(sections.p_value),
        significant(order.global),
        significant((order.bonds.max(1) as f64).sqrt().recip())
    ));
    QualityFields {
        g_at_contact: radial.at_contact(),
        radial_distribution: RadialFields {
            edges: radial.edges,
            g: radial.g,
        },
        carnahan_starling: carnahan_starling(packing.fraction()),
        q6: order.global,
        q6_local: order.local,
        bonds: order.bonds,
        orientation_eigenvalues: tensor.map(|t| t.eigenvalues.to_vec()),
        bingham: tensor.map(|t| t.bingham),
        sections: SectionFields {
            profiles_per_area: sections.profiles_per_area,
            expected_per_area: sections.expected_per_area,
            p_value: sections.p_value,
        },
    }
}

/// The energies as a table.
pub fn trace(packing: &Packing) -> String {
    let mut text = "iteration,energy\n".to_owned();
    for (iteration, energy) in packing.energies().iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{iteration},{energy}");
    }
    text
}

/// A rendering of the particles; colours depend on the shape and, slightly, on the number of the particle.
pub fn picture(packing: &Packing) -> Result<RgbImage, RenderError> {
    const COLOURS: [[f32; 3]; 6] = [
        [0.74, 0.45, 0.30],
        [0.35, 0.50, 0.66],
        [0.55, 0.62, 0.40],
        [0.72, 0.62, 0.38],
        [0.55, 0.42, 0.58],
        [0.50, 0.50, 0.50],
    ];
    let colour = |i: usize| {
        let base = COLOURS[packing.particles()[i].shape % COLOURS.len()];
        let shade = 0.82 + 0.36 * ((i as f32) * 0.618_034).fract();
        base.map(|channel| (channel * shade).min(1.0))
    };
    let options = RenderOptions {
        gloss: 0.15,
        ..RenderOptions::default().with_size(800, 720)
    };
    render_packing(packing, &colour, &options)
}
