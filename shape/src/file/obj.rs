//! Wavefront OBJ: positions and faces of a text file, each fault with its line.

use std::io::{self, Write};

use nalgebra::Point3;

use crate::file::mesh_file_error::{Fault, MeshFileFault, MeshFilePlace, coordinate};
use crate::file::polygon::triangulate;
use crate::mesh::triangle_mesh::TriangleMesh;

/// A face of the file.
struct Face {
    line: usize,
    /// Where its corners start in the list of all corners.
    first: usize,
}

pub(crate) fn parse(bytes: &[u8]) -> Result<TriangleMesh, Fault> {
    let text = String::from_utf8_lossy(bytes);
    let mut vertices: Vec<Point3<f64>> = Vec::new();
    let mut corners: Vec<&str> = Vec::new();
    // Negative indices count back from the vertices read so far.
    let mut vertices_before: Vec<usize> = Vec::new();
    let mut faces: Vec<Face> = Vec::new();
    let mut continued = false;
    for (number, line) in text.lines().enumerate() {
        let line_number = number + 1;
        let (line, continues) = match line.strip_suffix('\\') {
            Some(start) => (start, true),
            None => (line, false),
        };
        let mut words = line.split_whitespace();
        let keyword = if std::mem::replace(&mut continued, continues) {
            Some("...")
        } else {
            words.next()
        };
        match keyword {
            Some("v") => {
                let mut next = || coordinate(words.next()).map_err(|fault| (MeshFilePlace::Line(line_number), fault));
                vertices.push(Point3::new(next()?, next()?, next()?));
            }
            Some("f") => {
                faces.push(Face {
                    line: line_number,
                    first: corners.len(),
                });
                vertices_before.push(vertices.len());
                corners.extend(words);
            }
            // Only faces are long enough to be continued.
            Some("...") if faces.last().is_some_and(|face| face.line + 1 >= line_number) => corners.extend(words),
            _ => {}
        }
    }
    if faces.is_empty() {
        return Err((MeshFilePlace::File, MeshFileFault::NoFaces));
    }
    let mut triangles = Vec::with_capacity(faces.len());
    let mut indices = Vec::new();
    for (i, face) in faces.iter().enumerate() {
        let at_line = |fault| (MeshFilePlace::Line(face.line), fault);
        let end = faces.get(i + 1).map_or(corners.len(), |next| next.first);
        indices.clear();
        for word in &corners[face.first..end] {
            indices.push(index(word, vertices_before[i], vertices.len()).map_err(at_line)?);
        }
        triangulate(&indices, &vertices, &mut triangles).map_err(at_line)?;
    }
    Ok(TriangleMesh { vertices, triangles })
}

/// The vertex of `v`, `v/vt`, `v//vn` or `v/vt/vn`: counted from 1, or backwards from -1.
fn index(word: &str, before: usize, vertices: usize) -> Result<u32, MeshFileFault> {
    let number: Option<i64> = word.split('/').next().and_then(|v| v.parse().ok());
    let position = number.and_then(|i| match i {
        1.. => usize::try_from(i - 1).ok(),
        0 => None,
        _ => usize::try_from(i.unsigned_abs())
            .ok()
            .and_then(|back| before.checked_sub(back)),
    });
    let in_range = position.filter(|&i| i < vertices).and_then(|i| u32::try_from(i).ok());
    in_range.ok_or_else(|| MeshFileFault::Index {
        word: word.to_owned(),
        vertices,
    })
}

/// Numbers are written with the fewest digits that read back to the same bits.
pub(crate) fn write(out: &mut impl Write, mesh: &TriangleMesh) -> io::Result<()> {
    for v in &mesh.vertices {
        writeln!(out, "v {:?} {:?} {:?}", v.x, v.y, v.z)?;
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(
            out,
            "f {} {} {}",
            u64::from(*a) + 1,
            u64::from(*b) + 1,
            u64::from(*c) + 1
        )?;
    }
    Ok(())
}
