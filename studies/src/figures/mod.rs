//! The papers' figures, reproduced by this workspace: images and tables under docs/figures.

mod bars;
mod carvings;
mod controlled;
mod density_recovery;
mod estimators;
mod grain_size_tools;
mod growing;
pub mod laminar;
mod lines;
mod materials;
mod nearest_vertex;
mod packings;
mod particles;
mod relief_recipes;
mod reliefs;
mod scenes;
mod section_likelihood;
mod solids;
mod sphere_samples;
pub mod textures;

use std::path::Path;

use anyhow::{Result, ensure};

/// Draws all figures, or those whose name contains `only`, into `folder`.
pub fn run(folder: &Path, only: Option<&str>) -> Result<()> {
    type Figure = fn(&Path) -> Result<()>;
    let figures: [(&str, Figure); 24] = [
        ("figure-02-sphere-matrix", particles::draw_matrix),
        ("figure-03-slices", particles::draw_slices),
        ("figure-03-residual", particles::draw_residuals),
        ("figure-04-section-likelihood", section_likelihood::draw),
        ("figure-01-scene", scenes::draw_still_life),
        ("figure-05-solid", solids::draw_blocks),
        ("figure-06-residual", solids::draw_residual),
        ("figure-07-density-recovery", density_recovery::draw),
        ("figure-08-recovered-volume", density_recovery::draw_volumes),
        ("unfolding-estimators", estimators::draw_errors),
        ("unfolding-coverage", estimators::draw_coverage),
        ("unfolding-speed", estimators::draw_speed),
        ("figure-09-particles", particles::draw_shapes),
        ("figure-10-controlled", controlled::draw),
        ("figure-11-scene", scenes::draw_sculpture),
        ("figure-12-materials", materials::draw),
        ("packing", packings::draw),
        ("texture", textures::draw),
        ("grow", growing::draw),
        ("laminar-main", laminar::draw),
        ("laminar-parameters", laminar::draw_parameters),
        ("laminar-table", laminar::draw_table),
        ("microgeometry", reliefs::draw),
        ("readme", solids::draw_readme),
    ];
    ensure!(
        only.is_none_or(|only| figures.iter().any(|(name, _)| name.contains(only))),
        "no figure has such a name; the figures are {}",
        figures.map(|(name, _)| name).join(", ")
    );
    std::fs::create_dir_all(folder)?;
    for (name, draw) in figures {
        if only.is_none_or(|only| name.contains(only)) {
            println!("{name}");
            draw(folder)?;
        }
    }
    Ok(())
}
