//! Figures 2, 3 and 9: the sphere's K matrix, slices of a particle in several pieces, a collection of particles; and
//! the residual of the paper's random sections (section 3.2).

use std::path::Path;

use anyhow::{Result, anyhow};
use image::RgbImage;
use image::imageops::replace;
use nalgebra::{Point3, UnitVector3, Vector3};
use plotters::prelude::*;
use stereology::kmatrix::{LargestArea, MonteCarloOptions, SectionLaw, SectionOptions, Slicing, SphereKernel};
use stereology::render::{Camera, RenderOptions, render_mesh};
use stereology::shape::{Body, ClosedMesh, ControlSphere, SectionPolygon, Subdivision, TriangleMesh, section_polygons};

use super::bars::{BLUE, GREEN, Panel, RED, Series, draw as draw_bars, table};

/// Figure 2: K of spheres for n = 4, in closed form (eq. 3) and by the sweep of a tessellated sphere.
pub fn draw_matrix(folder: &Path) -> Result<()> {
    const BINS: usize = 4;
    let exact = SphereKernel::new(BINS)?.matrix().clone();
    let ball = Body::from_mesh(ClosedMesh::try_from(TriangleMesh::icosphere(1.0, 4))?);
    let law = SectionLaw::of_body(&ball, &SectionOptions::default().with_bins(BINS).with_tolerance(2e-4))?;
    let column = |matrix: &nalgebra::DMatrix<f64>, j: usize| matrix.column(j).iter().copied().collect::<Vec<f64>>();
    let (swept, errors) = (law.k_matrix(BINS), law.k_standard_errors(BINS));
    type Column = (Vec<f64>, Vec<f64>, Vec<(f64, f64)>);
    let columns: Vec<Column> = (0..BINS)
        .map(|j| {
            let whisker = |i: usize| {
                (
                    (swept[(i, j)] - errors[(i, j)]).max(0.0),
                    swept[(i, j)] + errors[(i, j)],
                )
            };
            (column(&exact, j), column(&swept, j), (0..BINS).map(whisker).collect())
        })
        .collect();
    let titles: Vec<String> = (1..=BINS).map(|j| format!("spheres of diameter {j}/{BINS}")).collect();
    let panels: Vec<Panel<'_>> = columns
        .iter()
        .zip(&titles)
        .map(|((exact, swept, whiskers), title)| Panel {
            title,
            across: "profile diameter",
            span: [0.0, 1.0],
            up: "K",
            series: vec![
                Series {
                    name: "eq. 3",
                    values: exact,
                    errors: None,
                    colour: BLUE,
                },
                Series {
                    name: "sweep of 5,120 triangles",
                    values: swept,
                    errors: Some(whiskers),
                    colour: RED,
                },
            ],
        })
        .collect();
    draw_bars(&folder.join("figure-02-sphere-matrix.svg"), &panels, 2)?;
    let rows: Vec<Vec<String>> = (0..BINS)
        .flat_map(|j| (0..BINS).map(move |i| (i, j)))
        .map(|(i, j)| {
            let number = |x: f64| format!("{x:.6}");
            vec![
                (i + 1).to_string(),
                (j + 1).to_string(),
                number(exact[(i, j)]),
                number(swept[(i, j)]),
                format!("{:.1e}", errors[(i, j)]),
            ]
        })
        .collect();
    table(
        &folder.join("figure-02-sphere-matrix.csv"),
        &["profile_bin", "size_bin", "exact", "swept", "standard_error"],
        &rows,
    )
}

/// Figure 3: slices through a star at three depths. Away from its middle a slice consists of disjoint profiles, each
/// counted separately.
pub fn draw_slices(folder: &Path) -> Result<()> {
    let star = Body::superellipsoid([1.0; 3], [2.6, 2.6])?;
    let mesh = star.mesh().ok_or_else(|| anyhow!("a superellipsoid is a mesh"))?;
    let normal = UnitVector3::new_normalize(Vector3::new(0.96, 1.0, 1.05));
    let path = folder.join("figure-03-slices.svg");
    let root = SVGBackend::new(&path, (1050, 380)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut rows = Vec::new();
    for (area, depth) in root.split_evenly((1, 3)).iter().zip([0.0, 0.38, 0.48]) {
        let profiles = section_polygons(mesh, &normal, depth);
        draw_slice(area, &profiles, &normal, depth)?;
        for (k, profile) in profiles.iter().enumerate() {
            rows.push(vec![
                depth.to_string(),
                (k + 1).to_string(),
                format!("{:.6}", profile.area),
            ]);
        }
    }
    root.present()?;
    table(
        &folder.join("figure-03-slices.csv"),
        &["depth", "profile", "area"],
        &rows,
    )
}

fn draw_slice(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    profiles: &[SectionPolygon],
    normal: &UnitVector3<f64>,
    depth: f64,
) -> Result<()> {
    let u = Vector3::y().cross(normal).normalize();
    let v = normal.cross(&u);
    let flat = |p: &Point3<f64>| (p.coords.dot(&u), p.coords.dot(&v));
    let areas: Vec<String> = profiles.iter().map(|profile| format!("{:.3}", profile.area)).collect();
    let title = format!(
        "depth {depth}: {} ({})",
        if areas.len() == 1 {
            "one profile".to_owned()
        } else {
            format!("{} profiles", areas.len())
        },
        areas.join(", ")
    );
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .caption(title, ("sans-serif", 16))
        .build_cartesian_2d(-1.0..1.0, -1.0..1.0)?;
    for profile in profiles {
        let outline: Vec<(f64, f64)> = profile.outer.iter().map(flat).collect();
        chart.draw_series([Polygon::new(outline.clone(), BLUE.mix(0.35))])?;
        let closing = outline.first().copied();
        chart.draw_series([PathElement::new(
            outline.into_iter().chain(closing).collect::<Vec<_>>(),
            BLUE,
        )])?;
        for hole in &profile.holes {
            chart.draw_series([Polygon::new(hole.iter().map(flat).collect::<Vec<_>>(), WHITE)])?;
        }
    }
    Ok(())
}

/// The residual of the paper's histogram by number of random sections: largest of ten bins, for sections cut as
/// polygons and drawn as pixels.
pub fn draw_residuals(folder: &Path) -> Result<()> {
    const BINS: usize = 10;
    let torus = Body::from_mesh(ClosedMesh::try_from(TriangleMesh::torus(2.0, 0.8, 48, 24))?);
    let cube = Body::cuboid([1.0; 3])?;
    let raster = MonteCarloOptions::default()
        .with_slicing(Slicing::Raster { resolution: 64 })
        .with_largest(LargestArea::Encountered);
    let cases = [
        ("cube, polygons", &cube, MonteCarloOptions::default(), BLUE),
        ("cube, 64 x 64 pixels", &cube, raster, GREEN),
        ("torus, polygons", &torus, MonteCarloOptions::default(), RED),
        ("torus, 64 x 64 pixels", &torus, raster, BLACK),
    ];
    let path = folder.join("figure-03-residual.svg");
    let root = SVGBackend::new(&path, (760, 430)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .margin(12)
        .caption("largest residual of ten bins after random sections", ("sans-serif", 17))
        .x_label_area_size(40)
        .y_label_area_size(60)
        .build_cartesian_2d((500.0..100_000.0).log_scale(), (2e-4..0.1).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("random sections that hit")
        .y_desc("|share − exact|")
        .light_line_style(TRANSPARENT)
        .draw()?;
    let mut rows = Vec::new();
    for (name, body, options, colour) in cases {
        let law = SectionLaw::of_body(body, &SectionOptions::default().with_tolerance(3e-4))?;
        let residuals = law.residuals(body, BINS, &options)?;
        let points: Vec<(f64, f64)> = residuals
            .iter()
            .map(|residual| {
                (
                    residual.iterations as f64,
                    residual.per_bin.iter().fold(0.0_f64, |worst, r| worst.max(r.abs())),
                )
            })
            .collect();
        for (iterations, worst) in points
            .iter()
            .filter(|(n, _)| [500.0, 5_000.0, 20_000.0, 50_000.0, 100_000.0].contains(n))
        {
            rows.push(vec![
                name.replace(',', ""),
                iterations.to_string(),
                format!("{worst:.5}"),
            ]);
        }
        chart
            .draw_series(LineSeries::new(points, colour))?
            .label(name)
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 14, y)], colour));
    }
    chart
        .draw_series(DashedLineSeries::new(
            [(500.0, 0.005), (100_000.0, 0.005)],
            4,
            4,
            BLACK.mix(0.5).into(),
        ))?
        .label("the paper's 0.5 %")
        .legend(|(x, y)| PathElement::new(vec![(x, y), (x + 14, y)], BLACK.mix(0.5)));
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .draw()?;
    root.present()?;
    table(
        &folder.join("figure-03-residual.csv"),
        &["case", "sections", "largest_residual"],
        &rows,
    )
}

/// Figure 9: a collection of particle shapes, all as the program's command `shape` writes them.
pub fn draw_shapes(folder: &Path) -> Result<()> {
    const SIDE: u32 = 240;
    let mut pebble = ControlSphere::sphere(1.0);
    for (row, column, by) in [(2, 0, 0.25), (2, 4, -0.15), (1, 2, 0.2), (3, 5, 0.15), (2, 6, -0.2)] {
        let point = &mut pebble.points_mut()[row][column];
        point.coords *= 1.0 + by;
    }
    let cube = ClosedMesh::try_from(TriangleMesh::cuboid([1.0, 0.8, 0.6]))?;
    let body = |spec: &str| -> Result<TriangleMesh> { Ok(Body::parse(spec)?.to_triangles(5)) };
    let shapes = [
        body("ellipsoid:1,0.8,0.6")?,
        body("rock:1")?,
        body("rock:7")?,
        body("rock:1,0.03")?,
        body("rock:7,0.08")?,
        pebble.triangles(24),
        cube.subdivided(Subdivision::Loop, 4),
        body("superellipsoid:1,0.8,0.6,0.4,0.4")?,
        body("superellipsoid:1,1,1,2.6,2.6")?,
        body("cylinder:1,1.4")?,
    ];
    let options = RenderOptions::default().with_size(SIDE, SIDE);
    let mut sheet = RgbImage::new(5 * SIDE, 2 * SIDE);
    for (place, mesh) in (0_u32..).zip(&shapes) {
        let picture = render_mesh(mesh, &|_| [0.72, 0.68, 0.62], &Camera::default(), &options)?;
        replace(
            &mut sheet,
            &picture,
            i64::from(place % 5 * SIDE),
            i64::from(place / 5 * SIDE),
        );
    }
    sheet.save(folder.join("figure-09-particles.png"))?;
    Ok(())
}
