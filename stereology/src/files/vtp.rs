//! Particles as VTK poly data, for ParaView: one point per particle, for glyphs, with its size, shape, category and
//! orientation w, x, y, z.

use crate::files::FileError;
use crate::files::particle_table::orientation;
use nalgebra::Point3;
use std::io::{self, Write};
use std::path::Path;
use stereology_grid::write_atomically;
use stereology_shape::Particle;

/// Writes the particles, completely or not at all.
///
/// # Errors
///
/// [`FileError`] if the file cannot be written.
pub fn write(path: impl AsRef<Path>, particles: &[Particle]) -> Result<(), FileError> {
    Ok(write_atomically(path, |out| {
        let n = particles.len();
        writeln!(out, "<?xml version=\"1.0\"?>")?;
        writeln!(
            out,
            "<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\">"
        )?;
        writeln!(out, "<PolyData>")?;
        writeln!(
            out,
            "<Piece NumberOfPoints=\"{n}\" NumberOfVerts=\"{n}\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"0\">"
        )?;
        writeln!(out, "<PointData Scalars=\"size\">")?;
        array(out, "size", "Float64", 1, particles.iter().map(|p| p.size.to_string()))?;
        array(out, "shape", "Int32", 1, particles.iter().map(|p| p.shape.to_string()))?;
        array(
            out,
            "category",
            "UInt8",
            1,
            particles.iter().map(|p| p.category.to_string()),
        )?;
        let orientations = particles.iter().map(|p| p.orientation.quaternion());
        array(
            out,
            "orientation",
            "Float64",
            4,
            orientations.map(|q| format!("{} {} {} {}", q.w, q.i, q.j, q.k)),
        )?;
        writeln!(out, "</PointData>\n<Points>")?;
        let positions = particles.iter().map(|p| p.position);
        array(
            out,
            "points",
            "Float64",
            3,
            positions.map(|p| format!("{} {} {}", p.x, p.y, p.z)),
        )?;
        writeln!(out, "</Points>\n<Verts>")?;
        array(out, "connectivity", "Int32", 1, (0..n).map(|k| k.to_string()))?;
        array(out, "offsets", "Int32", 1, (1..=n).map(|k| k.to_string()))?;
        writeln!(out, "</Verts>\n</Piece>\n</PolyData>\n</VTKFile>")
    })?)
}

fn array(
    out: &mut impl Write,
    name: &str,
    kind: &str,
    components: usize,
    rows: impl Iterator<Item = String>,
) -> io::Result<()> {
    writeln!(
        out,
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">"
    )?;
    for row in rows {
        writeln!(out, "{row}")?;
    }
    writeln!(out, "</DataArray>")
}

/// Reads the particles of a file that [`write()`] wrote.
///
/// # Errors
///
/// [`FileError`]: a missing array, arrays of different lengths, a value that is not a number, an orientation that is
/// not a unit quaternion.
pub fn read(path: impl AsRef<Path>) -> Result<Vec<Particle>, FileError> {
    let path = path.as_ref();
    let text = std::fs::read_to_string(path).map_err(|error| FileError::io(path, error))?;
    parse(&text).map_err(|what| FileError::value(path, what))
}

fn parse(text: &str) -> Result<Vec<Particle>, String> {
    let (points, turns) = (
        values::<f64>(text, "points", 3)?,
        values::<f64>(text, "orientation", 4)?,
    );
    let (sizes, shapes) = (values::<f64>(text, "size", 1)?, values::<usize>(text, "shape", 1)?);
    let categories = values::<u8>(text, "category", 1)?;
    let count = points.len() / 3;
    if [turns.len() / 4, sizes.len(), shapes.len(), categories.len()] != [count; 4] {
        return Err("its arrays have different lengths".to_owned());
    }
    let particle = |k: usize| {
        let (p, q) = (&points[3 * k..], &turns[4 * k..]);
        Ok(Particle {
            shape: shapes[k],
            size: sizes[k],
            category: categories[k],
            position: Point3::new(p[0], p[1], p[2]),
            orientation: orientation([q[0], q[1], q[2], q[3]])
                .ok_or_else(|| format!("the orientation of point {k} is not a unit quaternion"))?,
        })
    };
    (0..count).map(particle).collect()
}

/// The values of an array in text form.
fn values<T: std::str::FromStr>(text: &str, name: &str, components: usize) -> Result<Vec<T>, String> {
    let array = text
        .split_once(&format!("Name=\"{name}\""))
        .and_then(|(_, rest)| rest.split_once('>'))
        .and_then(|(_, rest)| rest.split_once("</DataArray>"));
    let (array, _) = array.ok_or_else(|| format!("it has no array `{name}`"))?;
    let values: Result<Vec<T>, _> = array.split_whitespace().map(str::parse).collect();
    match values {
        Ok(values) if values.len().is_multiple_of(components) => Ok(values),
        _ => Err(format!(
            "its array `{name}` is not made of {components} numbers per point"
        )),
    }
}
