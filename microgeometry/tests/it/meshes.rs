//! Open meshes, connected components, refinement, relief, simplification.

use nalgebra::Vector3;
use proptest::prelude::*;
use stereology_microgeometry::{
    ContactDistribution, EdgeCensus, Method, Offset, ReconstructOptions, Weighting, displace, refined, simplified,
};
use stereology_shape::{ClosedMesh, Subdivision, TriangleMesh};

use crate::{on, random_field};

fn area(mesh: &TriangleMesh) -> f64 {
    let corners = |t: &[u32; 3]| t.map(|v| mesh.vertices[v as usize]);
    mesh.triangles
        .iter()
        .map(|t| {
            let [a, b, c] = corners(t);
            0.5 * (b - a).cross(&(c - a)).norm()
        })
        .sum()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Splitting edges changes neither area nor volume nor whether the mesh is closed, and leaves no long edge.
    #[test]
    fn midpoints_keep_the_surface(sides in prop::array::uniform3(0.5..5.0_f64), length in 0.2..2.0_f64) {
        let mesh = TriangleMesh::cuboid(sides);
        let fine = refined(&mesh, Subdivision::Midpoint, length).unwrap();
        prop_assert!((area(&fine) / area(&mesh) - 1.0).abs() < 1e-9);
        let volume = ClosedMesh::try_from(fine.clone()).unwrap().volume();
        prop_assert!((volume / sides.iter().product::<f64>() - 1.0).abs() < 1e-9);
        for t in &fine.triangles {
            for k in 0..3 {
                prop_assert!((fine.vertices[t[k] as usize] - fine.vertices[t[(k + 1) % 3] as usize]).norm() <= length);
            }
        }
    }

    /// A relief of no height is the mesh itself.
    #[test]
    fn still_regions_stay(seed in 0..100_u64) {
        let mesh = TriangleMesh::torus(2.0, 0.6, 30, 15);
        let labels: Vec<f64> = (0..mesh.triangles.len()).map(|t| ((t as u64 * 31 + seed) % 17) as f64 - 8.0).collect();
        let relief = displace(&mesh, &labels, &Offset::still(), &Offset::still()).unwrap();
        prop_assert_eq!(relief.mesh, mesh);
    }
}

/// Loop's scheme on an open mesh: the border stays a border, the surface gets finer.
#[test]
fn loop_works_on_open_meshes() {
    let mut cup = TriangleMesh::icosphere(2.0, 2);
    cup.triangles
        .retain(|t| t.iter().all(|&v| cup.vertices[v as usize].z < 0.4));
    let fine = refined(&cup, Subdivision::Loop, 0.1).unwrap();
    assert!(EdgeCensus::of(&cup).border > 0 && EdgeCensus::of(&fine).crowded == 0);
    assert!(EdgeCensus::of(&fine).border >= 2 * EdgeCensus::of(&cup).border);
    assert!((area(&fine) / area(&cup) - 1.0).abs() < 0.1);
}

/// One region alone has no interface: labels still have the required distribution, on small triangles and on large
/// ones.
#[test]
fn one_region_is_labelled_too() {
    for (negative, positive) in [(vec![], vec![3.0, 2.0, 1.0]), (vec![3.0, 2.0, 1.0], vec![])] {
        for units in [4.0, 30.0] {
            let of = ContactDistribution::new(1.0, negative.clone(), positive.clone()).unwrap();
            let made = on(
                &TriangleMesh::icosphere(2.0, 4),
                units,
                &of,
                &ReconstructOptions::default(),
            );
            assert_eq!((made.violations, made.emd_measured), (0, None));
            assert!(made.emd_labels < 0.1, "{units} {}", made.emd_labels);
        }
    }
}

/// Every connected component gets its fraction of both regions.
#[test]
fn pieces_get_their_shares() {
    let of = random_field(3, 18.0);
    let small = TriangleMesh::icosphere(1.6, 4).mapped(|p| p + Vector3::new(4.0, 0.0, 0.0));
    let both = TriangleMesh::icosphere(2.0, 4).with(&small);
    let made = on(
        &both,
        80.0,
        &of,
        &ReconstructOptions::default().with_weighting(Weighting::Count),
    );
    assert_eq!(made.components, 2);
    for piece in made.labels.chunks(5120) {
        let share = piece.iter().filter(|x| !x.is_sign_negative()).count() as f64 / 5120.0;
        assert!((share - of.positive_share()).abs() < 0.02, "{share}");
    }
}

/// On a mesh with triangles of very different size the distribution is that of the area, or, by the paper's method,
/// that of the triangles.
#[test]
fn uneven_meshes_are_weighted_by_area() {
    let mut mesh = TriangleMesh::icosphere(2.0, 4);
    // One half four times finer.
    let (fine, coarse): (Vec<_>, Vec<_>) = mesh
        .triangles
        .iter()
        .copied()
        .partition(|t| mesh.vertices[t[0] as usize].x > 0.0);
    let split = |triangles: Vec<[u32; 3]>, length: f64| {
        let part = TriangleMesh {
            vertices: mesh.vertices.clone(),
            triangles,
        };
        refined(&part, Subdivision::Midpoint, length).unwrap()
    };
    mesh = split(coarse, 1.0).with(&split(fine, 0.045));
    mesh.weld();
    let of = random_field(4, 22.0);
    let made = on(&mesh, 50.0, &of, &ReconstructOptions::default());
    assert!(made.emd_labels < 0.05 && made.violations == 0, "{}", made.emd_labels);
    let paper = on(
        &mesh,
        50.0,
        &of,
        &ReconstructOptions::default().with_method(Method::Paper),
    );
    assert_eq!(paper.violations, 0);
}

/// Simplification keeps closed meshes closed, open ones open, and flat parts go first.
#[test]
fn simplification_spends_triangles_on_relief() {
    let ball = TriangleMesh::icosphere(2.0, 5);
    let labels: Vec<f64> = ball
        .triangles
        .iter()
        .map(|t| {
            let p = ball.vertices[t[0] as usize];
            if p.x > 0.0 {
                2.0 * (14.0 * p.y).sin() * (14.0 * p.z).sin()
            } else {
                0.0
            }
        })
        .collect();
    let offset = |text: &str| text.parse::<Offset>().unwrap();
    let relief = displace(&ball, &labels, &offset("in,0.03,x"), &offset("out,0.03,x")).unwrap();
    let simple = simplified(&relief.mesh, &relief.values, 4000);
    assert_eq!(EdgeCensus::of(&simple.mesh), EdgeCensus { border: 0, crowded: 0 });
    assert!(simple.mesh.triangles.len() <= 4000 && simple.values.len() == simple.mesh.vertices.len());
    let rough = simple
        .mesh
        .triangles
        .iter()
        .filter(|t| simple.mesh.vertices[t[0] as usize].x > 0.0)
        .count();
    assert!(rough > 2 * (simple.mesh.triangles.len() - rough), "{rough}");
    let before = ClosedMesh::try_from(relief.mesh).unwrap().volume();
    let after = ClosedMesh::try_from(simple.mesh).unwrap().volume();
    assert!((after / before - 1.0).abs() < 0.01);
}
