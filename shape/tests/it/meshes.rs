//! Repairs of meshes, errors and their positions; convex hulls.

use approx::assert_relative_eq;
use nalgebra::Point3;
use proptest::prelude::*;
use stereology_shape::{ClosedMesh, HullError, MeshError, Repair, TriangleMesh, convex_hull};

use crate::random_shapes::{fat_l, hollow_cube, points, polytopes, torus};

fn cube() -> TriangleMesh {
    TriangleMesh::cuboid([1.0; 3])
}

fn closed(mesh: TriangleMesh) -> Result<ClosedMesh, MeshError> {
    ClosedMesh::try_from(mesh)
}

#[test]
fn an_open_mesh_is_an_error_with_its_edges() {
    let mut open = cube();
    open.triangles.remove(0);
    let error = closed(open).unwrap_err();
    assert!(matches!(error, MeshError::OpenEdge { count: 3, .. }), "{error}");
    assert!(error.to_string().contains("-0.5"), "{error}");
}

#[test]
fn three_sheets_at_an_edge_are_refused() {
    let mut fins = cube();
    fins.vertices.push(Point3::new(3.0, 3.0, 3.0));
    // A second solid that shares an edge with the first: four triangles meet there.
    let second = TriangleMesh {
        vertices: [[0.5, 0.5, -0.5], [0.5, 0.5, 0.5], [2.0, 1.0, 0.0], [1.0, 2.0, 0.0]]
            .map(Point3::from)
            .to_vec(),
        triangles: vec![[0, 1, 3], [0, 3, 2], [0, 2, 1], [1, 2, 3]],
    };
    let error = closed(fins.with(&second)).unwrap_err();
    assert!(
        matches!(
            error,
            MeshError::NonManifoldEdge {
                triangles: 4,
                count: 1,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn numbers_are_checked_and_their_position_is_reported() {
    let mut nan = cube();
    nan.vertices[5].y = f64::NAN;
    assert_eq!(closed(nan).unwrap_err(), MeshError::NotFinite { vertex: 5 });
    let mut far = cube();
    far.triangles[7][1] = 8;
    assert_eq!(
        closed(far).unwrap_err(),
        MeshError::IndexOutOfRange {
            triangle: 7,
            index: 8,
            vertices: 8
        }
    );
    assert_eq!(closed(TriangleMesh::default()).unwrap_err(), MeshError::Empty);
    let flat = cube().mapped(|p| Point3::new(p.x, p.y, 0.0));
    assert!(closed(flat).is_err());
    assert!(matches!(
        closed(cube().mapped(|p| p * 1e120)).unwrap_err(),
        MeshError::Extent { .. }
    ));
}

#[test]
fn distant_large_and_small_meshes_are_measured_correctly() {
    for scale in [1e-30, 1e-3, 1e30] {
        let mesh = closed(cube().mapped(|p| p * scale)).unwrap();
        assert_relative_eq!(mesh.volume() / scale / scale / scale, 1.0, max_relative = 1e-12);
        assert_relative_eq!(mesh.mean_width() / scale, 1.5, max_relative = 1e-12);
        assert!(mesh.is_convex());
    }
    let mesh = closed(cube().mapped(|p| Point3::new(p.x + 1e9, p.y - 1e9, p.z + 1e9))).unwrap();
    assert_relative_eq!(mesh.volume(), 1.0, max_relative = 1e-9);
    assert_relative_eq!(mesh.mean_width(), 1.5, max_relative = 1e-9);
}

#[test]
fn an_inverted_mesh_is_reversed_and_reported() {
    let mut inverted = cube();
    inverted.triangles.iter_mut().for_each(|t| t.swap(0, 2));
    let mesh = closed(inverted).unwrap();
    assert_eq!(mesh.repairs(), [Repair::TurnedInsideOut { bodies: 1 }]);
    assert_relative_eq!(mesh.volume(), 1.0, max_relative = 1e-12);
}

#[test]
fn a_soup_of_separate_triangles_is_welded() {
    let cube = cube();
    let vertices: Vec<_> = cube
        .triangles
        .iter()
        .flatten()
        .map(|&i| cube.vertices[i as usize])
        .collect();
    let triangles = (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let mesh = closed(TriangleMesh { vertices, triangles }).unwrap();
    assert_eq!(mesh.vertices().len(), 8);
    assert_eq!(mesh.repairs(), [Repair::WeldedVertices { count: 28 }]);
}

#[test]
fn duplicates_flaps_and_degenerate_triangles_are_dropped() {
    let mut mesh = cube();
    let [a, b, c] = mesh.triangles[4];
    mesh.triangles.push([b, c, a]);
    mesh.triangles.push([a, a, b]);
    // A flap: the same triangle in both orientations, attached to nothing.
    mesh.vertices
        .extend([[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [5.0, 1.0, 0.0], [9.0, 9.0, 9.0]].map(Point3::from));
    mesh.triangles.extend([[8, 9, 10], [8, 10, 9]]);
    let mesh = closed(mesh).unwrap();
    let expected = [
        Repair::DroppedDegenerate { count: 1 },
        Repair::DroppedDuplicates { count: 3 },
        Repair::DroppedUnusedVertices { count: 4 },
    ];
    assert_eq!(mesh.repairs(), expected);
    assert_relative_eq!(mesh.volume(), 1.0, max_relative = 1e-12);
}

#[test]
fn a_klein_bottle_has_no_inside() {
    // A square grid of 6 × 6 cells glued with a twist.
    let at = |i: u32, j: u32| -> u32 {
        let (i, j) = if i == 6 { (0, (6 - j % 6) % 6) } else { (i, j % 6) };
        6 * i + j
    };
    let mut triangles = Vec::new();
    for i in 0..6 {
        for j in 0..6 {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    let vertices = (0..36_u32)
        .map(|i| Point3::new(f64::from(i), f64::from(i * i % 7), f64::from(i * i * i % 11)))
        .collect();
    assert!(matches!(
        closed(TriangleMesh { vertices, triangles }).unwrap_err(),
        MeshError::NotOrientable { .. }
    ));
}

#[test]
fn cavities_are_subtracted_and_bodies_apart_added() {
    assert_relative_eq!(hollow_cube().volume(), 7.0, max_relative = 1e-12);
    assert!(hollow_cube().repairs().is_empty());
    let wrong_cavity = TriangleMesh::cuboid([2.0; 3]).with(&cube());
    let mesh = closed(wrong_cavity).unwrap();
    assert_eq!(mesh.repairs(), [Repair::TurnedInsideOut { bodies: 1 }]);
    assert_relative_eq!(mesh.volume(), 7.0, max_relative = 1e-12);
    let apart = closed(cube().with(&cube().mapped(|p| Point3::new(p.x + 3.0, p.y, p.z)))).unwrap();
    assert_relative_eq!(apart.volume(), 2.0, max_relative = 1e-12);
    assert!(!apart.is_convex());
}

#[test]
fn triangles_without_area_do_not_spoil_angles() {
    // A cube with a vertex in the middle of an edge, used from one side only: a triangle of three corners on a line
    // fills the gap.
    let mut mesh = cube();
    let edge = mesh.triangles[0];
    mesh.vertices.push(nalgebra::center(
        &mesh.vertices[edge[0] as usize],
        &mesh.vertices[edge[1] as usize],
    ));
    mesh.triangles[0] = [8, edge[1], edge[2]];
    mesh.triangles.push([edge[0], 8, edge[2]]);
    mesh.triangles.push([edge[0], edge[1], 8]);
    let mesh = closed(mesh).unwrap();
    assert!(mesh.is_convex());
    assert_relative_eq!(mesh.signed_mean_width(), 1.5, max_relative = 1e-12);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// No point is outside any face of the hull by more than the rounding of this test.
    #[test]
    fn hulls_contain_all_their_points(points in points(4..200)) {
        let hull = convex_hull(&points).unwrap();
        for &[a, b, c] in hull.triangles() {
            let [a, b, c] = [a, b, c].map(|i| hull.vertices()[i as usize]);
            let normal = (b - a).cross(&(c - a));
            for p in &points {
                prop_assert!(normal.dot(&(p - a)) <= 1e-14);
            }
        }
        prop_assert_eq!(hull.triangles().len(), 2 * hull.vertices().len() - 4);
        prop_assert!(hull.is_convex());
    }

    /// Points on a grid: many in one plane, on one line or at one position.
    #[test]
    fn hulls_of_grid_points_are_sound(cells in prop::collection::vec([0..3_u8, 0..3_u8, 0..3_u8], 4..60)) {
        let points: Vec<Point3<f64>> = cells.iter().map(|c| Point3::from(c.map(f64::from))).collect();
        match convex_hull(&points) {
            Ok(hull) => {
                for &[a, b, c] in hull.triangles() {
                    let [a, b, c] = [a, b, c].map(|i| hull.vertices()[i as usize]);
                    let normal = (b - a).cross(&(c - a));
                    prop_assert!(points.iter().all(|p| normal.dot(&(p - a)) <= 0.0), "exact in small integers");
                }
            }
            Err(error) => prop_assert_eq!(error, HullError::Flat),
        }
    }

    #[test]
    fn a_hull_checked_as_any_mesh_is_the_same(mesh in polytopes()) {
        let again = closed(mesh.as_triangle_mesh().clone()).unwrap();
        prop_assert!(again.is_convex() && again.repairs().is_empty());
        assert_relative_eq!(again.mean_width(), mesh.mean_width(), max_relative = 1e-12);
        assert_relative_eq!(again.signed_mean_width(), mesh.mean_width(), max_relative = 1e-9);
    }

    #[test]
    fn any_triangles_give_a_mesh_or_an_error(
        points in points(1..8),
        triangles in prop::collection::vec([0..9_u32, 0..9_u32, 0..9_u32], 0..20),
    ) {
        let _ = closed(TriangleMesh { vertices: points, triangles });
    }
}

#[test]
fn non_convex_bodies_are_recognised() {
    assert!(!fat_l().is_convex() && !torus().is_convex() && !hollow_cube().is_convex());
    assert_relative_eq!(fat_l().volume(), 3.0, max_relative = 1e-12);
}

/// Closed and manifold by its edges, but not a solid: the position is reported.
#[test]
fn a_mesh_that_intersects_itself_is_an_error() {
    let ball = TriangleMesh::icosphere(1.0, 3);
    let two = ball.clone().with(&ball.mapped(|p| Point3::new(p.x + 0.7, p.y, p.z)));
    let error = closed(two).unwrap_err();
    let MeshError::SelfIntersection {
        place: [x, y, z],
        count,
        ..
    } = error
    else {
        panic!("{error}")
    };
    // The balls cross on a circle of radius √(1/4 − 0.35²) in the plane x = 0.35.
    assert!(
        count > 10 && (x - 0.35).abs() < 0.1 && (y.hypot(z) - 0.357).abs() < 0.1,
        "{x} {y} {z}"
    );
    assert!(error.to_string().contains("cuts through itself"));
}

/// 20,480 triangles take about a second even unoptimised; 100,000 take some tenths of a second in release.
#[test]
fn the_search_for_crossings_is_fast() {
    let start = std::time::Instant::now();
    assert!(closed(TriangleMesh::icosphere(1.0, 5)).is_ok());
    assert!(start.elapsed().as_secs() < 20);
}

#[test]
fn seams_that_do_not_match_are_welded_on_request() {
    let cube = cube();
    let soup: Vec<Point3<f64>> = cube
        .triangles
        .iter()
        .flatten()
        .enumerate()
        .map(|(i, &v)| cube.vertices[v as usize] + nalgebra::Vector3::repeat(1e-7 * (i % 5) as f64))
        .collect();
    let triangles = (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let soup = TriangleMesh {
        vertices: soup,
        triangles,
    };
    assert!(closed(soup.clone()).is_err());
    let mesh = ClosedMesh::welded_within(soup, 1e-5).unwrap();
    assert_eq!(mesh.vertices().len(), 8);
    assert!(matches!(
        mesh.repairs().last(),
        Some(Repair::WeldedWithinTolerance { .. })
    ));
    assert_relative_eq!(mesh.volume(), 1.0, max_relative = 1e-5);
}

proptest! {
    /// Vertices along an edge, which rounding leaves almost on a line: the mean width is that of the box, exactly.
    #[test]
    fn vertices_along_an_edge_leave_the_mean_width(edges in prop::array::uniform3(0.1..5.0_f64), turn in prop::array::uniform3(-3.0..3.0_f64), shift in prop::array::uniform3(-300.0..300.0_f64), steps in 1_i32..7) {
        let rotation = nalgebra::Rotation3::from_euler_angles(turn[0], turn[1], turn[2]);
        let place = |p: Point3<f64>| rotation * p + nalgebra::Vector3::from(shift);
        let grid: Vec<Point3<f64>> = (0..(steps + 1) * 4)
            .map(|k| [f64::from(k / 4) / f64::from(steps), f64::from(k & 1), f64::from(k >> 1 & 1)])
            .map(|at| place(Point3::new(at[0] * edges[0], at[1] * edges[1], at[2] * edges[2])))
            .collect();
        let exact = 0.5 * edges.iter().sum::<f64>();
        let hull = convex_hull(&grid).unwrap();
        prop_assert!((hull.mean_width() / exact - 1.0).abs() < 1e-9, "{}", hull.mean_width() / exact - 1.0);
        let fine = closed(TriangleMesh::cuboid(edges)).unwrap().subdivided(stereology_shape::Subdivision::Midpoint, 2);
        let fine = closed(fine.mapped(|p| place(*p))).unwrap();
        prop_assert!((fine.mean_width() / exact - 1.0).abs() < 1e-9, "{}", fine.mean_width() / exact - 1.0);
        prop_assert!((fine.signed_mean_width() / exact - 1.0).abs() < 1e-9, "{}", fine.signed_mean_width() / exact - 1.0);
    }
}

/// Coordinates so small that products of them vanish (found by fuzzing): a needle of no thickness beside a box.
#[test]
fn vanishing_coordinates_are_set_to_zero_and_reported() {
    let mut dented = cube().mapped(|p| Point3::new(p.x + 0.5, p.y + 0.5, p.z + 0.5));
    dented.vertices[0].x = 1e-320;
    dented.vertices[1].y = -3e-231;
    let mesh = closed(dented).unwrap();
    assert_eq!(mesh.repairs(), [Repair::FlushedCoordinates { count: 2 }]);
    assert_relative_eq!(mesh.mean_width(), 1.5, max_relative = 1e-12);
    let needle = TriangleMesh::cuboid([1e-231, 1e-300, 4.0]);
    let alone = closed(needle.with(&cube())).unwrap();
    assert_relative_eq!(alone.volume(), 1.0, max_relative = 1e-12);
    assert!(
        alone
            .repairs()
            .iter()
            .any(|repair| matches!(repair, Repair::DroppedDegenerate { .. }))
    );
}
