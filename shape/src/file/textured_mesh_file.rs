//! GLB files of meshes with a texture.

use crate::file::glb::{Corners, Glb, alpha_mode};
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
        let mut glb = Glb::default();
        let opaque = texture.is_opaque();
        let surface = format!(
            r#""baseColorTexture":{{"index":{}}},"#,
            glb.texture(&png_of(texture, opaque)?)
        );
        let attributes = glb.uvs(&corners);
        glb.write(out, mesh, &corners, &attributes, [alpha_mode(opaque), &surface])
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

#[cfg(test)]
mod tests {
    use super::write_textured_mesh;
    use crate::{MeshFileError, Texture, TexturedMesh, TriangleMesh, corner_normals};
    use nalgebra::Vector3;
    use serde_json::Value;

    fn cube(alpha: u8) -> TexturedMesh {
        let mut mesh = TriangleMesh::cuboid([1.0, 2.0, 3.0]);
        mesh.vertices.iter_mut().for_each(|v| *v += Vector3::repeat(1000.0));
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

    fn written(mesh: &TexturedMesh) -> (Value, Vec<u8>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.glb");
        write_textured_mesh(&path, mesh).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&bytes[..4], number(4), number(8)), (&b"glTF"[..], 2, bytes.len()));
        let json = number(12);
        assert!(json % 4 == 0 && &bytes[16..20] == b"JSON" && &bytes[24 + json..28 + json] == b"BIN\0");
        let data = bytes[28 + json..].to_vec();
        assert_eq!(number(20 + json), data.len());
        (serde_json::from_slice(&bytes[20..20 + json]).unwrap(), data)
    }

    fn view<'a>(json: &Value, data: &'a [u8], index: &Value) -> &'a [u8] {
        let view = &json["bufferViews"][usize::try_from(index.as_u64().unwrap()).unwrap()];
        let number = |name: &str| usize::try_from(view[name].as_u64().unwrap()).unwrap();
        &data[number("byteOffset")..][..number("byteLength")]
    }

    /// The file holds corners and places of every triangle, in order, and the picture's own bytes.
    #[test]
    fn what_is_written_is_there() {
        let mesh = cube(255);
        let (json, data) = written(&mesh);
        let primitive = &json["meshes"][0]["primitives"][0];
        let values = |accessor: &Value| {
            let accessor = &json["accessors"][usize::try_from(accessor.as_u64().unwrap()).unwrap()];
            view(&json, &data, &accessor["bufferView"]).as_chunks::<4>().0
        };
        let floats = |name: &str| -> Vec<f32> {
            let words = values(&primitive["attributes"][name]);
            words.iter().copied().map(f32::from_le_bytes).collect()
        };
        let (positions, uvs) = (floats("POSITION"), floats("TEXCOORD_0"));
        let indices: Vec<usize> = values(&primitive["indices"])
            .iter()
            .map(|word| u32::from_le_bytes(*word) as usize)
            .collect();
        assert_eq!(indices.len(), 36);
        let centre = json["nodes"][0]["translation"].as_array().unwrap();
        for (corner, index) in indices.into_iter().enumerate() {
            let (triangle, k) = (corner / 3, corner % 3);
            let vertex = mesh.mesh.vertices[mesh.mesh.triangles[triangle][k] as usize];
            for c in 0..3 {
                let at = f64::from(positions[3 * index + c]) + centre[c].as_f64().unwrap();
                assert!((at - vertex[c]).abs() < 1e-6);
            }
            for c in 0..2 {
                assert!((f64::from(uvs[2 * index + c]) - mesh.uvs[triangle][k][c]).abs() < 1e-6);
            }
        }
        let texture = &json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"];
        assert_eq!((texture, &json["textures"][0]["source"]), (&0.into(), &0.into()));
        let picture = view(&json, &data, &json["images"][0]["bufferView"]);
        let mut reader = png::Decoder::new(std::io::Cursor::new(picture)).read_info().unwrap();
        let mut pixels = [0; 6];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height, info.color_type), (2, 1, png::ColorType::Rgb));
        assert_eq!(pixels, [10, 20, 30, 40, 50, 60]);
        assert!(json["materials"][0]["alphaMode"].is_null());
    }

    /// Where something is not seen, it is cut out.
    #[test]
    fn holes_are_masked() {
        let (json, data) = written(&cube(0));
        assert_eq!(json["materials"][0]["alphaMode"], "MASK");
        let picture = view(&json, &data, &json["images"][0]["bufferView"]);
        let reader = png::Decoder::new(std::io::Cursor::new(picture)).read_info().unwrap();
        assert_eq!(reader.info().color_type, png::ColorType::Rgba);
    }

    #[test]
    fn what_is_incomplete_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.glb");
        let refused = |mesh: &TexturedMesh| {
            let error = write_textured_mesh(&path, mesh).unwrap_err();
            assert!(matches!(error, MeshFileError::Write { .. }) && !path.exists());
        };
        let good = cube(255);
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
}
