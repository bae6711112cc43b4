//! Figures 1 to 9 of Schroeder et al. 2005 (stochastic microgeometry), on meshes from formulas.

use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result};
use image::{RgbImage, imageops};
use nalgebra::{Point3, Vector3};
use ndarray::{Array2, Array3, Axis};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology::microgeometry::{
    ContactDistribution, Counting, EstimateOptions, Law, Offset, ReconstructOptions, contact_of_picture,
    contact_of_volume, displace, reconstruct, refined, to_distribution_units,
};
use stereology::render::{Camera, RenderOptions, render_mesh};
use stereology::shape::{Body, Subdivision, TriangleMesh};

use super::bars::{self, BLUE, GREY, Panel, RED, Series};
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

/// A relief's recipe.
struct Recipe {
    contact: ContactDistribution,
    units: f64,
    negative: &'static str,
    positive: &'static str,
    colours: [[f32; 3]; 2],
}

fn laws(negative: Law, positive: Law, share: f64) -> Result<ContactDistribution> {
    Ok(ContactDistribution::from_laws(1.0, negative, positive, share)?)
}

/// Light and dark of a random field: the plainest of textures.
fn field() -> Result<ContactDistribution> {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let waves: Vec<[f64; 3]> = (0..80)
        .map(|_| {
            let (turn, k) = (
                TAU * random.random::<f64>(),
                TAU / 26.0 * (0.6 + 0.8 * random.random::<f64>()),
            );
            [k * turn.cos(), k * turn.sin(), TAU * random.random::<f64>()]
        })
        .collect();
    let picture = Array2::from_shape_fn((400, 400), |(y, x)| {
        waves
            .iter()
            .map(|[ky, kx, phase]| (ky * y as f64 + kx * x as f64 + phase).cos())
            .sum::<f64>()
            > 0.0
    });
    Ok(contact_of_picture(picture.view(), &EstimateOptions::default())?)
}

fn fine(mesh: TriangleMesh, edge: f64) -> Result<TriangleMesh> {
    Ok(refined(&mesh, Subdivision::Midpoint, edge)?)
}

/// A box with rounded edges: split first, so that Loop's scheme rounds the edges alone.
fn bar() -> Result<TriangleMesh> {
    let boxy = fine(TriangleMesh::cuboid([2.0, 0.72, 0.84]), 0.22)?;
    Ok(refined(&boxy, Subdivision::Loop, 0.028)?)
}

fn disc() -> Result<TriangleMesh> {
    fine(
        Body::superellipsoid([1.0, 0.28, 1.0], [0.6, 1.0])?.to_triangles(5),
        0.03,
    )
}

fn ball() -> TriangleMesh {
    TriangleMesh::icosphere(2.0, 6)
}

fn ring() -> TriangleMesh {
    TriangleMesh::torus(1.4, 0.6, 200, 90)
}

/// From 0 to 1 between two places, without corners.
fn smooth(from: f64, to: f64, at: f64) -> f64 {
    let t = ((at - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// An arrowhead: a tang, barbs, a tip.
fn blade() -> Result<TriangleMesh> {
    let shaped = TriangleMesh::icosphere(2.0, 6).mapped(|p| {
        let along = 0.5 * (p.y + 1.0);
        let tang = 0.2 * smooth(0.0, 0.1, along);
        let head = 0.72 * (1.0 - along).powf(0.85);
        let wide = tang + (head - tang) * smooth(0.2, 0.32, along);
        let round = p.x.hypot(p.z).max(1e-9);
        let thick = 0.17 * (1.0 - along).sqrt() * smooth(0.0, 0.15, along);
        Point3::new(wide * p.x / round, 1.05 * p.y, thick * p.z / round)
    });
    fine(shaped, 0.026)
}

/// A head of a kind: a long ellipsoid on a neck.
fn bust() -> Result<TriangleMesh> {
    let shaped = TriangleMesh::icosphere(2.0, 5).mapped(|p| {
        let t = (PI * (p.y + 1.0) / 2.0).clamp(0.0, PI);
        let wide = 0.34 + 0.14 * (1.0 + (2.0 * (t - 2.1)).cos());
        let nose = 0.16 * (-16.0 * (p.x * p.x + (p.y - 0.25).powi(2))).exp() * p.z.max(0.0);
        Point3::new(wide * p.x, 1.1 * p.y, (wide * 1.1) * p.z + nose)
    });
    fine(shaped, 0.03)
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
        // The regions' colours run into each other over a distance of two bins.
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

fn chipped() -> Result<Recipe> {
    Ok(Recipe {
        contact: field()?,
        units: 60.0,
        negative: "in,0.012,sqrt",
        positive: "out,0.012,sqrt",
        colours: [[0.16, 0.42, 0.44], [0.36, 0.68, 0.66]],
    })
}

fn coral() -> Result<Recipe> {
    Ok(Recipe {
        contact: laws(Law::Disc(5.0), Law::Disc(2.2), 0.34)?,
        units: 50.0,
        negative: "in,0.03,sqrt",
        positive: "out,0.006,sqrt",
        colours: [[0.62, 0.3, 0.26], [0.93, 0.78, 0.68]],
    })
}

fn crisped() -> Result<Recipe> {
    Ok(Recipe {
        contact: laws(Law::Uniform(2.2), Law::Disc(4.2), 0.52)?,
        units: 40.0,
        negative: "none",
        positive: "out,0.03,sqrt",
        colours: [[0.3, 0.17, 0.09], [0.42, 0.25, 0.14]],
    })
}

fn clay() -> Result<Recipe> {
    Ok(Recipe {
        contact: laws(Law::Disc(5.0), Law::Disc(6.0), 0.54)?,
        units: 30.0,
        negative: "in,0.02,sqrt",
        positive: "out,0.012,sqrt",
        colours: [[0.34, 0.3, 0.27], [0.52, 0.47, 0.42]],
    })
}

fn planet() -> Result<Recipe> {
    Ok(Recipe {
        contact: laws(Law::Exponential(5.0), Law::Exponential(2.5), 0.35)?,
        units: 36.65,
        negative: "none",
        positive: "out,0.016,sqrt",
        colours: [[0.12, 0.27, 0.5], [0.5, 0.54, 0.3]],
    })
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

/// Figure 6: two regions, and how far their points lie from each other over the surface.
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

/// The mesh coloured by its labels, those below `from` left white.
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

/// Shares over the signed bins, negative ones first; both sides padded to `bins`.
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

/// The nearest vertex of a mesh, by cells.
struct Nearest<'a> {
    points: &'a [Point3<f64>],
    low: Point3<f64>,
    cell: f64,
    sides: [usize; 3],
    starts: Vec<usize>,
    order: Vec<u32>,
}

impl<'a> Nearest<'a> {
    fn new(mesh: &'a TriangleMesh) -> Self {
        let points = &mesh.vertices;
        let (low, high) = mesh.bounding_box().unwrap_or_default();
        // A few points a cell of a surface.
        let cell = ((high - low).amax() / (points.len().max(1) as f64 / 6.0).sqrt()).max(1e-9);
        let sides = [0, 1, 2].map(|k| ((high[k] - low[k]) / cell) as usize + 1);
        let mut made = Self {
            points,
            low,
            cell,
            sides,
            starts: vec![0; sides.iter().product::<usize>() + 1],
            order: (0..points.len() as u32).collect(),
        };
        let cells: Vec<usize> = points.iter().map(|p| made.index(made.place(p))).collect();
        made.order.sort_by_key(|&v| cells[v as usize]);
        for &cell in &cells {
            made.starts[cell + 1] += 1;
        }
        for cell in 1..made.starts.len() {
            made.starts[cell] += made.starts[cell - 1];
        }
        made
    }

    fn place(&self, p: &Point3<f64>) -> [usize; 3] {
        [0, 1, 2].map(|k| (((p[k] - self.low[k]) / self.cell).max(0.0) as usize).min(self.sides[k] - 1))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.sides[1] + y) * self.sides[0] + x
    }

    /// Mean of the values about a point, the near ones above all.
    fn mean(&self, p: &Point3<f64>, values: &[f64]) -> f64 {
        let place = self.place(p);
        let range = |k: usize| place[k].saturating_sub(1)..=(place[k] + 1).min(self.sides[k] - 1);
        let (mut sum, mut of) = (0.0, 1e-300);
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let cell = self.index([x, y, z]);
                    for &v in &self.order[self.starts[cell]..self.starts[cell + 1]] {
                        let far = (self.points[v as usize] - p).norm_squared() / (self.cell * self.cell);
                        let weight = (-16.0 * far).exp();
                        sum += weight * values[v as usize];
                        of += weight;
                    }
                }
            }
        }
        sum / of
    }

    fn vertex(&self, p: &Point3<f64>) -> Option<usize> {
        let place = self.place(p);
        let mut best: Option<(f64, u32)> = None;
        for reach in 1..4_usize {
            let range = |k: usize| place[k].saturating_sub(reach)..=(place[k] + reach).min(self.sides[k] - 1);
            for z in range(2) {
                for y in range(1) {
                    for x in range(0) {
                        let cell = self.index([x, y, z]);
                        for &v in &self.order[self.starts[cell]..self.starts[cell + 1]] {
                            let far = (self.points[v as usize] - p).norm_squared();
                            if best.is_none_or(|(least, _)| far < least) {
                                best = Some((far, v));
                            }
                        }
                    }
                }
            }
            if best.is_some() {
                break;
            }
        }
        best.map(|(_, v)| v as usize)
    }
}
