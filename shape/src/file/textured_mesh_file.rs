//! GLB files of meshes with a texture.

use crate::file::glb::{Corners, Glb};
use crate::file::mesh_file::{check_indices, write_whole};
use crate::file::mesh_file_error::MeshFileError;
use crate::mesh::textured_mesh::Texture;
use crate::mesh::textured_mesh::TexturedMesh;
use std::io;
use std::path::Path;

/// Writes a textured mesh as `.glb` (glTF 2.0), completely or not at all, with its texture inside as PNG: RGB if it is
/// opaque, otherwise RGBA with a mask at alpha 0.5.
///
/// Positions, normals and texture coordinates are in single precision; a vertex is repeated for each of its normals and
/// texture coordinates.
///
/// # Errors
///
/// [`MeshFileError::Ending`] for other extensions; [`MeshFileError::Write`] if the file cannot be written, an index is
/// out of range, texture coordinates, normals or texels are missing, or there are no triangles.
///
/// # Examples
///
/// ```
/// use stereology_shape::{Texture, TexturedMesh, TriangleMesh, corner_normals, write_textured_mesh};
///
/// let mesh = TriangleMesh::cuboid([1.0, 2.0, 3.0]);
/// let grey = TexturedMesh {
///     uvs: vec![[[0.5, 0.5]; 3]; mesh.triangles.len()],
///     normals: corner_normals(&mesh),
///     texture: Texture { width: 1, height: 1, rgba: vec![128, 128, 128, 255] },
///     mesh,
/// };
/// let folder = tempfile::tempdir()?;
/// write_textured_mesh(folder.path().join("grey.glb"), &grey)?;
/// assert!(std::fs::read(folder.path().join("grey.glb"))?.starts_with(b"glTF"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_textured_mesh(path: impl AsRef<Path>, mesh: &TexturedMesh) -> Result<(), MeshFileError> {
    let path = path.as_ref();
    if !path
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("glb"))
    {
        return Err(MeshFileError::Ending { path: path.to_owned() });
    }
    write_whole(path, |out| {
        check(mesh)?;
        let TexturedMesh {
            mesh,
            uvs,
            normals,
            texture,
        } = mesh;
        let corners = Corners::new(mesh, normals, |triangle, corner| uvs[triangle][corner]);
        let opaque = texture.is_opaque();
        let mut glb = Glb::new(opaque);
        glb.add_texture(&png_of(texture, opaque)?);
        glb.add_uvs(&corners);
        glb.write(out, mesh, &corners)
    })
}

fn check(of: &TexturedMesh) -> io::Result<()> {
    check_indices(&of.mesh)?;
    let triangles = of.mesh.triangles.len();
    let wrong = |what: String| Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    if triangles == 0 {
        return wrong("the mesh has no triangles".to_owned());
    }
    if of.normals.len() != triangles || of.uvs.len() != triangles {
        let (normals, uvs) = (of.normals.len(), of.uvs.len());
        return wrong(format!(
            "normals of {normals} and places of {uvs} triangles for {triangles}"
        ));
    }
    let Texture { width, height, rgba } = &of.texture;
    if rgba.is_empty() || rgba.len() as u64 != 4 * u64::from(*width) * u64::from(*height) {
        return wrong(format!("{} bytes for a texture of {width} x {height}", rgba.len()));
    }
    Ok(())
}

fn png_of(Texture { width, height, rgba }: &Texture, opaque: bool) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, *width, *height);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_color(if opaque {
        png::ColorType::Rgb
    } else {
        png::ColorType::Rgba
    });
    let mut writer = encoder.write_header()?;
    if opaque {
        let rgb: Vec<u8> = rgba
            .chunks_exact(4)
            .flat_map(|texel| [texel[0], texel[1], texel[2]])
            .collect();
        writer.write_image_data(&rgb)?;
    } else {
        writer.write_image_data(rgba)?;
    }
    writer.finish()?;
    Ok(bytes)
}
