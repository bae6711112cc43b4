//! Files of meshes with a colour per vertex: GLB for Blender and browsers, PLY for MeshLab.

use crate::file::glb::{Corners, Glb};
use crate::file::mesh_file::{check_indices, write_whole};
use crate::file::mesh_file_error::MeshFileError;
use crate::mesh::coloured_mesh::ColouredMesh;
use std::io::{self, Write};
use std::path::Path;

/// Writes a coloured mesh as `.glb` or `.ply`, depending on the extension, completely or not at all. Colours are
/// clamped to 0..1.
///
/// PLY holds the positions in double precision and the encoded colours as bytes, no normals. GLB (glTF 2.0) holds
/// positions and normals in single precision and colours in linear light with 16 bits, as its standard requires; a
/// vertex is repeated for each of its normals.
///
/// # Errors
///
/// [`MeshFileError::Format`] for other extensions; [`MeshFileError::Write`] if the file cannot be written, an index is
/// out of range, colours or normals are missing, or there are no triangles.
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

#[allow(clippy::cast_possible_truncation, reason = "16 bits a colour")]
fn glb(out: &mut impl Write, coloured: &ColouredMesh) -> io::Result<()> {
    let ColouredMesh { mesh, colours, normals } = coloured;
    let corners = Corners::new(mesh, normals, |_, _| [0.0; 2]);
    let mut glb = Glb::new(coloured.is_opaque());
    glb.add_colours(&corners, |vertex| {
        let [r, g, b, a] = colours[vertex as usize];
        let channels = [linear(r), linear(g), linear(b), a.clamp(0.0, 1.0)];
        channels.map(|value| (value * 65535.0).round() as u16)
    });
    glb.write(out, mesh, &corners)
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
