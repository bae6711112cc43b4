//! Figure 4: probability of each area of a random section through simple particles.

use std::path::Path;

use anyhow::Result;
use stereology::kmatrix::{SectionLaw, SectionOptions};
use stereology::shape::{Body, ClosedMesh, TriangleMesh};

use super::bars::{BLUE, Panel, Series, draw as draw_bars, table};

const BINS: usize = 20;

fn torus() -> Result<Body> {
    Ok(Body::from_mesh(ClosedMesh::try_from(TriangleMesh::torus(
        2.0, 0.5, 64, 32,
    ))?))
}

pub fn draw(folder: &Path) -> Result<()> {
    let bodies = [
        ("sphere", Body::sphere(1.0)?),
        ("cube", Body::cuboid([1.0, 1.0, 1.0])?),
        ("box 1 x 2 x 3", Body::cuboid([1.0, 2.0, 3.0])?),
        ("ellipsoid 1 : 2 : 3", Body::ellipsoid([1.0, 2.0, 3.0])?),
        ("cylinder, length 2 diameters", Body::cylinder(1.0, 2.0)?),
        ("rough rock", Body::rough_rock(1, 0.05)?),
        ("torus, tube a quarter of the ring", torus()?),
        ("six-armed star", Body::superellipsoid([1.0; 3], [2.6, 2.6])?),
        ("flat octahedron", Body::superellipsoid([1.0, 1.0, 0.5], [2.0, 2.0])?),
    ];
    let options = SectionOptions::default().with_bins(BINS).with_tolerance(1e-3);
    let mut figures = Vec::new();
    for (name, body) in &bodies {
        let law = SectionLaw::of_body(body, &options)?;
        let last = |matrix: nalgebra::DMatrix<f64>| matrix.column(BINS - 1).iter().copied().collect::<Vec<f64>>();
        figures.push((*name, last(law.k_matrix(BINS)), last(law.k_standard_errors(BINS))));
    }
    let whiskers: Vec<Vec<(f64, f64)>> = figures
        .iter()
        .map(|(_, likelihood, errors)| {
            likelihood
                .iter()
                .zip(errors)
                .map(|(l, e)| ((l - e).max(0.0), l + e))
                .collect()
        })
        .collect();
    let panels: Vec<Panel<'_>> = figures
        .iter()
        .zip(&whiskers)
        .map(|((name, likelihood, _), whiskers)| Panel {
            title: name,
            across: "√(A / A_max)",
            span: [0.0, 1.0],
            up: "likelihood",
            series: vec![Series {
                name: "",
                values: likelihood,
                errors: Some(whiskers),
                colour: BLUE,
            }],
        })
        .collect();
    draw_bars(&folder.join("figure-04-section-likelihood.svg"), &panels, 3)?;
    let rows: Vec<Vec<String>> = figures
        .iter()
        .flat_map(|(name, likelihood, errors)| {
            (0..BINS).map(|i| {
                vec![
                    name.replace(',', ""),
                    ((i + 1) as f64 / BINS as f64).to_string(),
                    format!("{:.6}", likelihood[i]),
                    format!("{:.1e}", errors[i]),
                ]
            })
        })
        .collect();
    table(
        &folder.join("figure-04-section-likelihood.csv"),
        &["shape", "upper_edge", "likelihood", "standard_error"],
        &rows,
    )
}
