//! GLB files, read back with the crate `gltf`.

use std::path::Path;

use gltf::buffer::Target;
use gltf::image::Source;
use gltf::material::AlphaMode;
use gltf::texture::{MagFilter, MinFilter, WrappingMode};
use gltf::{Glb, Gltf, Primitive};
use nalgebra::Vector3;
use serde_json::Value;
use stereology_shape::{
    ColouredMesh, MeshFileError, Texture, TexturedMesh, TriangleMesh, corner_normals, write_coloured_mesh,
    write_textured_mesh,
};

/// A box of edges 1, 2 and 3 whose centre, (1000.1, 1000.1, 1000.1), is not a number of single precision.
fn cuboid() -> TriangleMesh {
    let mut mesh = TriangleMesh::cuboid([1.0, 2.0, 3.0]);
    mesh.vertices.iter_mut().for_each(|v| *v += Vector3::repeat(1000.1));
    mesh
}

fn textured(alpha: u8) -> TexturedMesh {
    let mesh = cuboid();
    TexturedMesh {
        uvs: (0..12_u32)
            .map(|i| [[0.0, 0.0], [1.0, 0.0], [f64::from(i) / 12.0, 1.0]])
            .collect(),
        normals: corner_normals(&mesh),
        texture: Texture {
            width: 2,
            height: 1,
            rgba: vec![10, 20, 30, 255, 40, 50, 60, alpha],
        },
        mesh,
    }
}

/// Red grows with x, the alpha of every vertex but the first is `alpha`.
fn coloured(alpha: f32) -> ColouredMesh {
    let mut coloured = ColouredMesh::new(cuboid(), |p| [if p.x > 1000.1 { 0.5 } else { 0.0 }, 1.0, 2.0]);
    coloured.colours.iter_mut().skip(1).for_each(|colour| colour[3] = alpha);
    coloured
}

fn written(write: impl Fn(&Path) -> Result<(), MeshFileError>) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.glb");
    write(&path).unwrap();
    std::fs::read(path).unwrap()
}

fn textured_file(alpha: u8) -> Vec<u8> {
    written(|path| write_textured_mesh(path, &textured(alpha)))
}

fn coloured_file(alpha: f32) -> Vec<u8> {
    written(|path| write_coloured_mesh(path, &coloured(alpha)))
}

/// The only primitive of the file. Its node is the only one of the scene.
fn primitive(file: &Gltf) -> Primitive<'_> {
    let scene = file.default_scene().unwrap();
    let nodes: Vec<_> = scene.nodes().collect();
    assert_eq!((nodes.len(), file.nodes().len(), file.meshes().len()), (1, 1, 1));
    let primitives: Vec<_> = nodes[0].mesh().unwrap().primitives().collect();
    assert_eq!(primitives.len(), 1);
    primitives[0].clone()
}

/// Positions and normals of the corners of the triangles, in order, are those of the mesh; so are the bounds. Returns
/// the index of the vertex in the file at each corner.
fn check_geometry(file: &Gltf, mesh: &TriangleMesh, normals: &[[Vector3<f64>; 3]]) -> Vec<usize> {
    let primitive = primitive(file);
    let reader = primitive.reader(|_| file.blob.as_deref());
    let positions: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
    let read_normals: Vec<[f32; 3]> = reader.read_normals().unwrap().collect();
    let indices: Vec<usize> = reader.read_indices().unwrap().into_u32().map(|i| i as usize).collect();
    assert_eq!(indices.len(), 3 * mesh.triangles.len());
    assert_eq!(read_normals.len(), positions.len());

    for (corner, &index) in indices.iter().enumerate() {
        let (triangle, k) = (corner / 3, corner % 3);
        let vertex = mesh.vertices[mesh.triangles[triangle][k] as usize];
        for axis in 0..3 {
            let position = f64::from(positions[index][axis]) + 1000.1;
            approx::assert_abs_diff_eq!(position, vertex[axis], epsilon = 1e-6);
            let normal = f64::from(read_normals[index][axis]);
            approx::assert_abs_diff_eq!(normal, normals[triangle][k][axis], epsilon = 1e-6);
        }
    }

    let bounds = primitive.bounding_box();
    for axis in 0..3 {
        let along = || positions.iter().map(|position| position[axis]);
        assert_eq!(bounds.min[axis], along().fold(f32::INFINITY, f32::min));
        assert_eq!(bounds.max[axis], along().fold(f32::NEG_INFINITY, f32::max));
    }
    for view in file.views() {
        assert_eq!(view.offset() % 4, 0);
    }
    let target = |accessor: gltf::Accessor<'_>| accessor.view().unwrap().target().unwrap();
    assert_eq!(target(primitive.indices().unwrap()), Target::ElementArrayBuffer);
    for (_, attribute) in primitive.attributes() {
        assert_eq!(target(attribute), Target::ArrayBuffer);
    }
    indices
}

/// The decoded texture: its colour type and pixels.
fn image(file: &Gltf) -> (png::ColorType, Vec<u8>) {
    let image = file.images().next().unwrap();
    let Source::View { view, mime_type } = image.source() else {
        panic!("the image is not in the file");
    };
    assert_eq!(mime_type, "image/png");
    let bytes = &file.blob.as_ref().unwrap()[view.offset()..][..view.length()];
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.width, info.height), (2, 1));
    (info.color_type, pixels)
}

#[test]
fn a_textured_mesh_is_read_back() {
    let mesh = textured(255);
    let file = Gltf::from_slice(&textured_file(255)).unwrap();
    let indices = check_geometry(&file, &mesh.mesh, &mesh.normals);

    let primitive = primitive(&file);
    let reader = primitive.reader(|_| file.blob.as_deref());
    let uvs: Vec<[f32; 2]> = reader.read_tex_coords(0).unwrap().into_f32().collect();
    for (corner, index) in indices.into_iter().enumerate() {
        let expected = mesh.uvs[corner / 3][corner % 3];
        for (read, expected) in uvs[index].into_iter().zip(expected) {
            approx::assert_abs_diff_eq!(f64::from(read), expected, epsilon = 1e-6);
        }
    }
    assert!(reader.read_colors(0).is_none());

    assert_eq!(image(&file), (png::ColorType::Rgb, vec![10, 20, 30, 40, 50, 60]));
    let material = primitive.material();
    assert_eq!(material.alpha_mode(), AlphaMode::Opaque);
    assert!(material.double_sided());
    let surface = material.pbr_metallic_roughness();
    assert_eq!((surface.metallic_factor(), surface.roughness_factor()), (0.0, 0.6));
    let texture = surface.base_color_texture().unwrap().texture();
    assert_eq!(texture.source().index(), 0);
    let sampler = texture.sampler();
    assert_eq!(sampler.mag_filter(), Some(MagFilter::Linear));
    assert_eq!(sampler.min_filter(), Some(MinFilter::LinearMipmapLinear));
    let clamp = WrappingMode::ClampToEdge;
    assert_eq!((sampler.wrap_s(), sampler.wrap_t()), (clamp, clamp));
}

/// Colours are in linear light: sRGB 0.5 is 0.21404.
#[test]
fn a_coloured_mesh_is_read_back() {
    let mesh = coloured(1.0);
    let file = Gltf::from_slice(&coloured_file(1.0)).unwrap();
    let indices = check_geometry(&file, &mesh.mesh, &mesh.normals);

    let primitive = primitive(&file);
    let reader = primitive.reader(|_| file.blob.as_deref());
    let colours: Vec<[u16; 4]> = reader.read_colors(0).unwrap().into_rgba_u16().collect();
    let corners = mesh.mesh.triangles.iter().flatten();
    for (index, &vertex) in indices.into_iter().zip(corners) {
        let red = if mesh.mesh.vertices[vertex as usize].x > 1000.1 {
            14027
        } else {
            0
        };
        assert_eq!(colours[index], [red, 65535, 65535, 65535]);
    }
    assert!(reader.read_tex_coords(0).is_none());
    assert_eq!((file.images().len(), file.textures().len()), (0, 0));
    assert_eq!(primitive.material().alpha_mode(), AlphaMode::Opaque);
}

#[test]
fn holes_are_masked() {
    let file = Gltf::from_slice(&textured_file(0)).unwrap();
    assert_eq!(
        image(&file),
        (png::ColorType::Rgba, vec![10, 20, 30, 255, 40, 50, 60, 0])
    );
    for file in [file, Gltf::from_slice(&coloured_file(0.0)).unwrap()] {
        let primitive = primitive(&file);
        let material = primitive.material();
        assert_eq!(material.alpha_mode(), AlphaMode::Mask);
        assert_eq!(material.alpha_cutoff(), Some(0.5));
    }
}

/// Readers that keep double precision place the mesh where it was.
#[test]
fn the_position_of_the_mesh_is_in_double_precision() {
    for bytes in [textured_file(255), coloured_file(1.0)] {
        let json: Value = serde_json::from_slice(&Glb::from_slice(&bytes).unwrap().json).unwrap();
        for axis in 0..3 {
            let centre = json["nodes"][0]["translation"][axis].as_f64().unwrap();
            approx::assert_abs_diff_eq!(centre, 1000.1, epsilon = 1e-9);
        }
    }
}

/// The header is the magic number, the version, the length of the file, and length and type of the JSON chunk.
#[test]
fn a_damaged_header_is_refused() {
    let good = textured_file(255);
    assert!(Gltf::from_slice(&good).is_ok());
    for at in 0..20 {
        let mut damaged = good.clone();
        damaged[at] = damaged[at].wrapping_add(128);
        // The lower bytes of a length may become smaller; a length of 2^31 more is always too large.
        if (8..16).contains(&at) {
            damaged[at | 3] = 128;
        }
        assert!(Gltf::from_slice(&damaged).is_err(), "byte {at}");
    }
    assert!(Gltf::from_slice(&good[..good.len() - 1]).is_err());
}

#[test]
fn an_incomplete_mesh_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.glb");
    let refused = |mesh: &TexturedMesh| {
        let error = write_textured_mesh(&path, mesh).unwrap_err();
        assert!(matches!(error, MeshFileError::Write { .. }) && !path.exists());
    };
    let good = textured(255);
    let mut mesh = good.clone();
    mesh.uvs.pop();
    refused(&mesh);
    mesh = good.clone();
    mesh.texture.rgba.pop();
    refused(&mesh);
    mesh = good.clone();
    mesh.mesh.triangles[0][0] = 8;
    refused(&mesh);
    let error = write_textured_mesh(path.with_extension("ply"), &good).unwrap_err();
    assert!(matches!(error, MeshFileError::Ending { .. }));
}

/// glTF has no infinities: a mesh with one position, normal or texture coordinate that is not finite is not written.
#[test]
fn what_is_not_finite_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.glb");
    let refused = |mesh: &TexturedMesh| {
        let error = write_textured_mesh(&path, mesh).unwrap_err().to_string();
        assert!(error.contains("not finite") && !path.exists(), "{error}");
    };
    for bad in [f64::NAN, f64::INFINITY, 1e39] {
        let mut mesh = textured(255);
        mesh.mesh.vertices[3].y = bad;
        refused(&mesh);
    }
    let mut mesh = textured(255);
    mesh.normals[5][1] = Vector3::repeat(f64::NAN);
    refused(&mesh);
    let mut mesh = textured(255);
    mesh.uvs[2][0] = [0.5, f64::INFINITY];
    refused(&mesh);
}
