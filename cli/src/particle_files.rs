//! Particles for other programs: a CSV table, extended XYZ (OVITO), VTP (ParaView).

use std::io::{self, Write};
use std::path::Path;

use stereology::grid::write_atomically;
use stereology::shape::{BodyKind, Particle, PeriodicBox, UnitBody};

use crate::failure::{Explain, Failure};

/// A format particles are written in, told by the file's ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParticleFormat {
    /// `shape,size,category,x,y,z,qw,qx,qy,qz`
    Csv,
    /// Extended XYZ with the box as lattice; orientation x, y, z, w and semi-axes of ellipsoids as OVITO wants them. The species is `X`, no element: readers made for
    /// atoms (ASE) refuse names that are none.
    Xyz,
    /// VTK poly data with a point a particle, for glyphs; orientation w, x, y, z.
    Vtp,
}

impl ParticleFormat {
    /// The format of the file's ending.
    pub fn of(path: &Path) -> Result<Self, Failure> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("csv") => Ok(Self::Csv),
            Some("xyz") => Ok(Self::Xyz),
            Some("vtp") => Ok(Self::Vtp),
            _ => Err(Failure::usage(format!(
                "--also {}: the file's ending must be .csv, .xyz or .vtp",
                path.display()
            ))),
        }
    }

    /// Writes the particles, whole or not at all.
    pub fn write(
        self,
        path: &Path,
        bodies: &[UnitBody],
        period: &PeriodicBox,
        particles: &[Particle],
    ) -> Result<(), Failure> {
        write_atomically(path, |out| match self {
            Self::Csv => csv(out, particles),
            Self::Xyz => xyz(out, bodies, period, particles),
            Self::Vtp => vtp(out, particles),
        })
        .at(path)
    }
}

fn csv(out: &mut impl Write, particles: &[Particle]) -> io::Result<()> {
    writeln!(out, "shape,size,category,x,y,z,qw,qx,qy,qz")?;
    particles.iter().try_for_each(|particle| {
        let (p, q) = (particle.position, particle.orientation.quaternion());
        let Particle {
            shape, size, category, ..
        } = particle;
        writeln!(
            out,
            "{shape},{size},{category},{},{},{},{},{},{},{}",
            p.x, p.y, p.z, q.w, q.i, q.j, q.k
        )
    })
}

fn xyz(out: &mut impl Write, bodies: &[UnitBody], period: &PeriodicBox, particles: &[Particle]) -> io::Result<()> {
    let sides = period.sides();
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
        let body = bodies[*shape].body();
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
}

fn vtp(out: &mut impl Write, particles: &[Particle]) -> io::Result<()> {
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

#[cfg(test)]
mod tests {
    use super::{csv, vtp, xyz};
    use nalgebra::{Point3, UnitQuaternion, Vector3};
    use stereology::shape::{Body, Particle, PeriodicBox, UnitBody};

    #[test]
    fn a_particle_in_each_format() {
        let particle = Particle {
            shape: 0,
            size: 1.5,
            category: 2,
            position: Point3::new(1.0, 2.0, 3.0),
            orientation: UnitQuaternion::identity(),
        };
        let period = PeriodicBox::new(Vector3::new(4.0, 5.0, 6.0)).unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        let mut out = Vec::new();
        csv(&mut out, &[particle]).unwrap();
        assert_eq!(
            text(out),
            "shape,size,category,x,y,z,qw,qx,qy,qz\n0,1.5,2,1,2,3,1,0,0,0\n"
        );
        let mut out = Vec::new();
        let ball = UnitBody::new(&Body::ellipsoid([1.0, 1.0, 0.5]).unwrap());
        xyz(&mut out, &[ball], &period, &[particle]).unwrap();
        let out = text(out);
        assert!(
            out.starts_with("1\nLattice=\"4 0 0 0 5 0 0 0 6\"")
                && out.ends_with("X 1 2 3 0.75 0 0 0 1 0.75 0.75 0.375 0 2\n"),
            "{out}"
        );
        let mut out = Vec::new();
        vtp(&mut out, &[particle]).unwrap();
        assert_eq!(text(out).matches("<DataArray").count(), 7);
    }
}
