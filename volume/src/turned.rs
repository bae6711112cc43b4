//! A rotation that hides the period of a solid.

use nalgebra::{Point3, Quaternion, UnitQuaternion};

/// A point rotated about the origin by a fixed rotation. After it, no flat face of an axis-aligned mesh shows the
/// solid's period: its planes contain no short vector of the box's lattice.
///
/// A solid repeats with its box. A face along the box's axes shows the same particles in rows and columns; a rotated
/// face cuts each particle at a different height every time, as the paper suggests (Jagnow, Dorsey & Rushmeier 2004,
/// section 4.1). Of 60,000 random rotations it is the one whose planes stay farthest from lattice vectors of up to six
/// periods: a fiftieth of a period.
///
/// # Examples
///
/// ```
/// use nalgebra::Point3;
/// use stereology_volume::turned;
/// let p = Point3::new(1.0, 2.0, 3.0);
/// assert!((turned(&p).coords.norm() - p.coords.norm()).abs() < 1e-12);
/// ```
#[must_use]
pub fn turned(p: &Point3<f64>) -> Point3<f64> {
    let turn = Quaternion::new(0.313_332, -0.692_782, -0.598_025, 0.253_461);
    UnitQuaternion::new_normalize(turn) * p
}

#[cfg(test)]
mod tests {
    use super::turned;
    use nalgebra::{Point3, Vector3};

    /// No lattice vector up to six periods long lies within a fiftieth of a period of an upright plane, so none shows
    /// the period.
    #[test]
    fn upright_planes_hold_no_short_lattice_vector() {
        let lattice = (-6..=6_i32).flat_map(|x| (-6..=6_i32).flat_map(move |y| (-6..=6_i32).map(move |z| [x, y, z])));
        for vector in lattice.filter(|v| v.iter().any(|x| *x != 0)) {
            let vector = Vector3::from(vector.map(f64::from));
            for axis in 0..3 {
                let normal = turned(&Point3::from(Vector3::ith(axis, 1.0))).coords;
                assert!(
                    vector.norm() > 6.0 || vector.dot(&normal).abs() > 0.02,
                    "{vector} {axis}"
                );
            }
        }
    }
}
