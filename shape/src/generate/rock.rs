//! Random rocks: angular convex fragments like crushed stone, one per seed.

use nalgebra::{Point3, Vector3};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, UnitSphere};

use crate::generate::spherical_harmonics::Roughness;
use crate::generate::superellipsoid::star;
use crate::mesh::closed_mesh::ClosedMesh;
use crate::mesh::hull::convex_hull;
use crate::mesh::measures::double_area;
use crate::mesh::mesh_error::MeshError;

/// A convex rock of 16 to 38 triangular faces, about one unit across; the same mesh for the same seed.
///
/// The hull of 11 to 21 points spread over an ellipsoid of random proportions (1 : 0.7–0.95 : 0.5–0.85) and moved
/// inwards at random, so that faces differ in size like those of crushed stone.
pub(crate) fn rock(seed: u64) -> ClosedMesh {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // Points moved inside the hull of the others may leave too few faces; then draw again.
    loop {
        match convex_hull(&chip(&mut rng)) {
            Ok(hull) if hull.triangles().len() >= 16 => return hull,
            _ => {}
        }
    }
}

/// The rock of a seed with a rough surface: its radius in every direction times exp(amplitude × g), g a random function
/// of mean square 1.
///
/// 5,120 triangles; star-shaped, so it cannot intersect itself. Usually not convex.
pub(crate) fn rough_rock(seed: u64, amplitude: f64) -> Result<ClosedMesh, MeshError> {
    let smooth = rock(seed);
    let centre = smooth.centroid().coords;
    let faces: Vec<(Vector3<f64>, f64)> = (0..smooth.triangles().len())
        .map(|t| {
            let corners = smooth.as_triangle_mesh().corners(t);
            let normal = double_area(&corners);
            (normal, normal.dot(&(corners[0].coords - centre)))
        })
        .collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(1);
    let rough = Roughness::random(&mut rng);
    ClosedMesh::try_from(star(4, |u| {
        // The first face hit by a ray from the centre.
        let reach = faces
            .iter()
            .map(|(normal, height)| (normal.dot(u), height))
            .filter(|(slope, _)| *slope > 0.0)
            .map(|(slope, height)| height / slope)
            .fold(f64::INFINITY, f64::min);
        reach * (amplitude * rough.at(u)).exp()
    }))
}

/// Points on an ellipsoid, each moved inwards by up to 0.22 of its distance.
fn chip(rng: &mut impl Rng) -> Vec<Point3<f64>> {
    let axes = Vector3::new(
        0.5,
        0.5 * rng.random_range(0.7..0.95),
        0.5 * rng.random_range(0.5..0.85),
    );
    let mut directions: Vec<Vector3<f64>> = Vec::new();
    for _ in 0..rng.random_range(11..=21_u32) {
        directions.push(far_direction(rng, &directions));
    }
    directions
        .iter()
        .map(|d| Point3::from(axes.component_mul(d) * (1.0 - 0.22 * rng.random::<f64>())))
        .collect()
}

/// Of five random directions, the one farthest from those already chosen: well spread, but not evenly.
fn far_direction(rng: &mut impl Rng, taken: &[Vector3<f64>]) -> Vector3<f64> {
    let mut best = (f64::NEG_INFINITY, Vector3::z());
    for _ in 0..5 {
        let direction = Vector3::from(UnitSphere.sample(rng));
        let gap = taken
            .iter()
            .map(|other| (direction - other).norm_squared())
            .fold(4.0, f64::min);
        if gap > best.0 {
            best = (gap, direction);
        }
    }
    best.1
}
