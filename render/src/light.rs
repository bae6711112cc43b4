//! The studio: a key light, a sky, a ground that throws light back; encoded colours and linear light.

use nalgebra::{UnitVector3, Vector3};

/// Light of unit strength: a face that looks up and is not hidden gets 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Studio {
    /// Towards the middle of the key light.
    pub(crate) key: UnitVector3<f64>,
    /// Strength of the key light on a face that looks at it.
    key_strength: f64,
    /// Radiance of the sky at the horizon and overhead, of the ground below.
    horizon: f64,
    zenith: f64,
    ground: f64,
    up: UnitVector3<f64>,
}

/// Radius of the key light's disc as seen from the scene, as a tangent: a large softbox.
const KEY_RADIUS: f64 = 0.16;

impl Studio {
    /// With the key light behind the viewer's left shoulder. `forward` is where the camera looks.
    pub(crate) fn new(up: UnitVector3<f64>, forward: &Vector3<f64>) -> Self {
        let right = forward.cross(&up).normalize();
        // Both lie level.
        let back = right.cross(&up);
        let toward = |right_part: f64, back_part: f64, up_part: f64| {
            UnitVector3::new_normalize(right * right_part + back * back_part + up.into_inner() * up_part)
        };
        let key = toward(-0.62, 0.34, 0.86);
        let (horizon, zenith) = (0.42, 0.5);
        // The sky on a face that looks up: ∫ (h + (z − h) cos θ) cos θ dω / π.
        let sky_up = horizon + (zenith - horizon) * 2.0 / 3.0;
        let key_strength = (1.0 - sky_up) / key.dot(&up);
        Self {
            key,
            key_strength,
            horizon,
            zenith,
            ground: 0.36,
            up,
        }
    }

    /// Radiance from a direction that is not hidden.
    pub(crate) fn sky(&self, direction: &Vector3<f64>) -> f64 {
        let height = direction.dot(&self.up);
        if height >= 0.0 {
            self.horizon + (self.zenith - self.horizon) * height
        } else {
            self.ground
        }
    }

    /// Share of light that the ground throws back, and so its radiance where nothing hides it.
    pub(crate) fn ground(&self) -> f64 {
        self.ground
    }

    /// Whether a direction is towards the disc of the key light.
    pub(crate) fn is_in_key(&self, direction: &Vector3<f64>) -> bool {
        direction.dot(&self.key) > (1.0 + KEY_RADIUS * KEY_RADIUS).sqrt().recip()
    }

    /// Radiance of that disc: over it, L cos θ dω / π makes up the key's strength.
    pub(crate) fn key_radiance(&self) -> f64 {
        self.key_strength * (1.0 + KEY_RADIUS * KEY_RADIUS) / (KEY_RADIUS * KEY_RADIUS)
    }

    /// Direction to a point of the key light, of a point of the unit square.
    pub(crate) fn key_direction(&self, [u, v]: [f64; 2]) -> Vector3<f64> {
        let (radius, angle) = (KEY_RADIUS * u.sqrt(), std::f64::consts::TAU * v);
        let (a, b) = across(&self.key);
        (self.key.into_inner() + radius * angle.cos() * a + radius * angle.sin() * b).normalize()
    }

    /// Light of the key on a surface, if nothing is in the way.
    pub(crate) fn key_light(&self, normal: &Vector3<f64>, direction: &Vector3<f64>) -> f64 {
        self.key_strength * normal.dot(direction).max(0.0)
    }
}

/// A direction about `normal` in proportion to its cosine, of a point of the unit square.
pub(crate) fn about(normal: &Vector3<f64>, [u, v]: [f64; 2]) -> Vector3<f64> {
    let (a, b) = across(&UnitVector3::new_unchecked(*normal));
    let (radius, angle) = (u.sqrt(), std::f64::consts::TAU * v);
    radius * angle.cos() * a + radius * angle.sin() * b + (1.0 - u).max(0.0).sqrt() * normal
}

/// Two unit vectors that make a right-handed frame with a third (Duff et al. 2017).
fn across(n: &UnitVector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let sign = 1.0_f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (
        Vector3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        Vector3::new(b, sign + n.y * n.y * a, -n.y),
    )
}

#[cfg(test)]
mod tests {
    use super::{Studio, about};
    use nalgebra::Vector3;

    /// A face that looks up gets 1: the sky over it integrated in many directions, and the key.
    #[test]
    fn light_on_a_face_that_looks_up_is_one() {
        let studio = Studio::new(Vector3::z_axis(), &Vector3::new(-1.0, -1.0, -0.5));
        let n = 200;
        let up = Vector3::z();
        let sky: f64 = (0..n * n)
            .map(|i| {
                [
                    (f64::from(i % n) + 0.5) / f64::from(n),
                    (f64::from(i / n) + 0.5) / f64::from(n),
                ]
            })
            .map(|place| studio.sky(&about(&up, place)))
            .sum::<f64>()
            / f64::from(n * n);
        assert!((sky + studio.key_light(&up, &studio.key) - 1.0).abs() < 1e-4);
    }
}
