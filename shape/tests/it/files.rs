//! Mesh files: round trips, and errors with their place for broken files.

use nalgebra::Point3;
use proptest::prelude::*;
use std::path::PathBuf;
use stereology_shape::{
    Body, BodyError, ClosedMesh, MeshFileError, MeshFileFault, MeshFilePlace, Repair, TriangleMesh, read_mesh,
    write_mesh,
};
use tempfile::TempDir;

use crate::random_shapes::polytopes;

fn file(name: &str, content: impl AsRef<[u8]>) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    (folder, path)
}

fn refused(name: &str, content: impl AsRef<[u8]>) -> (MeshFilePlace, MeshFileFault) {
    let (_folder, path) = file(name, content);
    match read_mesh(&path) {
        Err(MeshFileError::Content { place, fault, .. }) => (place, fault),
        other => panic!("{other:?}"),
    }
}

fn written(name: &str, mesh: &TriangleMesh) -> Vec<u8> {
    let (_folder, path) = file(name, "");
    write_mesh(&path, mesh).unwrap();
    std::fs::read(path).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn obj_and_ply_keep_every_bit(mesh in polytopes(), scale in -200..200_i32) {
        let mesh = mesh.as_triangle_mesh().mapped(|p| p * 10.0_f64.powi(scale));
        for name in ["m.obj", "m.ply"] {
            let (_folder, path) = file(name, "");
            write_mesh(&path, &mesh).unwrap();
            prop_assert_eq!(&read_mesh(&path).unwrap(), &mesh);
        }
    }

    /// Arbitrary bytes give a mesh or an error, never a panic.
    #[test]
    fn any_bytes_give_a_mesh_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..300), cut in 0..700_usize, at in 0..700_usize) {
        for name in ["m.obj", "m.stl", "m.ply"] {
            let mut broken = written(name, &TriangleMesh::cuboid([1.0; 3]));
            for (to, from) in broken.iter_mut().skip(at).zip(&bytes[..bytes.len().min(4)]) {
                *to = *from;
            }
            broken.truncate(cut);
            for content in [bytes.clone(), broken] {
                let (_folder, path) = file(name, content);
                let _ = read_mesh(&path).map(ClosedMesh::try_from);
            }
        }
    }
}

#[test]
fn stl_keeps_the_solid_in_single_precision() {
    let ball = TriangleMesh::icosphere(1.0, 2);
    let (_folder, path) = file("ball.stl", written("ball.stl", &ball));
    let mesh = ClosedMesh::try_from(read_mesh(&path).unwrap()).unwrap();
    assert_eq!(mesh.vertices().len(), ball.vertices.len());
    assert!((mesh.volume() - ClosedMesh::try_from(ball).unwrap().volume()).abs() < 1e-6);
}

const TETRAHEDRON_STL: &str = "solid tetrahedron
facet normal 0 0 -1
 outer loop
  vertex 0 0 0
  vertex 0 1 0
  vertex 1 0 0
 endloop
endfacet
facet normal 0 -1 0
 outer loop
  vertex 0 0 0
  vertex 1 0 0
  vertex 0 0 1.0000000001
 endloop
endfacet
facet normal -1 0 0
 outer loop
  vertex 0 0 0
  vertex 0 0 1.0000000001
  vertex 0 1 0
 endloop
endfacet
facet normal 1 1 1
 outer loop
  vertex 1 0 0
  vertex 0 1 0
  vertex 0 0 1.0000000001
 endloop
endfacet
endsolid tetrahedron
";

#[test]
fn text_stl_is_read_in_double_precision_and_truncation_is_an_error() {
    let (_folder, path) = file("t.stl", TETRAHEDRON_STL);
    let mesh = ClosedMesh::try_from(read_mesh(&path).unwrap()).unwrap();
    assert_eq!(mesh.vertices().len(), 4);
    assert!((mesh.volume() * 6.0 - 1.000_000_000_1).abs() < 1e-14);
    let (place, _) = refused("t.stl", &TETRAHEDRON_STL[..TETRAHEDRON_STL.len() / 2]);
    assert_eq!(place, MeshFilePlace::Line(16));
    let (place, fault) = refused("t.stl", TETRAHEDRON_STL.replacen("0 1 0", "0 nan 0", 1));
    assert_eq!(
        (place, fault),
        (
            MeshFilePlace::Line(5),
            MeshFileFault::Coordinate { word: "nan".to_owned() }
        )
    );
}

#[test]
fn the_error_of_a_truncated_binary_stl_states_both_lengths() {
    let mut bytes = written("c.stl", &TriangleMesh::cuboid([1.0; 3]));
    bytes.truncate(bytes.len() - 7);
    let expected = MeshFileFault::Length {
        triangles: 12,
        expected: 684,
        found: 677,
    };
    assert_eq!(refused("c.stl", &bytes), (MeshFilePlace::File, expected));
    let mut nan = written("c.stl", &TriangleMesh::cuboid([1.0; 3]));
    nan[84 + 50 + 12..84 + 50 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_eq!(refused("c.stl", &nan).0, MeshFilePlace::Face(1));
}

#[test]
fn obj_faults_have_their_line() {
    let cube = String::from_utf8(written("c.obj", &TriangleMesh::cuboid([1.0; 3]))).unwrap();
    let (place, fault) = refused("c.obj", format!("{cube}f 1 2 9\n"));
    assert_eq!(
        (place, fault),
        (
            MeshFilePlace::Line(21),
            MeshFileFault::Index {
                word: "9".to_owned(),
                vertices: 8
            }
        )
    );
    let (place, fault) = refused("c.obj", format!("# cube\nv 1 2\n{cube}"));
    assert_eq!(
        (place, fault),
        (
            MeshFilePlace::Line(2),
            MeshFileFault::Coordinate { word: String::new() }
        )
    );
    assert_eq!(
        refused("c.obj", format!("{cube}f 1 2\n")),
        (MeshFilePlace::Line(21), MeshFileFault::Corners { corners: 2 })
    );
    assert_eq!(
        refused("c.obj", "v 1 2 3\n"),
        (MeshFilePlace::File, MeshFileFault::NoFaces)
    );
    assert_eq!(refused("c.obj", ""), (MeshFilePlace::File, MeshFileFault::NoFaces));
}

#[test]
fn seams_quads_and_negative_indices_of_an_obj_do_not_open_it() {
    let text = "o box\nv 0 0 0 0.5 0.5 0.5\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nvt 0 0\nvt 1 0\nvt 0.5 1\n\
                f 4/1 3/2 2/3 1/1\nf 5//1 6//2 7//3 8//1\nf 1/1 2/2 6/3 5/1\nf -7/3 -6/1 -2/1 \\\n -3/2\nf 3 4 8 7\nf 4 1 5 8\n";
    let (_folder, path) = file("box.obj", text);
    let mesh = ClosedMesh::try_from(read_mesh(&path).unwrap()).unwrap();
    assert!(
        mesh.repairs()
            .iter()
            .all(|repair| matches!(repair, Repair::TurnedTriangles { .. })),
        "{:?}",
        mesh.repairs()
    );
    assert!((mesh.volume() - 1.0).abs() < 1e-12);
}

#[test]
fn concave_faces_are_cut_inside_their_outline() {
    // An L-shaped prism of six quads and two concave caps.
    let text = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 1\nv 2 0 1\nv 2 1 1\nv 1 1 1\nv 1 2 1\nv 0 2 1\n\
                f 5 4 3 2 1 6\nf 8 9 10 11 12 7\nf 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nf 4 5 11 10\nf 5 6 12 11\nf 6 1 7 12\n";
    let (_folder, path) = file("l.obj", text);
    let mesh = ClosedMesh::try_from(read_mesh(&path).unwrap()).unwrap();
    assert!(mesh.repairs().is_empty(), "{:?}", mesh.repairs());
    assert!((mesh.volume() - 3.0).abs() < 1e-12);
    assert!(
        (mesh.surface_area() - 14.0).abs() < 1e-12,
        "no triangle outside the caps"
    );
}

#[test]
fn text_and_big_endian_ply_are_read() {
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
             property uchar red\nelement face 4\nproperty list uchar int vertex_index\nend_header\n"
        )
    };
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0_f32]];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3_i32]];
    let mut text = header("ascii");
    let mut binary = header("binary_big_endian").into_bytes();
    for c in corners {
        text += &format!("{} {} {} 7\n", c[0], c[1], c[2]);
        c.iter().for_each(|x| binary.extend(x.to_be_bytes()));
        binary.push(7);
    }
    for f in faces {
        text += &format!("3 {} {} {}\n", f[0], f[1], f[2]);
        binary.push(3);
        f.iter().for_each(|i| binary.extend(i.to_be_bytes()));
    }
    let meshes = [text.as_bytes(), &binary].map(|content| {
        let (_folder, path) = file("t.ply", content);
        read_mesh(&path).unwrap()
    });
    assert_eq!(meshes[0], meshes[1]);
    assert!((ClosedMesh::try_from(meshes[0].clone()).unwrap().volume() * 6.0 - 1.0).abs() < 1e-12);

    assert!(matches!(
        refused("t.ply", &text[..text.len() - 9]),
        (MeshFilePlace::Line(_), MeshFileFault::Ply { .. })
    ));
    assert!(matches!(
        refused("t.ply", &binary[..binary.len() - 1]).1,
        MeshFileFault::Ply { .. }
    ));
    let wrong = text.replacen("3 0 2 1", "3 0 2 4", 1);
    assert_eq!(
        refused("t.ply", wrong),
        (
            MeshFilePlace::Face(0),
            MeshFileFault::Index {
                word: "4".to_owned(),
                vertices: 4
            }
        )
    );
    let nan = text.replacen("1 0 0 7", "nan 0 0 7", 1);
    assert_eq!(refused("t.ply", nan).0, MeshFilePlace::Line(13));
    let huge = text.replacen("element vertex 4", "element vertex 99999999999", 1);
    assert!(matches!(refused("t.ply", huge).1, MeshFileFault::Ply { .. }));
}

#[test]
fn descriptions_are_read_or_refused_with_advice() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ball.ply");
    write_mesh(&path, &TriangleMesh::icosphere(1.0, 1)).unwrap();
    assert!(Body::parse(path.to_str().unwrap()).unwrap().is_convex());
    for wrong in [
        "sphre",
        "sphere:2",
        "box:1,2",
        "box:1,2,x",
        "rock:-1",
        "rock",
        "cylinder:1,2,3",
        "",
    ] {
        assert!(
            matches!(
                Body::parse(wrong),
                Err(BodyError::UnknownShape { .. } | BodyError::Numbers { .. })
            ),
            "{wrong}"
        );
    }
    for wrong in ["box:1,2,-3", "ellipsoid:1,nan,1", "cylinder:0,1", "box:1,inf,1"] {
        assert!(matches!(Body::parse(wrong), Err(BodyError::Length { .. })), "{wrong}");
    }
    assert!(matches!(
        Body::parse("missing.obj"),
        Err(BodyError::File(MeshFileError::Read { .. }))
    ));
    let mut open = TriangleMesh::cuboid([1.0; 3]);
    open.triangles.pop();
    write_mesh(&path, &open).unwrap();
    let message = Body::parse(path.to_str().unwrap()).unwrap_err().to_string();
    assert!(message.contains("ball.ply") && message.contains("open"), "{message}");
}

#[test]
fn nothing_is_left_of_a_mesh_that_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("broken.stl");
    let broken = TriangleMesh {
        vertices: vec![Point3::origin()],
        triangles: vec![[0, 0, 1]],
    };
    assert!(matches!(write_mesh(&path, &broken), Err(MeshFileError::Write { .. })));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    assert!(matches!(
        write_mesh(folder.path().join("mesh.xyz"), &broken),
        Err(MeshFileError::Format { .. })
    ));
}
