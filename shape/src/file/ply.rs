//! Polygon files: read by ply-rs-bw, written here.

use std::io::{self, Write};

use nalgebra::Point3;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};

use crate::file::mesh_file_error::{Fault, MeshFileFault, MeshFilePlace};
use crate::file::polygon::triangulate;
use crate::mesh::triangle_mesh::TriangleMesh;

/// A vertex or a face, depending on its properties.
struct Element {
    position: [f64; 3],
    corners: Option<Vec<u32>>,
}

impl PropertyAccess for Element {
    fn new() -> Self {
        Self {
            position: [f64::NAN; 3],
            corners: None,
        }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match name {
            "x" => self.position[0] = number(&property),
            "y" => self.position[1] = number(&property),
            "z" => self.position[2] = number(&property),
            "vertex_indices" | "vertex_index" => match property.to_u32_list() {
                Some(corners) => self.corners = Some(corners),
                None => return PropertyAccessResult::UnsupportedType,
            },
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

fn number(property: &Property) -> f64 {
    match *property {
        Property::Char(x) => f64::from(x),
        Property::UChar(x) => f64::from(x),
        Property::Short(x) => f64::from(x),
        Property::UShort(x) => f64::from(x),
        Property::Int(x) => f64::from(x),
        Property::UInt(x) => f64::from(x),
        Property::Float(x) => f64::from(x),
        Property::Double(x) => x,
        _ => f64::NAN,
    }
}

pub(crate) fn parse(bytes: &[u8]) -> Result<TriangleMesh, Fault> {
    let parser = Parser::<Element>::new();
    let mut reader = Reader::new(bytes);
    let header = parser.read_header(&mut reader).map_err(fault)?;
    let mut vertices = Vec::new();
    let mut faces = Vec::new();
    for (name, definition) in &header.elements {
        let elements = parser
            .read_payload_for_element(&mut reader, definition, &header)
            .map_err(fault)?;
        match name.as_str() {
            "vertex" => vertices = elements.into_iter().map(|e| Point3::from(e.position)).collect(),
            "face" => faces = elements,
            _ => {}
        }
    }
    if let Some(vertex) = vertices
        .iter()
        .position(|v: &Point3<f64>| !v.iter().all(|x| x.is_finite()))
    {
        let [x, y, z]: [f64; 3] = vertices[vertex].coords.into();
        return Err((
            MeshFilePlace::Vertex(vertex),
            MeshFileFault::Coordinate {
                word: format!("{x} {y} {z}"),
            },
        ));
    }
    let mut triangles = Vec::with_capacity(faces.len());
    for (i, face) in faces.iter().enumerate() {
        let at_face = |fault| (MeshFilePlace::Face(i), fault);
        let corners = face.corners.as_deref().unwrap_or_default();
        if let Some(wrong) = corners.iter().find(|&&c| c as usize >= vertices.len()) {
            return Err(at_face(MeshFileFault::Index {
                word: wrong.to_string(),
                vertices: vertices.len(),
            }));
        }
        triangulate(corners, &vertices, &mut triangles).map_err(at_face)?;
    }
    if triangles.is_empty() {
        return Err((MeshFilePlace::File, MeshFileFault::NoFaces));
    }
    Ok(TriangleMesh { vertices, triangles })
}

/// The parser counts lines in binary files too, where they are meaningless; its message then names the element.
fn fault(error: ParseError) -> Fault {
    let whole = error.to_string();
    let message = whole
        .split_once(": ")
        .filter(|(start, _)| start.starts_with("Line "))
        .map_or(whole.as_str(), |(_, rest)| rest);
    let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
    (
        error.line().map_or(MeshFilePlace::File, MeshFilePlace::Line),
        MeshFileFault::Ply { message },
    )
}

pub(crate) fn write(out: &mut impl Write, mesh: &TriangleMesh) -> io::Result<()> {
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        mesh.vertices.len(),
        mesh.triangles.len()
    )?;
    for x in mesh.vertices.iter().flat_map(|v| v.iter()) {
        out.write_all(&x.to_le_bytes())?;
    }
    for corners in &mesh.triangles {
        out.write_all(&[3])?;
        for i in corners {
            out.write_all(&i.to_le_bytes())?;
        }
    }
    Ok(())
}
