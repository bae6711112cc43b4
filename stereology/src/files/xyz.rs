//! Particles as extended XYZ, for OVITO: the box as lattice, orientations x, y, z, w, and the semi-axes of ellipsoids.
//! The species is `X`, which is not an element: readers made for atoms (ASE) refuse unknown names.

use crate::files::FileError;
use crate::files::particle_table::orientation;
use nalgebra::{Point3, Vector3};
use std::io::Write;
use std::path::Path;
use stereology_grid::write_atomically;
use stereology_shape::{Arrangement, BodyKind, Particle, PeriodicBox};

const PROPERTIES: &str = "species:S:1:pos:R:3:radius:R:1:orientation:R:4:aspherical_shape:R:3:shape:I:1:category:I:1";

/// Writes particles and box, completely or not at all.
///
/// # Errors
///
/// [`FileError`] if the file cannot be written.
pub fn write(path: impl AsRef<Path>, arrangement: &Arrangement) -> Result<(), FileError> {
    let particles = arrangement.particles();
    Ok(write_atomically(path, |out| {
        let sides = arrangement.period().sides();
        writeln!(out, "{}", particles.len())?;
        writeln!(
            out,
            "Lattice=\"{} 0 0 0 {} 0 0 0 {}\" Origin=\"0 0 0\" pbc=\"T T T\" Properties=species:S:1:pos:R:3:radius:R:1:orientation:R:4:aspherical_shape:R:3:shape:I:1:category:I:1",
            sides.x, sides.y, sides.z
        )?;
        particles.iter().try_for_each(|particle| {
            let (p, q) = (particle.position, particle.orientation.quaternion());
            let Particle {
                shape, size, category, ..
            } = particle;
            let body = arrangement.bodies()[*shape].body();
            let axes = match body.kind() {
                BodyKind::Ellipsoid { semi_axes } => semi_axes.map(|axis| axis * size / body.size()),
                _ => [size / 2.0; 3],
            };
            writeln!(
                out,
                "X {} {} {} {} {} {} {} {} {} {} {} {shape} {category}",
                p.x,
                p.y,
                p.z,
                size / 2.0,
                q.i,
                q.j,
                q.k,
                q.w,
                axes[0],
                axes[1],
                axes[2]
            )
        })
    })?)
}

/// Reads particles and box of a file that [`write()`] wrote.
///
/// # Errors
///
/// [`FileError`] with the line: another lattice or other properties, a value that is not a number, an orientation that
/// is not a unit quaternion.
pub fn read(path: impl AsRef<Path>) -> Result<(Vec<Particle>, PeriodicBox), FileError> {
    let path = path.as_ref();
    let text = std::fs::read_to_string(path).map_err(|error| FileError::io(path, error))?;
    parse(&text).map_err(|what| FileError::value(path, what))
}

fn parse(text: &str) -> Result<(Vec<Particle>, PeriodicBox), String> {
    let mut lines = text.lines();
    let count: usize = lines
        .next()
        .and_then(|line| line.trim().parse().ok())
        .ok_or("line 1 is not the number of particles")?;
    let comment = lines.next().unwrap_or_default();
    if !comment.contains(PROPERTIES) {
        return Err(format!("line 2 does not have the properties {PROPERTIES}"));
    }
    let lattice: Vec<f64> = comment
        .split_once("Lattice=\"")
        .and_then(|(_, rest)| rest.split_once('"'))
        .map(|(lattice, _)| {
            lattice
                .split_whitespace()
                .filter_map(|value| value.parse().ok())
                .collect()
        })
        .unwrap_or_default();
    let [x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z] = lattice[..] else {
        return Err("line 2 does not have the lattice of a box".to_owned());
    };
    let period = PeriodicBox::new(Vector3::new(x, y, z)).map_err(|error| format!("line 2: {error}"))?;
    let particles = (3..)
        .zip(lines)
        .map(|(line, text)| particle(text).ok_or_else(|| format!("line {line} is not a particle")))
        .collect::<Result<Vec<_>, String>>()?;
    if particles.len() == count {
        Ok((particles, period))
    } else {
        Err(format!("{} particles, but line 1 says {count}", particles.len()))
    }
}

fn particle(line: &str) -> Option<Particle> {
    let fields: Vec<&str> = line.split_whitespace().collect();
    let number = |k: usize| fields.get(k)?.parse::<f64>().ok().filter(|value| value.is_finite());
    Some(Particle {
        position: Point3::new(number(1)?, number(2)?, number(3)?),
        size: 2.0 * number(4)?,
        orientation: orientation([number(8)?, number(5)?, number(6)?, number(7)?])?,
        shape: fields.get(12)?.parse().ok()?,
        category: fields.get(13)?.parse().ok()?,
    })
}
