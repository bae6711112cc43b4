//! Bodies and kinds of relief that figures 1 to 9 of Schroeder et al. 2005 show.

use std::f64::consts::{PI, TAU};

use anyhow::Result;
use nalgebra::Point3;
use ndarray::Array2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology::microgeometry::{ContactDistribution, EstimateOptions, Law, contact_of_image, refined};
use stereology::shape::{Body, Subdivision, TriangleMesh};

/// Parameters of a relief.
pub struct Recipe {
    pub contact: ContactDistribution,
    pub units: f64,
    pub negative: &'static str,
    pub positive: &'static str,
    pub colours: [[f32; 3]; 2],
}

fn laws(negative: Law, positive: Law, share: f64) -> Result<ContactDistribution> {
    Ok(ContactDistribution::from_laws(1.0, negative, positive, share)?)
}

/// Light and dark of a random field, the simplest texture.
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
    Ok(contact_of_image(picture.view(), &EstimateOptions::default())?)
}

pub fn fine(mesh: TriangleMesh, edge: f64) -> Result<TriangleMesh> {
    Ok(refined(&mesh, Subdivision::Midpoint, edge)?)
}

/// A box with rounded edges. It is split first, so that Loop's scheme rounds only the edges.
pub fn bar() -> Result<TriangleMesh> {
    let boxy = fine(TriangleMesh::cuboid([2.0, 0.72, 0.84]), 0.22)?;
    Ok(refined(&boxy, Subdivision::Loop, 0.028)?)
}

pub fn disc() -> Result<TriangleMesh> {
    fine(
        Body::superellipsoid([1.0, 0.28, 1.0], [0.6, 1.0])?.to_triangles(5),
        0.03,
    )
}

pub fn ball() -> TriangleMesh {
    TriangleMesh::icosphere(2.0, 6)
}

pub fn ring() -> TriangleMesh {
    TriangleMesh::torus(1.4, 0.6, 200, 90)
}

/// A smooth step from 0 to 1 between two positions.
fn smooth(from: f64, to: f64, at: f64) -> f64 {
    let t = ((at - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// An arrowhead: a tang, barbs, a tip.
pub fn blade() -> Result<TriangleMesh> {
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

/// A simple head: a long ellipsoid on a neck.
pub fn bust() -> Result<TriangleMesh> {
    let shaped = TriangleMesh::icosphere(2.0, 5).mapped(|p| {
        let t = (PI * (p.y + 1.0) / 2.0).clamp(0.0, PI);
        let wide = 0.34 + 0.14 * (1.0 + (2.0 * (t - 2.1)).cos());
        let nose = 0.16 * (-16.0 * (p.x * p.x + (p.y - 0.25).powi(2))).exp() * p.z.max(0.0);
        Point3::new(wide * p.x, 1.1 * p.y, (wide * 1.1) * p.z + nose)
    });
    fine(shaped, 0.03)
}

pub fn chipped() -> Result<Recipe> {
    Ok(Recipe {
        contact: field()?,
        units: 60.0,
        negative: "in,0.012,sqrt",
        positive: "out,0.012,sqrt",
        colours: [[0.16, 0.42, 0.44], [0.36, 0.68, 0.66]],
    })
}

pub fn coral() -> Result<Recipe> {
    Ok(Recipe {
        contact: laws(Law::Disc(5.0), Law::Disc(2.2), 0.34)?,
        units: 50.0,
        negative: "in,0.03,sqrt",
        positive: "out,0.006,sqrt",
        colours: [[0.62, 0.3, 0.26], [0.93, 0.78, 0.68]],
    })
}

pub fn crisped() -> Result<Recipe> {
    Ok(Recipe {
        contact: laws(Law::Uniform(2.2), Law::Disc(4.2), 0.52)?,
        units: 40.0,
        negative: "none",
        positive: "out,0.03,sqrt",
        colours: [[0.3, 0.17, 0.09], [0.42, 0.25, 0.14]],
    })
}

pub fn clay() -> Result<Recipe> {
    Ok(Recipe {
        contact: laws(Law::Disc(5.0), Law::Disc(6.0), 0.54)?,
        units: 30.0,
        negative: "in,0.02,sqrt",
        positive: "out,0.012,sqrt",
        colours: [[0.34, 0.3, 0.27], [0.52, 0.47, 0.42]],
    })
}

pub fn planet() -> Result<Recipe> {
    Ok(Recipe {
        contact: laws(Law::Exponential(5.0), Law::Exponential(2.5), 0.35)?,
        units: 36.65,
        negative: "none",
        positive: "out,0.016,sqrt",
        colours: [[0.12, 0.27, 0.5], [0.5, 0.54, 0.3]],
    })
}
