//! Boxes and cylinders, whose sections have areas in closed form: their laws by quadrature over directions and
//! bisection over depths, without a mesh, a sweep or a random number; and what the sweep says of them.

use crate::meshes::body;
use approx::assert_relative_eq;
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, PI};
use stereology_kmatrix::{SectionLaw, SectionOptions};
use stereology_shape::{Body, TriangleMesh};

/// Six and a tenth standard errors of 32 rotations are a false-alarm rate of one in a million (Student's t).
const ALARM: f64 = 6.1;
const BINS: usize = 5;
/// Directions of the quadrature: no two share a height, for a prism's sections have one area for all that do.
const DIRECTIONS: usize = 20_000;

/// A body with a centre, whose central section is the largest of every direction (convex: Brunn).
trait Central {
    /// Half the extent across a direction of the first octant.
    fn half_width(&self, direction: &Vector3<f64>) -> f64;
    /// Area of the section across it at a depth from the centre.
    fn area(&self, direction: &Vector3<f64>, depth: f64) -> f64;
}

/// Half of the edges.
struct Brick([f64; 3]);

impl Central for Brick {
    fn half_width(&self, direction: &Vector3<f64>) -> f64 {
        direction.dot(&Vector3::from(self.0))
    }

    /// What lies below the plane in the positive octant of the lowest corner is a simplex; those of the other seven
    /// corners are taken away and added again. A = Σ ± (h − h_corner)₊² / (2 u₁ u₂ u₃).
    fn area(&self, direction: &Vector3<f64>, depth: f64) -> f64 {
        let corners = (0..8_u8).map(|corner| {
            let side = |axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
            let height: f64 = (0..3).map(|axis| side(axis) * direction[axis] * self.0[axis]).sum();
            -side(0) * side(1) * side(2) * (depth - height).max(0.0).powi(2)
        });
        corners.sum::<f64>() / (2.0 * direction.product())
    }
}

/// Radius, and half the length along z.
struct Can(f64, f64);

impl Can {
    /// Area of the part of the circle left of x.
    fn segment(&self, x: f64) -> f64 {
        let x = x.clamp(-self.0, self.0);
        x * (self.0 * self.0 - x * x).max(0.0).sqrt() + self.0 * self.0 * ((x / self.0).asin() + FRAC_PI_2)
    }
}

impl Central for Can {
    fn half_width(&self, direction: &Vector3<f64>) -> f64 {
        self.0 * direction.xy().norm() + self.1 * direction.z
    }

    /// Seen along the axis the section is a strip of the circle.
    fn area(&self, direction: &Vector3<f64>, depth: f64) -> f64 {
        let (sine, cosine) = (direction.xy().norm(), direction.z);
        let end = |z: f64| (depth + cosine * z) / sine;
        (self.segment(end(self.1)) - self.segment(end(-self.1))) / cosine
    }
}

/// What quadrature says of a body.
struct Quadrature {
    matrix: [[f64; BINS]; BINS],
    caliper: f64,
    volume: f64,
    energy: f64,
    max_area: f64,
}

/// A lattice over the octant; depths by bisection.
fn quadrature(of: &impl Central) -> Quadrature {
    let directions: Vec<Vector3<f64>> = (0..DIRECTIONS)
        .map(|k| {
            let z = (k as f64 + 0.5) / DIRECTIONS as f64;
            let angle = FRAC_PI_2 * (0.618_033_988_749_894_9 * (k as f64 + 0.5)).fract();
            let radius = (1.0 - z * z).sqrt();
            Vector3::new(radius * angle.cos(), radius * angle.sin(), z)
        })
        .collect();
    let share = 1.0 / DIRECTIONS as f64;
    let max_area = largest(of);
    let (mut caliper, mut volume, mut energy) = (0.0, 0.0, 0.0);
    let mut below = [[0.0; BINS + 1]; BINS];
    for direction in &directions {
        let half = of.half_width(direction);
        caliper += 2.0 * half * share;
        let steps = 64;
        for k in 0..steps {
            let area = of.area(direction, -half * (f64::from(k) + 0.5) / f64::from(steps));
            volume += 2.0 * half / f64::from(steps) * area * share;
            energy += 2.0 * half / f64::from(steps) * area * area * share;
        }
        for (j, column) in below.iter_mut().enumerate() {
            for (i, length) in column.iter_mut().enumerate().take(j + 2).skip(1) {
                let ratio = i as f64 / (j + 1) as f64;
                *length += depths_up_to(of, direction, half, ratio * ratio * max_area) * share;
            }
        }
    }
    let mut matrix = [[0.0; BINS]; BINS];
    for (j, column) in below.iter().enumerate() {
        for i in 0..=j {
            matrix[i][j] = (j + 1) as f64 / BINS as f64 * (column[i + 1] - column[i]) / caliper;
        }
    }
    Quadrature {
        matrix,
        caliper,
        volume,
        energy,
        max_area,
    }
}

/// Length of depths with a section of at most this area: areas rise up to the centre.
fn depths_up_to(of: &impl Central, direction: &Vector3<f64>, half: f64, area: f64) -> f64 {
    if of.area(direction, 0.0) <= area {
        return 2.0 * half;
    }
    let (mut low, mut high) = (-half, 0.0);
    for _ in 0..36 {
        let middle = 0.5 * (low + high);
        if of.area(direction, middle) <= area {
            low = middle;
        } else {
            high = middle;
        }
    }
    2.0 * (half + low)
}

/// The largest central section, by ever finer scans of the octant.
fn largest(of: &impl Central) -> f64 {
    let (mut best, mut centre, mut reach) = (0.0_f64, [0.5_f64, 0.5], 0.5);
    for _ in 0..24 {
        let from = centre;
        for k in 0..41 * 41 {
            let at = |c: f64, step: usize| (c + reach * (step as f64 / 20.0 - 1.0)).clamp(1e-6, 1.0 - 1e-6);
            let (z, angle) = (at(from[0], k / 41), at(from[1], k % 41));
            let (radius, turn) = ((1.0 - z * z).sqrt(), FRAC_PI_2 * angle);
            let area = of.area(&Vector3::new(radius * turn.cos(), radius * turn.sin(), z), 0.0);
            if area > best {
                (best, centre) = (area, [z, angle]);
            }
        }
        reach *= 0.5;
    }
    best
}

/// The law of the mesh, for every seed, is within its reported error of the quadrature; `slack` is what quadrature and
/// tessellation are off by.
fn judge(name: &str, exact: &Quadrature, body: &Body, slack: f64) {
    assert_relative_eq!(body.largest_section_area(), exact.max_area, max_relative = slack);
    assert_relative_eq!(body.mean_width(), exact.caliper, max_relative = 1e-3);
    for seed in 0..4 {
        let tolerance = if seed == 0 { 3e-4 } else { 2e-3 };
        let options = SectionOptions::default()
            .with_bins(BINS)
            .with_tolerance(tolerance)
            .with_seed(seed);
        let law = SectionLaw::of_body(body, &options).unwrap();
        let (matrix, error) = (law.k_matrix(BINS), law.standard_error(BINS));
        assert!(error > 0.0 && error <= tolerance);
        for i in 0..BINS {
            for j in i..BINS {
                let apart = (matrix[(i, j)] - exact.matrix[i][j]).abs();
                assert!(
                    apart <= ALARM * error + slack,
                    "{name}, seed {seed}, ({i}, {j}): {apart} apart, error {error}"
                );
            }
        }
        let energy_error = law.mean_square_section_area_standard_error() * law.caliper_hull();
        let apart = (law.self_energy() - exact.energy).abs();
        assert!(
            apart <= ALARM * energy_error + 2e-3 * exact.energy,
            "{name}: energy {apart} apart"
        );
        assert_relative_eq!(
            law.mean_profile_area(),
            exact.volume / exact.caliper,
            max_relative = 2e-3
        );
    }
}

#[test]
fn boxes_have_the_law_of_their_closed_form() {
    for edges in [[1.0, 1.0, 1.0], [1.0, 2.0, 3.0], [1.0, 1.0, 0.2], [0.4, 0.5, 3.0]] {
        let exact = quadrature(&Brick(edges.map(|edge| 0.5 * edge)));
        assert_relative_eq!(exact.caliper, 0.5 * edges.iter().sum::<f64>(), max_relative = 3e-4);
        assert_relative_eq!(exact.volume, edges.iter().product(), max_relative = 1e-3);
        // Through two opposite edges, the longest there are.
        let longest = edges.iter().copied().fold(0.0, f64::max);
        let across = (edges.iter().map(|edge| edge * edge).sum::<f64>() - longest * longest).sqrt();
        assert_relative_eq!(exact.max_area, longest * across, max_relative = 1e-5);
        judge(&format!("box {edges:?}"), &exact, &Body::cuboid(edges).unwrap(), 5e-4);
    }
}

#[test]
fn cylinders_have_the_law_of_their_closed_form() {
    for (diameter, length) in [(1.0, 2.0), (1.0, 0.3), (1.0, 1.0)] {
        let exact = quadrature(&Can(0.5 * diameter, 0.5 * length));
        assert_relative_eq!(exact.caliper, 0.5 * length + 0.25 * PI * diameter, max_relative = 3e-4);
        assert_relative_eq!(
            exact.volume,
            0.25 * PI * diameter * diameter * length,
            max_relative = 1e-3
        );
        let mesh = body(TriangleMesh::cylinder(diameter, length, 360));
        judge(&format!("cylinder {diameter} x {length}"), &exact, &mesh, 5e-4);
    }
}

/// The program's own cylinder, of 128 sides, is as good.
#[test]
fn cylinder_of_128_sides_is_a_cylinder_to_a_thousandth() {
    judge(
        "cylinder",
        &quadrature(&Can(0.5, 1.0)),
        &Body::cylinder(1.0, 2.0).unwrap(),
        1e-3,
    );
}
