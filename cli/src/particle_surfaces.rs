//! The surfaces of packed particles for ParaView: a VTP file with the faces of every particle in place.

use std::io::{self, Write};
use std::path::Path;

use nalgebra::{Point3, Vector3};
use stereology::grid::write_atomically;
use stereology::shape::{BodyKind, Particle, TriangleMesh, UnitBody};

use crate::failure::{Explain, Failure};

/// Above this number of particles, spheres and ellipsoids have 80 faces instead of 320.
const MANY: usize = 5000;

/// Refuses a file name with another extension.
pub fn check_ending(path: &Path) -> Result<(), Failure> {
    if path.extension().is_some_and(|ending| ending == "vtp") {
        Ok(())
    } else {
        Err(Failure::usage(format!(
            "--surfaces {}: the file's ending must be .vtp",
            path.display()
        )))
    }
}

/// Writes the faces of all particles. Particles are not cut at the box: each is whole, with its centre in the box.
/// Every face has the number, size, shape and category of its particle.
pub fn write(path: &Path, bodies: &[UnitBody], particles: &[Particle]) -> Result<(), Failure> {
    let outlines: Vec<TriangleMesh> = bodies.iter().map(|body| outline(body, particles.len())).collect();
    let faces: usize = particles.iter().map(|p| outlines[p.shape].triangles.len()).sum();
    if faces > i32::MAX as usize / 3 {
        return Err(Failure::run(format!(
            "--surfaces {}: {faces} faces are too many for the format; pack fewer particles or simpler meshes",
            path.display()
        )));
    }
    write_atomically(path, |out| vtp(out, &outlines, particles)).at(path)
}

fn outline(body: &UnitBody, particles: usize) -> TriangleMesh {
    let fineness = if particles > MANY { 1 } else { 2 };
    match (body.mesh(), body.body().kind()) {
        (Some(mesh), _) => mesh.as_triangle_mesh().clone(),
        (None, BodyKind::Ellipsoid { semi_axes }) => {
            let axes = Vector3::from(semi_axes) / body.body().size();
            TriangleMesh::icosphere(2.0, fineness).mapped(|p| Point3::from(p.coords.component_mul(&axes)))
        }
        (None, _) => TriangleMesh::icosphere(1.0, fineness),
    }
}

/// One array of the file: its description and the bytes that follow it at the end.
struct Array<'a> {
    section: &'static str,
    name: &'static str,
    kind: &'static str,
    components: usize,
    bytes: u64,
    fill: &'a dyn Fn(&mut dyn Write) -> io::Result<()>,
}

fn vtp(out: &mut impl Write, outlines: &[TriangleMesh], particles: &[Particle]) -> io::Result<()> {
    let points: usize = particles.iter().map(|p| outlines[p.shape].vertices.len()).sum();
    let faces: usize = particles.iter().map(|p| outlines[p.shape].triangles.len()).sum();
    let positions = |out: &mut dyn Write| {
        let vertices = particles
            .iter()
            .flat_map(|p| outlines[p.shape].vertices.iter().map(|v| p.to_world(v)));
        each(
            out,
            vertices.flat_map(|v| [v.x, v.y, v.z]).map(|x| (x as f32).to_le_bytes()),
        )
    };
    let corners = |out: &mut dyn Write| {
        let mut first = 0_u32;
        for particle in particles {
            let outline = &outlines[particle.shape];
            let corners = outline.triangles.iter().flatten();
            each(out, corners.map(|corner| (first + corner).to_le_bytes()))?;
            first += outline.vertices.len() as u32;
        }
        Ok(())
    };
    let ends = |out: &mut dyn Write| each(out, (1..=faces as u32).map(|face| (3 * face).to_le_bytes()));
    let of_faces = |bytes: &dyn Fn(usize, &Particle) -> Vec<u8>, out: &mut dyn Write| {
        for (number, particle) in particles.iter().enumerate() {
            let bytes = bytes(number, particle);
            for _ in 0..outlines[particle.shape].triangles.len() {
                out.write_all(&bytes)?;
            }
        }
        Ok(())
    };
    let numbers = |out: &mut dyn Write| of_faces(&|number, _| (number as u32).to_le_bytes().to_vec(), out);
    let sizes = |out: &mut dyn Write| of_faces(&|_, p| (p.size as f32).to_le_bytes().to_vec(), out);
    let shapes = |out: &mut dyn Write| of_faces(&|_, p| (p.shape as u32).to_le_bytes().to_vec(), out);
    let categories = |out: &mut dyn Write| of_faces(&|_, p| vec![p.category], out);
    let array = |section, name, kind, components, bytes, fill| Array {
        section,
        name,
        kind,
        components,
        bytes,
        fill,
    };
    let (points_too, faces_too) = (points as u64, faces as u64);
    let arrays = [
        array("CellData", "particle", "UInt32", 1, 4 * faces_too, &numbers),
        array("CellData", "size", "Float32", 1, 4 * faces_too, &sizes),
        array("CellData", "shape", "UInt32", 1, 4 * faces_too, &shapes),
        array("CellData", "category", "UInt8", 1, faces_too, &categories),
        array("Points", "points", "Float32", 3, 12 * points_too, &positions),
        array("Polys", "connectivity", "Int32", 1, 12 * faces_too, &corners),
        array("Polys", "offsets", "Int32", 1, 4 * faces_too, &ends),
    ];
    writeln!(out, "<?xml version=\"1.0\"?>")?;
    writeln!(
        out,
        "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>"
    )?;
    writeln!(
        out,
        "<Piece NumberOfPoints=\"{points}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"{faces}\">"
    )?;
    let mut offset = 0;
    for section in ["CellData", "Points", "Polys"] {
        writeln!(out, "<{section}>")?;
        for array in arrays.iter().filter(|array| array.section == section) {
            writeln!(
                out,
                "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{offset}\"/>",
                array.kind, array.name, array.components
            )?;
            offset += 8 + array.bytes;
        }
        writeln!(out, "</{section}>")?;
    }
    write!(out, "</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_")?;
    for array in &arrays {
        out.write_all(&array.bytes.to_le_bytes())?;
        (array.fill)(out)?;
    }
    writeln!(out, "\n</AppendedData>\n</VTKFile>")
}

fn each<const N: usize>(out: &mut dyn Write, rows: impl Iterator<Item = [u8; N]>) -> io::Result<()> {
    let mut rows = rows;
    rows.try_for_each(|row| out.write_all(&row))
}

#[cfg(test)]
mod tests {
    use super::{outline, vtp};
    use nalgebra::{Point3, UnitQuaternion};
    use stereology::shape::{Body, Particle, UnitBody};

    /// The file has the layout that its header declares: header, then 8 bytes of length and the data of each array.
    #[test]
    fn arrays_are_where_the_header_says() {
        let bodies = [Body::cuboid([1.0; 3]).unwrap(), Body::sphere(1.0).unwrap()].map(|body| UnitBody::new(&body));
        let at = |shape: usize, x: f64| Particle {
            shape,
            size: 1.0,
            category: 7,
            position: Point3::new(x, 0.0, 0.0),
            orientation: UnitQuaternion::identity(),
        };
        let particles = [at(0, 0.0), at(1, 2.0), at(0, 4.0)];
        let outlines: Vec<_> = bodies.iter().map(|body| outline(body, 3)).collect();
        let mut out = Vec::new();
        vtp(&mut out, &outlines, &particles).unwrap();
        let mark = b"<AppendedData encoding=\"raw\">\n_";
        let start = out.windows(mark.len()).position(|w| w == mark).unwrap() + mark.len();
        let (faces, points) = (12 + 320 + 12, 8 + 162 + 8);
        let mut at = start;
        for bytes in [
            4 * faces,
            4 * faces,
            4 * faces,
            faces,
            12 * points,
            12 * faces,
            4 * faces,
        ] {
            assert_eq!(out[at..at + 8], (bytes as u64).to_le_bytes());
            let text = format!("offset=\"{}\"", at - start);
            assert!(String::from_utf8_lossy(&out[..start]).contains(&text), "{text}");
            at += 8 + bytes;
        }
        assert_eq!(&out[at..], b"\n</AppendedData>\n</VTKFile>\n");
        // The category of the last face.
        assert_eq!(out[start + 3 * (8 + 4 * faces) + 8 + faces - 1], 7);
    }
}
