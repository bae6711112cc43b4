//! Stereolithography files, text and binary.

use std::io::{self, Write};

use nalgebra::Point3;

use crate::file::mesh_file_error::{Fault, MeshFileFault, MeshFilePlace, coordinate};
use crate::mesh::index::index;
use crate::mesh::measures::double_area;
use crate::mesh::triangle_mesh::TriangleMesh;

const HEADER: usize = 80;
const TRIANGLE: usize = 50;

pub(crate) fn parse(bytes: &[u8]) -> Result<TriangleMesh, Fault> {
    // Binary files may start with the word "solid" too; only they have the length given by their number of triangles.
    let count = bytes
        .get(HEADER..HEADER + 4)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let expected = count.map(|count| (HEADER + 4) as u64 + TRIANGLE as u64 * u64::from(count));
    let found = bytes.len() as u64;
    let mut mesh = match (count, expected) {
        (Some(_), Some(expected)) if expected == found => parse_binary(&bytes[HEADER + 4..])?,
        _ if bytes.trim_ascii_start().starts_with(b"solid") => parse_text(bytes)?,
        (Some(triangles), Some(expected)) => {
            return Err((
                MeshFilePlace::File,
                MeshFileFault::Length {
                    triangles,
                    expected,
                    found,
                },
            ));
        }
        _ => {
            let start = String::from_utf8_lossy(&bytes[..bytes.len().min(16)]).into_owned();
            let fault = MeshFileFault::Expected {
                expected: "an STL file of at least 84 bytes, or the word solid",
                found: start,
            };
            return Err((MeshFilePlace::File, fault));
        }
    };
    if mesh.triangles.is_empty() {
        return Err((MeshFilePlace::File, MeshFileFault::NoFaces));
    }
    mesh.weld();
    Ok(mesh)
}

fn parse_binary(records: &[u8]) -> Result<TriangleMesh, Fault> {
    let mut vertices = Vec::with_capacity(records.len() / TRIANGLE * 3);
    for (face, record) in records.chunks_exact(TRIANGLE).enumerate() {
        // The first three numbers are the normal, which follows from the corners.
        for corner in record[12..48].chunks_exact(12) {
            let number = |k: usize| {
                f64::from(f32::from_le_bytes([
                    corner[4 * k],
                    corner[4 * k + 1],
                    corner[4 * k + 2],
                    corner[4 * k + 3],
                ]))
            };
            let point = Point3::new(number(0), number(1), number(2));
            if let Some(wrong) = point.iter().find(|x| !x.is_finite()) {
                return Err((
                    MeshFilePlace::Face(face),
                    MeshFileFault::Coordinate {
                        word: wrong.to_string(),
                    },
                ));
            }
            vertices.push(point);
        }
    }
    Ok(soup(vertices))
}

fn parse_text(bytes: &[u8]) -> Result<TriangleMesh, Fault> {
    let text = String::from_utf8_lossy(bytes);
    let mut vertices = Vec::new();
    let mut complete = false;
    let mut last_line = 0;
    for (number, line) in text.lines().enumerate() {
        last_line = number + 1;
        let at_line = |fault| (MeshFilePlace::Line(number + 1), fault);
        let mut words = line.split_whitespace();
        let keyword = words.next().map(str::to_ascii_lowercase);
        let whole = vertices.len() % 3 == 0;
        match keyword.as_deref() {
            Some("vertex") => {
                let mut next = || coordinate(words.next()).map_err(at_line);
                vertices.push(Point3::new(next()?, next()?, next()?));
            }
            Some("facet" | "outer" | "endloop" | "endfacet" | "endsolid") if !whole => {
                let expected = "three vertices between outer loop and endloop";
                return Err(at_line(MeshFileFault::Expected {
                    expected,
                    found: line.trim().to_owned(),
                }));
            }
            Some("solid" | "facet" | "outer" | "endloop" | "endfacet") => complete = false,
            Some("endsolid") => complete = true,
            None => {}
            Some(_) => {
                let expected = "solid, facet, outer loop, vertex, endloop, endfacet or endsolid";
                return Err(at_line(MeshFileFault::Expected {
                    expected,
                    found: line.trim().to_owned(),
                }));
            }
        }
    }
    if !complete {
        let fault = MeshFileFault::Expected {
            expected: "endsolid (the file is truncated)",
            found: String::new(),
        };
        return Err((MeshFilePlace::Line(last_line), fault));
    }
    Ok(soup(vertices))
}

/// Every three vertices are a triangle.
fn soup(vertices: Vec<Point3<f64>>) -> TriangleMesh {
    let triangles = (0..index(vertices.len() / 3))
        .map(|t| [0, 1, 2].map(|k| t.saturating_mul(3).saturating_add(k)))
        .collect();
    TriangleMesh { vertices, triangles }
}

#[allow(clippy::cast_possible_truncation, reason = "the format holds single precision")]
pub(crate) fn write(out: &mut impl Write, mesh: &TriangleMesh) -> io::Result<()> {
    let mut header = [b' '; HEADER];
    header[..10].copy_from_slice(b"stereology");
    out.write_all(&header)?;
    out.write_all(&index(mesh.triangles.len()).to_le_bytes())?;
    for corners in &mesh.triangles {
        let corners = corners.map(|i| mesh.vertices[i as usize]);
        let normal = double_area(&corners).try_normalize(0.0).unwrap_or_default();
        let numbers = normal.iter().chain(corners.iter().flat_map(|p| p.iter()));
        for number in numbers {
            out.write_all(&(*number as f32).to_le_bytes())?;
        }
        out.write_all(&[0; 2])?;
    }
    Ok(())
}
