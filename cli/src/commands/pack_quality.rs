//! What `stereology pack` says and shows of a finished packing: its quality, its energies, its picture.

use std::fmt::Write;

use image::RgbImage;
use nalgebra::Vector3;
use serde_json::json;
use stereology::anneal::{
    Distance, Packing, bond_order, carnahan_starling, orientation_tensor, radial_distribution, section_test,
};
use stereology::pictures::picture_of_packing;
use stereology::render::{RenderError, RenderOptions};

use crate::answer::Answer;
use crate::numbers::significant;

/// Bins of the radial distribution, from 0 to 3 contact distances.
const BINS: usize = 120;
const REACH: f64 = 3.0;
/// Centres nearer than this in contact distances are bound.
const CUTOFF: f64 = 1.4;
/// Planes across each axis, and random arrangements they are held against.
const PLANES: usize = 10;
const REPLICATES: usize = 99;

/// Adds the `quality` of a packing to the answer.
pub fn judge(packing: &Packing, seed: u64, answer: &mut Answer) {
    let (particles, period) = (packing.particles(), packing.period());
    let radial = radial_distribution(particles, period, Distance::Contacts, REACH, BINS);
    let order = bond_order(particles, period, CUTOFF);
    let sections = section_test(packing, PLANES, REPLICATES, seed);
    let tensor = orientation_tensor(particles, &Vector3::z());
    answer
        .field(
            "quality",
            json!({
                "radial_distribution": { "edges": radial.edges, "g": radial.g },
                "g_at_contact": radial.at_contact(),
                "carnahan_starling": carnahan_starling(packing.fraction()),
                "q6": order.global,
                "q6_local": order.local,
                "bonds": order.bonds,
                "orientation_eigenvalues": tensor.map(|t| t.eigenvalues.to_vec()),
                "bingham": tensor.map(|t| t.bingham),
                "sections": {
                    "profiles_per_area": sections.profiles_per_area,
                    "expected_per_area": sections.expected_per_area,
                    "p_value": sections.p_value,
                },
            }),
        )
        .line(format!(
            "sections show {} profiles per unit area, {} expected (p = {}); Q6 {} ({} is usual without order)",
            significant(sections.profiles_per_area),
            significant(sections.expected_per_area),
            significant(sections.p_value),
            significant(order.global),
            significant((order.bonds.max(1) as f64).sqrt().recip())
        ));
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

/// The particles, lit, coloured by shape and a little by number.
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
    picture_of_packing(packing, &colour, &options)
}
