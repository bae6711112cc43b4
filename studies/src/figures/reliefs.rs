//! Figures 1 to 9 of Schroeder et al. 2005 (stochastic microgeometry), on meshes from formulas.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result};
use image::{RgbImage, imageops};
use nalgebra::{Point3, Vector3};
use ndarray::{Array3, Axis};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology::microgeometry::{
    ContactDistribution, Counting, EstimateOptions, Offset, ReconstructOptions, contact_of_volume, displace,
    reconstruct, to_distribution_units,
};
use stereology::render::{Camera, RenderOptions, render_mesh};
use stereology::shape::{Body, TriangleMesh};

use super::bars::{self, BLUE, GREY, Panel, RED, Series};
use super::nearest_vertex::Nearest;
use super::relief_recipes::{Recipe, ball, bar, blade, bust, chipped, clay, coral, crisped, disc, fine, planet, ring};
use super::solids::row;

const SIDE: u32 = 300;

/// Draws all nine.
pub fn draw(folder: &Path) -> Result<()> {
    let figure = |name: &str, picture: RgbImage| {
        let path = folder.join(format!("microgeometry-{name}.png"));
        picture.save(&path).with_context(|| path.display().to_string())
    };
    figure("01-kinds", kinds()?)?;
    figure("02-before-and-after", before_and_after()?)?;
    figure("03-twenty-instances", instances()?)?;
    figure("04-one-map-many-meshes", many_meshes()?)?;
    figure("05-labels-spreading", spreading()?)?;
    figure("06-regions", regions()?)?;
    distributions(&folder.join("microgeometry-07-distributions.svg"))?;
    figure("08-porous-slice", porous(&folder.join("microgeometry-08-porous.svg"))?)?;
    merging(&folder.join("microgeometry-09-merging.svg"))
}

fn labels(mesh: &TriangleMesh, of: &Recipe, seed: u64) -> Result<Vec<f64>> {
    let scaled = to_distribution_units(mesh, of.units)?;
    let options = ReconstructOptions::default().with_seed(seed);
    Ok(reconstruct(&scaled, &of.contact, &options, &|_| ControlFlow::Continue(()))?.labels)
}

fn camera() -> Camera {
    Camera {
        azimuth: 28.0,
        elevation: 22.0,
        ..Camera::default()
    }
}

fn options(side: u32) -> RenderOptions {
    RenderOptions {
        gloss: 0.25,
        ..RenderOptions::default().with_size(side, side).with_samples(3)
    }
}

fn relief(mesh: &TriangleMesh, of: &Recipe, seed: u64, side: u32) -> Result<RgbImage> {
    let labels = labels(mesh, of, seed)?;
    let made = displace(
        mesh,
        &labels,
        &of.negative.parse::<Offset>()?,
        &of.positive.parse::<Offset>()?,
    )?;
    let near = Nearest::new(&made.mesh);
    let [negative, positive] = of.colours;
    let colour = |p: &Point3<f64>| {
        let value = near.mean(p, &made.values);
        // The colours of the regions blend over a distance of two bins.
        let share = (0.5 + 0.5 * value).clamp(0.0, 1.0) as f32;
        [0, 1, 2].map(|c| negative[c] + share * (positive[c] - negative[c]))
    };
    Ok(render_mesh(&made.mesh, &colour, &camera(), &options(side))?)
}

fn plain(mesh: &TriangleMesh, colour: [f32; 3], side: u32) -> Result<RgbImage> {
    Ok(render_mesh(mesh, &|_| colour, &camera(), &options(side))?)
}

fn rows(parts: Vec<RgbImage>, columns: usize) -> RgbImage {
    let lines: Vec<RgbImage> = parts.chunks(columns).map(row).collect();
    let (width, height) = lines.first().map_or((1, 1), RgbImage::dimensions);
    let mut whole = RgbImage::from_pixel(width, (height + 8) * lines.len() as u32 - 8, image::Rgb([255; 3]));
    for (line, y) in lines.iter().zip((0_i64..).step_by(height as usize + 8)) {
        imageops::replace(&mut whole, line, 0, y);
    }
    whole
}

/// Figure 1: arrowhead, coral disc, candy bar, head, planet.
fn kinds() -> Result<RgbImage> {
    Ok(row(&[
        relief(&blade()?, &chipped()?, 1, SIDE)?,
        relief(&disc()?, &coral()?, 1, SIDE)?,
        relief(&bar()?, &crisped()?, 1, SIDE)?,
        relief(&bust()?, &clay()?, 1, SIDE)?,
        relief(&ball(), &planet()?, 1, SIDE)?,
    ]))
}

/// Figure 2: a mesh before, and four reliefs of it, for three meshes.
fn before_and_after() -> Result<RgbImage> {
    let mut parts = Vec::new();
    for mesh in [bar()?, disc()?, bust()?] {
        parts.push(plain(&mesh, [0.66, 0.62, 0.57], SIDE)?);
        for recipe in [chipped()?, coral()?, crisped()?, clay()?] {
            parts.push(relief(&mesh, &recipe, 2, SIDE)?);
        }
    }
    Ok(rows(parts, 5))
}

/// Figure 3: twenty instances of one material.
fn instances() -> Result<RgbImage> {
    let mesh = fine(
        Body::superellipsoid([1.0, 0.7, 0.8], [0.8, 0.8])?.to_triangles(5),
        0.035,
    )?;
    let recipe = coral()?;
    let parts = (1..=20)
        .map(|seed| relief(&mesh, &recipe, seed, 200))
        .collect::<Result<_>>()?;
    Ok(rows(parts, 5))
}

/// Figure 4: the same map on different meshes.
fn many_meshes() -> Result<RgbImage> {
    let recipe = crisped()?;
    let meshes = [ball(), ring(), bar()?, disc()?, blade()?];
    let parts: Vec<RgbImage> = meshes
        .iter()
        .map(|mesh| relief(mesh, &recipe, 3, SIDE))
        .collect::<Result<_>>()?;
    Ok(row(&parts))
}

/// Figure 5: labels from the farthest inwards, red positive, blue negative, white not labelled yet.
fn spreading() -> Result<RgbImage> {
    let (mesh, recipe) = (ball(), chipped()?);
    let recipe = Recipe { units: 40.0, ..recipe };
    let labels = labels(&mesh, &recipe, 5)?;
    let far = labels.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let parts: Vec<RgbImage> = [0.6, 0.4, 0.25, 0.1, 0.0]
        .into_iter()
        .map(|from| labelled(&mesh, &labels, far, from * far))
        .collect::<Result<_>>()?;
    Ok(row(&parts))
}

/// Figure 6: two regions, and the distances of their points along the surface.
fn regions() -> Result<RgbImage> {
    let recipe = chipped()?;
    let parts: Vec<RgbImage> = [ball(), ring(), bust()?]
        .iter()
        .map(|mesh| {
            let labels = labels(mesh, &recipe, 6)?;
            let far = labels.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            labelled(mesh, &labels, far, 0.0)
        })
        .collect::<Result<_>>()?;
    Ok(row(&parts))
}

/// The mesh coloured by its labels; labels below `from` are white.
fn labelled(mesh: &TriangleMesh, labels: &[f64], far: f64, from: f64) -> Result<RgbImage> {
    let centres = TriangleMesh {
        vertices: mesh
            .triangles
            .iter()
            .map(|t| {
                t.iter()
                    .map(|&v| mesh.vertices[v as usize].coords)
                    .sum::<Vector3<f64>>()
                    / 3.0
            })
            .map(Point3::from)
            .collect(),
        triangles: Vec::new(),
    };
    let near = Nearest::new(&centres);
    let colour = |p: &Point3<f64>| {
        let label = near.vertex(p).map_or(0.0, |t| labels[t]);
        if label.abs() < from {
            return [0.97_f32; 3];
        }
        let pale = (1.0 - 0.85 * (0.25 + 0.75 * label.abs() / far)).clamp(0.0, 1.0) as f32;
        if label < 0.0 {
            [pale, pale, 0.85]
        } else {
            [0.85, pale, pale]
        }
    };
    Ok(render_mesh(mesh, &colour, &camera(), &options(SIDE))?)
}

/// Fractions over the signed bins, negative ones first; both sides padded to `bins`.
fn signed(of: &ContactDistribution, bins: usize) -> Vec<f64> {
    let at = |side: &[f64], k: usize| side.get(k).copied().unwrap_or_default();
    (0..bins)
        .rev()
        .map(|k| at(of.negative(), k))
        .chain((0..bins).map(|k| at(of.positive(), k)))
        .collect()
}

/// Figure 7: the distributions of figure 1.
fn distributions(path: &Path) -> Result<()> {
    let recipes = [
        ("arrowhead: a random field", chipped()?),
        ("coral", coral()?),
        ("candy", crisped()?),
        ("clay", clay()?),
        ("planet", planet()?),
    ];
    let bins = 18;
    let values: Vec<Vec<f64>> = recipes
        .iter()
        .map(|(_, recipe)| signed(&recipe.contact, bins))
        .collect();
    let panels: Vec<Panel<'_>> = recipes
        .iter()
        .zip(&values)
        .map(|((title, _), values)| Panel {
            title,
            across: "distance, bins",
            span: [-18.0, 18.0],
            up: "share",
            series: vec![Series {
                name: "share",
                values,
                errors: None,
                colour: BLUE,
            }],
        })
        .collect();
    bars::draw(path, &panels, 3)
}

/// Figure 8: both distributions of a porous volume: overlapping balls of pore in a solid. Returns a slice of it.
fn porous(path: &Path) -> Result<RgbImage> {
    let (n, radius, count) = (120_usize, 11.0, 150);
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let mut solid = Array3::from_elem((n, n, n), true);
    for _ in 0..count {
        let centre: [f64; 3] = std::array::from_fn(|_| n as f64 * random.random::<f64>());
        let reach = |c: f64| ((c - radius).max(0.0) as usize)..((c + radius + 1.0).min(n as f64) as usize);
        for z in reach(centre[0]) {
            for y in reach(centre[1]) {
                for x in reach(centre[2]) {
                    let square = |i: usize, c: f64| (i as f64 + 0.5 - c).powi(2);
                    if square(z, centre[0]) + square(y, centre[1]) + square(x, centre[2]) < radius * radius {
                        solid[[z, y, x]] = false;
                    }
                }
            }
        }
    }
    let of = contact_of_volume(solid.view(), &EstimateOptions::default())?;
    let seen = contact_of_volume(
        solid.view(),
        &EstimateOptions {
            counting: Counting::InterfaceSeen,
            ..EstimateOptions::default()
        },
    )?;
    let longest = [&of, &seen].map(|of| of.negative().len().max(of.positive().len()));
    let bins = longest[0].max(longest[1]);
    let own = |shares: &[f64], share: f64| -> Vec<f64> {
        let shares = shares.iter().map(|s| s / share);
        shares.chain(std::iter::repeat(0.0)).take(bins).collect()
    };
    let (phi, phi_seen) = (of.positive_share(), seen.positive_share());
    let parts = [
        (
            own(of.negative(), 1.0 - phi),
            own(seen.negative(), 1.0 - phi_seen),
            "pores",
            BLUE,
        ),
        (own(of.positive(), phi), own(seen.positive(), phi_seen), "material", RED),
    ];
    let panels: Vec<Panel<'_>> = parts
        .iter()
        .map(|(values, seen, title, colour)| Panel {
            title,
            across: "distance R to the interface, bins of a voxel",
            span: [0.0, bins as f64],
            up: "probability",
            series: vec![
                Series {
                    name: "borders corrected",
                    values,
                    errors: None,
                    colour: *colour,
                },
                Series {
                    name: "as seen",
                    values: seen,
                    errors: None,
                    colour: GREY,
                },
            ],
        })
        .collect();
    bars::draw(path, &panels, 2)?;
    let slice = solid.index_axis(Axis(0), n / 2);
    Ok(RgbImage::from_fn(3 * n as u32, 3 * n as u32, |x, y| {
        image::Rgb(if slice[[y as usize / 3, x as usize / 3]] {
            [214, 205, 190]
        } else {
            [52, 60, 76]
        })
    }))
}

/// Figure 9: two distributions, merged with a sign, and the histogram of a mesh.
fn merging(path: &Path) -> Result<()> {
    let of = coral()?.contact;
    let share = of.positive_share();
    let negative: Vec<f64> = of.negative().iter().map(|s| s / (1.0 - share)).collect();
    let positive: Vec<f64> = of.positive().iter().map(|s| s / share).collect();
    let merged = signed(&of, 8);
    let triangles = 20_480.0;
    let histogram: Vec<f64> = merged.iter().map(|share| (share * triangles).round()).collect();
    let panel = |title, span, up, values, colour| Panel {
        title,
        across: "distance, bins",
        span,
        up,
        series: vec![Series {
            name: "share",
            values,
            errors: None,
            colour,
        }],
    };
    bars::draw(
        path,
        &[
            panel(
                "negative region",
                [0.0, negative.len() as f64],
                "probability",
                negative.as_slice(),
                BLUE,
            ),
            panel(
                "positive region",
                [0.0, positive.len() as f64],
                "probability",
                positive.as_slice(),
                RED,
            ),
            panel("merged", [-8.0, 8.0], "share", merged.as_slice(), GREY),
            panel(
                "histogram of 20,480 triangles",
                [-8.0, 8.0],
                "triangles",
                histogram.as_slice(),
                GREY,
            ),
        ],
        2,
    )
}
