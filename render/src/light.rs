//! The studio lighting: a key light, a sky and a ground that reflects light.

use nalgebra::{UnitVector3, Vector3};

/// Light is computed in double precision and accumulated in single precision.
#[allow(clippy::cast_possible_truncation, reason = "rounding to the nearest f32 is meant")]
pub(crate) fn single(value: f64) -> f32 {
    value as f32
}

/// Light normalised so that an unobstructed face that points up receives 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Studio {
    /// Direction towards the centre of the key light.
    pub(crate) key: UnitVector3<f64>,
    /// Irradiance of the key light on a face that points at it.
    key_strength: f64,
    /// Radiance of the sky at the horizon and at the zenith, and of the ground.
    horizon: f64,
    zenith: f64,
    ground: f64,
    up: UnitVector3<f64>,
}

/// Tangent of the angular radius of the key light's disc: a large softbox.
const KEY_RADIUS: f64 = 0.16;

impl Studio {
    /// With the key light behind the viewer's left shoulder. `forward` is the viewing direction.
    pub(crate) fn new(up: UnitVector3<f64>, forward: &Vector3<f64>) -> Self {
        let right = forward.cross(&up).normalize();
        // Both are horizontal.
        let back = right.cross(&up);
        let toward = |right_part: f64, back_part: f64, up_part: f64| {
            UnitVector3::new_normalize(right * right_part + back * back_part + up.into_inner() * up_part)
        };
        let key = toward(-0.62, 0.34, 0.86);
        let (horizon, zenith) = (0.42, 0.5);
        // Irradiance of the sky on a face that points up: ∫ (h + (z − h) cos θ) cos θ dω / π.
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

    /// Radiance of the sky or the ground from an unobstructed direction.
    pub(crate) fn sky(&self, direction: &Vector3<f64>) -> f64 {
        let height = direction.dot(&self.up);
        if height >= 0.0 {
            self.horizon + (self.zenith - self.horizon) * height
        } else {
            self.ground
        }
    }

    /// Reflectance of the ground, and so its radiance where nothing obstructs its light.
    pub(crate) fn ground(&self) -> f64 {
        self.ground
    }

    /// Whether a direction points at the disc of the key light.
    pub(crate) fn is_in_key(&self, direction: &Vector3<f64>) -> bool {
        direction.dot(&self.key) > (1.0 + KEY_RADIUS * KEY_RADIUS).sqrt().recip()
    }

    /// Radiance of that disc: the integral of L cos θ dω / π over it is the irradiance of the key light.
    pub(crate) fn key_radiance(&self) -> f64 {
        self.key_strength * (1.0 + KEY_RADIUS * KEY_RADIUS) / (KEY_RADIUS * KEY_RADIUS)
    }

    /// Maps a point of the unit square to the direction of a point of the key light.
    pub(crate) fn key_direction(&self, [u, v]: [f64; 2]) -> Vector3<f64> {
        let (radius, angle) = (KEY_RADIUS * u.sqrt(), std::f64::consts::TAU * v);
        let (a, b) = across(&self.key);
        (self.key.into_inner() + radius * angle.cos() * a + radius * angle.sin() * b).normalize()
    }

    /// Light of the key light on a surface, if nothing obstructs it.
    pub(crate) fn key_light(&self, normal: &Vector3<f64>, direction: &Vector3<f64>) -> f64 {
        self.key_strength * normal.dot(direction).max(0.0)
    }
}

/// Maps a point of the unit square to a direction about `normal`, with density proportional to the cosine.
pub(crate) fn about(normal: &Vector3<f64>, [u, v]: [f64; 2]) -> Vector3<f64> {
    let (a, b) = across(&UnitVector3::new_unchecked(*normal));
    let (radius, angle) = (u.sqrt(), std::f64::consts::TAU * v);
    radius * angle.cos() * a + radius * angle.sin() * b + (1.0 - u).max(0.0).sqrt() * normal
}

/// Two unit vectors that complete `n` to a right-handed frame (Duff et al. 2017).
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

    /// A face that points up receives 1: the integral of the sky over many directions, plus the key light.
    #[test]
    fn light_on_a_face_that_points_up_is_one() {
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
            .map(|sample| studio.sky(&about(&up, sample)))
            .sum::<f64>()
            / f64::from(n * n);
        assert!((sky + studio.key_light(&up, &studio.key) - 1.0).abs() < 1e-4);
    }
}
