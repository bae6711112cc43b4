//! Every identity of the section law, on meshes drawn at random: rocks, rough rocks, boxes, prisms over random
//! polygons, tori, unions of cubes, hollow ones, pairs; stretched, turned and moved.

use crate::meshes::{body, cubes, placed};
use nalgebra::{Point3, UnitVector3, Vector3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::f64::consts::PI;
use stereology_kmatrix::{SectionLaw, SectionOptions};
use stereology_shape::{Body, ClosedMesh, SectionAreas, Subdivision, TriangleMesh, section_polygons};

/// Six and a tenth standard errors of 32 rotations are a false-alarm rate of one in a million (Student's t).
const ALARM: f64 = 6.1;

fn law(body: &Body, directions: usize) -> SectionLaw {
    SectionLaw::of_body(body, &SectionOptions::default().with_directions(directions)).unwrap()
}

/// A prism over a star-shaped polygon.
fn prism(radii: &[f64], height: f64) -> TriangleMesh {
    let sides = u32::try_from(radii.len()).unwrap();
    let mut mesh = TriangleMesh::default();
    for z in [0.0, height] {
        mesh.vertices.push(Point3::new(0.0, 0.0, z));
        mesh.vertices.extend((0_u32..).zip(radii).map(|(k, radius)| {
            let angle = 2.0 * PI * f64::from(k) / f64::from(sides);
            Point3::new(radius * angle.cos(), radius * angle.sin(), z)
        }));
    }
    let top = sides + 1;
    for k in 0..sides {
        let (a, b) = (k + 1, (k + 1) % sides + 1);
        mesh.triangles.extend([
            [0, b, a],
            [top, top + a, top + b],
            [a, b, top + b],
            [a, top + b, top + a],
        ]);
    }
    mesh
}

/// Cubes of a grid of 3³; solids that touch themselves in an edge or corner are left out.
fn union(mask: u32) -> Option<TriangleMesh> {
    let cells: Vec<[i32; 3]> = (0..27)
        .filter(|k| mask >> k & 1 == 1)
        .map(|k| [k % 3, k / 3 % 3, k / 9])
        .collect();
    let mesh = cubes(&cells);
    ClosedMesh::try_from(mesh.clone()).ok().map(|_| mesh)
}

fn solids() -> impl Strategy<Value = TriangleMesh> {
    let edge = 0.3..3.0_f64;
    let mesh = prop_oneof![
        (0_u64..1000).prop_map(|seed| Body::rock(seed).to_triangles(0)),
        prop::array::uniform3(edge.clone()).prop_map(TriangleMesh::cuboid),
        (prop::collection::vec(0.4..1.6_f64, 5..12), edge.clone()).prop_map(|(radii, height)| prism(&radii, height)),
        (0.3..0.9_f64, 8_u32..20, 5_u32..10)
            .prop_map(|(tube, around, across)| TriangleMesh::torus(2.0, tube, around, across)),
        (1_u32..1 << 27).prop_filter_map("touches itself", |mask| union(mask | 1 << 13)),
        Just(union(!(1 << 13)).unwrap()),
        (0_u64..1000).prop_map(|seed| {
            let rock = Body::rock(seed).to_triangles(0);
            rock.clone().with(&placed(&rock, [0.3, 0.2, 0.1], 0.7, [2.0, 0.5, 0.0]))
        }),
    ];
    (
        mesh,
        prop::array::uniform3(0.6..1.6_f64),
        prop::array::uniform3(-3.0..3.0_f64),
    )
        .prop_map(|(mesh, stretch, turn)| {
            let stretched = mesh.mapped(|p| Point3::from(p.coords.component_mul(&Vector3::from(stretch))));
            placed(&stretched, turn, 1.0, [0.5, -2.0, 1.0])
        })
}

/// ½ ∬ dx dy / |x − y| over the solid, by the divergence theorem twice: −¼ ∮∮ |x − y| n·n′ dS dS′, smooth but for the
/// kink where x = y.
fn self_energy(mesh: &TriangleMesh) -> f64 {
    let points: Vec<(Vector3<f64>, Vector3<f64>)> = mesh
        .triangles
        .iter()
        .flat_map(|corners| {
            let [a, b, c] = corners.map(|v| mesh.vertices[v as usize].coords);
            let area = 0.5 * (b - a).cross(&(c - a));
            // Three points, exact for polynomials of degree 2.
            [(a, b, c), (b, c, a), (c, a, b)].map(|(a, b, c)| ((4.0 * a + b + c) / 6.0, area / 3.0))
        })
        .collect();
    let mut sum = 0.0;
    for (k, (x, at_x)) in points.iter().enumerate() {
        sum += points[..k]
            .iter()
            .map(|(y, at_y)| (x - y).norm() * at_x.dot(at_y))
            .sum::<f64>();
    }
    -0.5 * sum
}

/// The mesh with each triangle in four until there are several hundred.
fn finer(mesh: &TriangleMesh) -> TriangleMesh {
    let closed = ClosedMesh::try_from(mesh.clone()).unwrap();
    let times = (0..4)
        .find(|times| mesh.triangles.len() << (2 * times) >= 600)
        .unwrap_or(4);
    closed.subdivided(Subdivision::Midpoint, times)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, max_shrink_iters: 40, rng_seed: RngSeed::Fixed(3), ..ProptestConfig::default() })]

    /// ∫ A dh = V along **every** direction, not on average.
    #[test]
    fn volume_is_the_integral_of_areas_for_every_direction(mesh in solids(), directions in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 20)) {
        let closed = ClosedMesh::try_from(mesh).unwrap();
        let mut areas = SectionAreas::new(&closed);
        for direction in directions {
            let Some(direction) = Vector3::from(direction).try_normalize(1e-3) else { continue };
            let defect = areas.sweep(&direction, |_, _, _| {});
            prop_assert!(defect < 1e-6, "{defect}");
        }
    }

    /// Mean area of a profile V / H_eff, from the distribution itself; columns; the count of profiles less holes;
    /// convex bodies show one profile.
    #[test]
    fn first_moments_and_counts(mesh in solids()) {
        let body = body(mesh);
        let law = law(&body, 32 * 12);
        let steps = 4_000;
        let mean: f64 = (0..steps)
            .map(|k| (f64::from(k) + 0.5) / f64::from(steps))
            .map(|x| 2.0 * x * (1.0 - law.cdf(x)) / f64::from(steps))
            .sum();
        // F between its nodes is a cubic, and H_holes has an error of its own.
        let slack = 0.01 + ALARM * law.caliper_effective_standard_error() / law.caliper_effective();
        prop_assert!((mean * law.max_area() / law.mean_profile_area() - 1.0).abs() < slack);
        prop_assert!(law.chi_discrepancy() < ALARM, "{}", law.chi_discrepancy());
        prop_assert!(law.largest_area_met() <= law.max_area() * (1.0 + 1e-3));
        let matrix = law.k_matrix(7);
        for (j, column) in matrix.column_iter().enumerate() {
            prop_assert!((column.sum() - (j + 1) as f64 / 7.0).abs() < 1e-12);
            prop_assert!(column.iter().all(|k| *k >= 0.0));
        }
        if body.is_convex() {
            prop_assert!((law.profiles_per_hit() - 1.0).abs() < 1e-9);
            prop_assert!((law.caliper_chi() / law.caliper_hull() - 1.0).abs() < 1e-9);
        } else {
            prop_assert!(law.caliper_effective() >= law.caliper_chi() - 1e-12);
        }
    }

    /// ⟨A²⟩ of whole sections is the self-energy of the solid; ⟨A²⟩ of profiles is not above it.
    #[test]
    fn mean_square_area_is_the_self_energy(mesh in solids()) {
        let fine = finer(&mesh);
        let law = law(&body(mesh), 32 * 12);
        let energy = self_energy(&fine);
        let error = law.mean_square_section_area_standard_error() * law.caliper_hull();
        // Quadrature: 3e-3 at 600 triangles.
        prop_assert!((law.self_energy() - energy).abs() < ALARM * error + 3e-3 * energy, "{} {energy} {error}", law.self_energy());
        let of_profiles = law.mean_square_profile_area() * law.caliper_effective();
        prop_assert!(of_profiles <= law.self_energy() * (1.0 + 1e-9));
    }

    /// Mean outline of the sections of all planes: π S / 4, whatever the topology.
    #[test]
    fn mean_perimeter_is_a_quarter_of_pi_of_the_surface(mesh in solids()) {
        let closed = ClosedMesh::try_from(mesh).unwrap();
        let (directions, depths) = (48, 40);
        let mut sum = 0.0;
        for k in 0..directions {
            let z = (f64::from(k) + 0.5) / f64::from(directions);
            let (sin, cos) = (2.399_963_23 * f64::from(k)).sin_cos();
            let radius = (1.0 - z * z).sqrt();
            let normal = UnitVector3::new_normalize(Vector3::new(radius * cos, radius * sin, z));
            let heights = || closed.vertices().iter().map(|v| v.coords.dot(&normal));
            let (low, high) = heights().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| (low.min(h), high.max(h)));
            for depth in 0..depths {
                let offset = low + (high - low) * (f64::from(depth) + 0.5) / f64::from(depths);
                for profile in section_polygons(&closed, &normal, offset) {
                    for ring in std::iter::once(&profile.outer).chain(&profile.holes) {
                        let closing = ring.iter().cycle().skip(1);
                        sum += ring.iter().zip(closing).map(|(p, q)| (p - q).norm()).sum::<f64>() * (high - low);
                    }
                }
            }
        }
        let mean = sum / f64::from(directions * depths);
        let exact = 0.25 * PI * closed.surface_area();
        prop_assert!((mean / exact - 1.0).abs() < 0.04, "{mean} {exact}");
    }

    /// Nothing but lengths change with place, turn and unit; nothing at all with triangles cut in four.
    #[test]
    fn law_is_invariant(mesh in solids(), turn in prop::array::uniform3(-3.0..3.0_f64), exponent in -8..8_i32, shift in prop::array::uniform3(-50.0..50.0_f64)) {
        let scale = 10.0_f64.powi(exponent);
        let here = law(&body(mesh.clone()), 32 * 8);
        let there = law(&body(placed(&mesh, turn, scale, shift.map(|x| x * scale))), 32 * 8);
        let error = here.standard_error(10).hypot(there.standard_error(10));
        prop_assert!((here.k_matrix(10) - there.k_matrix(10)).amax() < ALARM * error + 1e-4);
        prop_assert!((there.caliper_hull() / scale / here.caliper_hull() - 1.0).abs() < 1e-9, "hull {}", there.caliper_hull() / scale / here.caliper_hull() - 1.0);
        prop_assert!((there.caliper_chi() / scale / here.caliper_chi() - 1.0).abs() < 1e-9);
        prop_assert!((there.max_area() / scale / scale / here.max_area() - 1.0).abs() < 1e-4);
        let once = ClosedMesh::try_from(mesh.clone()).unwrap().subdivided(Subdivision::Midpoint, 1);
        let finer = law(&body(once), 32 * 8);
        let apart = (here.k_matrix(10) - finer.k_matrix(10)).amax();
        // The same directions; the largest section is searched for anew.
        prop_assert!(apart < 1e-3 + 20.0 * (finer.max_area() / here.max_area() - 1.0).abs(), "{apart}");
        prop_assert!((finer.caliper_effective() / here.caliper_effective() - 1.0).abs() < 1e-6);
        prop_assert!((finer.self_energy() / here.self_energy() - 1.0).abs() < 1e-9);
    }
}

/// The same of rough rocks, which have thousands of triangles and hundreds of saddles: a few.
#[test]
fn rough_rocks_obey_too() {
    for (seed, roughness) in [(1, 0.02), (2, 0.1)] {
        let rock = Body::rough_rock(seed, roughness).unwrap();
        let law = law(&rock, 32 * 2);
        assert!(law.chi_discrepancy() < ALARM, "{}", law.chi_discrepancy());
        assert!(law.profiles_per_hit() >= 1.0);
        let energy = self_energy(&rock.to_triangles(0));
        let error = law.mean_square_section_area_standard_error() * law.caliper_hull();
        assert!(
            (law.self_energy() - energy).abs() < ALARM * error + 3e-3 * energy,
            "{} {energy}",
            law.self_energy()
        );
    }
}
