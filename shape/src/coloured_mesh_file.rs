//! Meshes with a colour at each vertex: GLB for Blender and browsers, PLY for MeshLab.

use crate::mesh_file::{check_indices, write_whole};
use crate::{ColouredMesh, MeshFileError, TriangleMesh};
use nalgebra::{Point3, Vector3};
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

/// Writes a coloured mesh as `.glb` or `.ply`, as the ending of the name says, whole or not at all. Colours are clamped to 0..1.
///
/// PLY holds the positions in double precision and the encoded colours as bytes, no normals. GLB (glTF 2.0) holds positions and normals in single precision and colours in linear light, as its standard has them, in 16 bits; a
/// vertex is there once for each normal it has.
///
/// # Errors
///
/// [`MeshFileError::Format`] if the name ends otherwise; [`MeshFileError::Write`] if the file cannot be written, an index is out of range, colours or normals are missing, or there are no triangles.
///
/// # Examples
///
/// ```
/// use stereology_shape::{ColouredMesh, TriangleMesh, write_coloured_mesh};
///
/// let ball = ColouredMesh::new(TriangleMesh::icosphere(1.0, 2), |p| [0.5 + p.z as f32, 0.3, 0.2]);
/// let folder = tempfile::tempdir()?;
/// write_coloured_mesh(folder.path().join("ball.glb"), &ball)?;
/// assert!(std::fs::read(folder.path().join("ball.glb"))?.starts_with(b"glTF"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_coloured_mesh(path: impl AsRef<Path>, mesh: &ColouredMesh) -> Result<(), MeshFileError> {
    let path = path.as_ref();
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    let binary_gltf = match ending.as_deref() {
        Some("glb") => true,
        Some("ply") => false,
        _ => return Err(MeshFileError::Format { path: path.to_owned() }),
    };
    write_whole(path, |out| {
        check(mesh)?;
        if binary_gltf { glb(out, mesh) } else { ply(out, mesh) }
    })
}

fn check(of: &ColouredMesh) -> io::Result<()> {
    check_indices(&of.mesh)?;
    let (vertices, triangles) = (of.mesh.vertices.len(), of.mesh.triangles.len());
    let wrong = |what: String| Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    if of.colours.len() != vertices {
        return wrong(format!("{} colours for {vertices} vertices", of.colours.len()));
    }
    if of.normals.len() != triangles {
        return wrong(format!("normals of {} triangles for {triangles}", of.normals.len()));
    }
    if triangles == 0 {
        return wrong("the mesh has no triangles".to_owned());
    }
    Ok(())
}

#[allow(clippy::cast_possible_truncation, reason = "clamped to bytes")]
fn ply(out: &mut impl Write, of: &ColouredMesh) -> io::Result<()> {
    let ColouredMesh { mesh, colours, .. } = of;
    let channels = if of.is_opaque() { 3 } else { 4 };
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\n{}element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        mesh.vertices.len(),
        if channels == 4 { "property uchar alpha\n" } else { "" },
        mesh.triangles.len()
    )?;
    for (vertex, colour) in mesh.vertices.iter().zip(colours) {
        for x in vertex.iter() {
            out.write_all(&x.to_le_bytes())?;
        }
        out.write_all(&colour.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)[..channels])?;
    }
    for triangle in &mesh.triangles {
        out.write_all(&[3])?;
        for index in triangle {
            out.write_all(&index.to_le_bytes())?;
        }
    }
    Ok(())
}

/// Vertices of a GLB: those of the mesh, once for each normal they have.
struct Corners {
    /// Vertex and normal.
    of: Vec<(u32, [f32; 3])>,
    triangles: Vec<[u32; 3]>,
}

impl Corners {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "normals in single precision; more than 2^32 corners do not fit into memory"
    )]
    fn new(ColouredMesh { mesh, normals, .. }: &ColouredMesh) -> Self {
        let mut of = Vec::new();
        let mut known: Vec<BTreeMap<[u32; 3], u32>> = vec![BTreeMap::new(); mesh.vertices.len()];
        let triangles = mesh
            .triangles
            .iter()
            .zip(normals)
            .map(|(triangle, normals)| {
                std::array::from_fn(|k| {
                    let vertex = triangle[k];
                    let normal: [f32; 3] = normals[k].map(|x| x as f32).into();
                    *known[vertex as usize]
                        .entry(normal.map(f32::to_bits))
                        .or_insert_with(|| {
                            of.push((vertex, normal));
                            (of.len() - 1) as u32
                        })
                })
            })
            .collect();
        Self { of, triangles }
    }
}

#[allow(
    clippy::cast_possible_truncation,
    reason = "GLB is single precision, and 16 bits a colour"
)]
fn glb(out: &mut impl Write, coloured: &ColouredMesh) -> io::Result<()> {
    let ColouredMesh { mesh, colours, .. } = coloured;
    let Corners { of, triangles } = Corners::new(coloured);
    // Single precision loses a mesh far from the origin, so it is written about its centre and moved there by its node.
    let (low, high) = bounds(mesh);
    let centre = nalgebra::center(&low, &high);
    let place = |vertex: &u32| (mesh.vertices[*vertex as usize] - centre).map(|x| x as f32);
    let (low, high) = ((low - centre).map(|x| x as f32), (high - centre).map(|x| x as f32));
    let mut data = Vec::with_capacity(of.len() * 32 + triangles.len() * 12);
    of.iter()
        .for_each(|(vertex, _)| place(vertex).iter().for_each(|x| data.extend(x.to_le_bytes())));
    of.iter()
        .for_each(|(_, normal)| normal.iter().for_each(|x| data.extend(x.to_le_bytes())));
    for (vertex, _) in &of {
        let [r, g, b, a] = colours[*vertex as usize];
        let shares = [linear(r), linear(g), linear(b), a.clamp(0.0, 1.0)];
        shares
            .map(|share| (share * 65535.0).round() as u16)
            .iter()
            .for_each(|c| data.extend(c.to_le_bytes()));
    }
    triangles
        .iter()
        .flatten()
        .for_each(|index| data.extend(index.to_le_bytes()));
    let (n, m) = (of.len(), 3 * triangles.len());
    let view = |from: usize, length: usize, target: u32| {
        format!(r#"{{"buffer":0,"byteOffset":{from},"byteLength":{length},"target":{target}}}"#)
    };
    let views = [
        view(0, 12 * n, VERTICES),
        view(12 * n, 12 * n, VERTICES),
        view(24 * n, 8 * n, VERTICES),
        view(32 * n, 4 * m, INDICES),
    ];
    let accessors = [
        format!(
            r#"{{"bufferView":0,"componentType":{FLOAT},"count":{n},"type":"VEC3","min":[{},{},{}],"max":[{},{},{}]}}"#,
            low.x, low.y, low.z, high.x, high.y, high.z
        ),
        format!(r#"{{"bufferView":1,"componentType":{FLOAT},"count":{n},"type":"VEC3"}}"#),
        format!(r#"{{"bufferView":2,"componentType":{U16},"normalized":true,"count":{n},"type":"VEC4"}}"#),
        format!(r#"{{"bufferView":3,"componentType":{U32},"count":{m},"type":"SCALAR"}}"#),
    ];
    let Point3 { coords: c } = centre;
    let json = format!(
        concat!(
            r#"{{"asset":{{"version":"2.0","generator":"stereology"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0,"translation":[{},{},{}]}}],"#,
            r#""materials":[{{{}"doubleSided":true,"pbrMetallicRoughness":{{"metallicFactor":0,"roughnessFactor":0.6}}}}],"#,
            r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"COLOR_0":2}},"indices":3,"material":0}}]}}],"#,
            r#""accessors":[{}],"bufferViews":[{}],"buffers":[{{"byteLength":{}}}]}}"#
        ),
        c.x,
        c.y,
        c.z,
        // Half between what is seen and a hole is the hole's rim.
        if coloured.is_opaque() {
            ""
        } else {
            r#""alphaMode":"MASK","alphaCutoff":0.5,"#
        },
        accessors.join(","),
        views.join(","),
        data.len()
    );
    let mut json = json.into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = |bytes: usize| {
        u32::try_from(bytes).map_err(|_| io::Error::other("a GLB holds at most 4 GB; take a mesh of fewer triangles"))
    };
    let whole = length(12 + 8 + json.len() + 8 + data.len())?;
    out.write_all(b"glTF\x02\0\0\0")?;
    out.write_all(&whole.to_le_bytes())?;
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &data)] {
        out.write_all(&length(chunk.len())?.to_le_bytes())?;
        out.write_all(kind)?;
        out.write_all(chunk)?;
    }
    Ok(())
}

const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;
const FLOAT: u32 = 5126;
const U16: u32 = 5123;
const U32: u32 = 5125;

fn bounds(mesh: &TriangleMesh) -> (Point3<f64>, Point3<f64>) {
    let each = |from: f64, nearer: fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64>| {
        let coordinates = mesh
            .triangles
            .iter()
            .flatten()
            .map(|&i| mesh.vertices[i as usize].coords);
        Point3::from(coordinates.fold(Vector3::repeat(from), |far, v| nearer(&far, &v)))
    };
    (each(f64::INFINITY, Vector3::inf), each(f64::NEG_INFINITY, Vector3::sup))
}

/// Linear light of an sRGB-encoded value.
fn linear(encoded: f32) -> f32 {
    let c = encoded.clamp(0.0, 1.0);
    if c <= 0.04045 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}
