//! Comparison of the packing methods: an image of each, and their radial distributions.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use anyhow::{Result, anyhow};
use plotters::prelude::*;
use stereology::anneal::{
    Distance, Mode, PackOptions, Packing, RadialDistribution, bond_order, box_for_fraction, equilibrate,
    lognormal_sizes, mix, pack, populate, radial_distribution,
};
use stereology::render::RenderOptions;
use stereology::renderings::render_packing;
use stereology::shape::{Arrangement, Body, ClosedMesh, TriangleMesh, UnitBody};

use super::bars::{BLUE, GREEN, RED, table};

const COUNT: usize = 1000;
const SIGMA: f64 = 0.3;
const FRACTION: f64 = 0.35;
const OCHRE: RGBColor = RGBColor(190, 140, 40);
const GREY: RGBColor = RGBColor(120, 120, 120);

pub fn draw(folder: &Path) -> Result<()> {
    let modes = [
        ("fast", Mode::fast(), BLUE),
        ("paper", Mode::paper(), RED),
        ("anneal", Mode::anneal(), GREEN),
        ("sequential", Mode::sequential(), OCHRE),
    ];
    let sphere = [UnitBody::new(&Body::sphere(1.0)?)];
    let mut curves = Vec::new();
    let mut rows = Vec::new();
    for (name, mode, colour) in modes {
        let options = PackOptions::default().with_mode(mode);
        let started = Instant::now();
        let packing = packed(&sphere, COUNT, FRACTION, &options)?;
        // Times are printed and not written, so that the same program writes the same files.
        println!("  {name}: {:.2} s", started.elapsed().as_secs_f64());
        picture(
            &packing,
            &by_contacts(&packing),
            &folder.join(format!("packing-{name}.png")),
        )?;
        rows.push(judged(name, &packing));
        curves.push((name, radial(&packing), colour));
        if mode == Mode::fast() {
            let later = equilibrate(&packing, 300, 0, &|_| ControlFlow::Continue(()))?;
            picture(&later, &by_contacts(&later), &folder.join("packing-equilibrium.png"))?;
            rows.push(judged("equilibrium", &later));
            curves.push(("equilibrium", radial(&later), GREY));
        }
    }
    lines(&folder.join("packing-radial.svg"), &curves)?;
    table(
        &folder.join("packing.csv"),
        &[
            "mode",
            "fraction",
            "iterations",
            "g_at_contact",
            "g_below_1.05",
            "q6",
            "bonds",
            "touching",
        ],
        &rows,
    )?;
    let hollow = [
        TriangleMesh::torus(2.0, 0.7, 32, 16),
        TriangleMesh::cubes(&[
            [0, 0, 0],
            [1, 0, 0],
            [2, 0, 0],
            [0, 1, 0],
            [2, 1, 0],
            [0, 2, 0],
            [2, 2, 0],
        ]),
        TriangleMesh::cubes(&[
            [2, 2, 2],
            [0, 2, 2],
            [1, 2, 2],
            [3, 2, 2],
            [4, 2, 2],
            [2, 0, 2],
            [2, 1, 2],
            [2, 3, 2],
            [2, 4, 2],
            [2, 2, 0],
            [2, 2, 1],
            [2, 2, 3],
            [2, 2, 4],
        ]),
    ];
    let bodies = hollow
        .into_iter()
        .map(|mesh| Ok(UnitBody::new(&Body::from_mesh(ClosedMesh::try_from(mesh)?))))
        .collect::<Result<Vec<_>>>()?;
    let started = Instant::now();
    let packing = packed(&bodies, 300, 0.2, &PackOptions::default())?;
    println!("  hollow: {:.2} s", started.elapsed().as_secs_f64());
    picture(&packing, &by_shape(&packing), &folder.join("packing-hollow.png"))
}

fn packed(bodies: &[UnitBody], count: usize, fraction: f64, options: &PackOptions) -> Result<Packing> {
    let shares = vec![1.0; bodies.len()];
    let grains = mix(&lognormal_sizes(count, SIGMA, 0)?, &shares, 0)?;
    let period = box_for_fraction(bodies, &grains, fraction)?;
    Ok(pack(
        &Arrangement::new(bodies, populate(&grains, &period, 0), period)?,
        options,
        &|_| ControlFlow::Continue(()),
    )?)
}

fn radial(packing: &Packing) -> RadialDistribution {
    radial_distribution(packing.particles(), packing.period(), Distance::Contacts, 2.5, 50)
}

fn judged(name: &str, packing: &Packing) -> Vec<String> {
    let order = bond_order(packing.particles(), packing.period(), 1.4);
    let radial = radial_distribution(packing.particles(), packing.period(), Distance::Contacts, 2.5, 50);
    let near = radial.edges.iter().position(|edge| *edge > 1.0 + 1e-9).unwrap_or(0);
    vec![
        name.to_owned(),
        format!("{:.4}", packing.fraction()),
        packing.iterations().to_string(),
        radial.at_contact().map_or(String::new(), |g| format!("{g:.2}")),
        format!("{:.2}", radial.g[near]),
        format!("{:.4}", order.global),
        order.bonds.to_string(),
        format!(
            "{:.2}",
            touching(packing).iter().sum::<usize>() as f64 / packing.particles().len() as f64
        ),
    ]
}

/// Colours of the particles by their shape.
fn by_shape(packing: &Packing) -> Vec<[f32; 3]> {
    const COLOURS: [[f32; 3]; 3] = [[0.74, 0.45, 0.30], [0.35, 0.50, 0.66], [0.60, 0.62, 0.40]];
    let colour = |(i, shape): (usize, usize)| {
        let shade = 0.82 + 0.36 * (i as f32 * 0.618_034).fract();
        COLOURS[shape % COLOURS.len()].map(|channel| (channel * shade).min(1.0))
    };
    packing
        .particles()
        .iter()
        .map(|p| p.shape)
        .enumerate()
        .map(colour)
        .collect()
}

/// Two spheres count as touching in an image if their gap is below this fraction of their mean size.
const TOUCHING: f64 = 0.03;

/// Colours of spheres by number of contacts: none is blue, one pale, two, three, four or more red.
fn by_contacts(packing: &Packing) -> Vec<[f32; 3]> {
    const COLOURS: [[f32; 3]; 5] = [
        [0.23, 0.42, 0.70],
        [0.66, 0.78, 0.88],
        [0.95, 0.87, 0.62],
        [0.92, 0.58, 0.34],
        [0.70, 0.16, 0.16],
    ];
    touching(packing).into_iter().map(|n| COLOURS[n.min(4)]).collect()
}

/// Number of contacts of each sphere.
fn touching(packing: &Packing) -> Vec<usize> {
    let particles = packing.particles();
    let touch = |i: usize, j: usize| {
        let (p, q) = (&particles[i], &particles[j]);
        let apart = packing.period().nearest(q.position - p.position).norm();
        i != j && apart < 0.5 * (p.size + q.size) * (1.0 + TOUCHING)
    };
    (0..particles.len())
        .map(|i| (0..particles.len()).filter(|&j| touch(i, j)).count())
        .collect()
}

fn picture(packing: &Packing, colours: &[[f32; 3]], path: &Path) -> Result<()> {
    let options = RenderOptions {
        gloss: 0.15,
        ..RenderOptions::default().with_size(420, 380)
    };
    Ok(render_packing(packing, &|i| colours[i], &options)?.save(path)?)
}

fn lines(path: &Path, curves: &[(&str, RadialDistribution, RGBColor)]) -> Result<()> {
    let root = SVGBackend::new(path, (760, 420)).into_drawing_area();
    let highest = curves
        .iter()
        .flat_map(|(_, radial, _)| &radial.g)
        .fold(1.0_f64, |h, g| h.max(*g));
    let drawing = || -> Result<(), Box<dyn std::error::Error>> {
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&root)
            .margin(12)
            .x_label_area_size(36)
            .y_label_area_size(44)
            .build_cartesian_2d(0.5..2.5, 0.0..1.05 * highest)?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .x_desc("distance of centres over the mean of the two sizes")
            .y_desc("g")
            .draw()?;
        for (name, radial, colour) in curves {
            let width = radial.edges[0];
            let points = radial
                .edges
                .iter()
                .zip(&radial.g)
                .map(|(edge, g)| (edge - 0.5 * width, *g));
            let colour = *colour;
            chart
                .draw_series(LineSeries::new(points.filter(|p| p.0 > 0.5), colour.stroke_width(2)))?
                .label(*name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2)));
        }
        chart.configure_series_labels().background_style(WHITE).draw()?;
        root.present()?;
        Ok(())
    };
    drawing().map_err(|error| anyhow!("{}: {error}", path.display()))
}
