//! Where a straight line runs inside a convex body.

use nalgebra::{Vector3, Vector4};

/// Heights above a surface, in sizes of the body, below which rounding may decide whether a point is inside.
const MARGIN: f64 = 1e-9;

/// Parameters between which a line is inside: surely, and at most.
///
/// Points at parameters in `sure` are inside, points not in `possible` outside. What lies between is within rounding of the surface: ask [`contains`](crate::UnitBody::contains) there. Empty where the first is not below the second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chord {
    /// Within these the line is inside.
    pub sure: [f64; 2],
    /// Beyond these the line is outside.
    pub possible: [f64; 2],
}

impl Chord {
    const NONE: Self = Self {
        sure: [f64::INFINITY, f64::NEG_INFINITY],
        possible: [f64::INFINITY, f64::NEG_INFINITY],
    };

    /// Of the line `origin + t direction` with a ball about the origin.
    pub(crate) fn of_ball(radius: f64, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Self {
        let per_square = direction.norm_squared().recip();
        let middle = -origin.dot(direction) * per_square;
        // From the nearest point: the difference of large squares would lose what a far origin holds.
        let nearest = (origin + middle * direction).norm_squared();
        let within = |radius: f64| {
            let half = ((radius * radius - nearest) * per_square).sqrt();
            // Not a number if the line misses the ball.
            if half > 0.0 {
                [middle - half, middle + half]
            } else {
                Self::NONE.possible
            }
        };
        let possible = within(radius + MARGIN);
        if possible == Self::NONE.possible {
            return Self::NONE;
        }
        Self {
            sure: within(radius - MARGIN),
            possible,
        }
    }

    /// What is left of it below the planes of the faces.
    pub(crate) fn below(mut self, faces: &[Vector4<f64>], origin: &Vector3<f64>, direction: &Vector3<f64>) -> Self {
        for face in faces {
            let normal = face.xyz();
            let (height, slope) = (normal.dot(origin) - face.w, normal.dot(direction));
            // A level line has an infinite margin: all of it is possible, none sure, unless it is clearly above or below.
            let (at, margin) = (-height / slope, MARGIN / slope.abs());
            if slope > 0.0 {
                self.sure[1] = self.sure[1].min(at - margin);
                self.possible[1] = self.possible[1].min(at + margin);
            } else if slope < 0.0 {
                self.sure[0] = self.sure[0].max(at + margin);
                self.possible[0] = self.possible[0].max(at - margin);
            } else if height > MARGIN {
                return Self::NONE;
            } else if height > -MARGIN {
                self.sure = Self::NONE.sure;
            }
            if self.possible[0] >= self.possible[1] {
                return Self::NONE;
            }
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use crate::{Body, UnitBody};
    use nalgebra::{Point3, Vector3};
    use proptest::prelude::*;

    fn vector(reach: f64) -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-reach..reach).prop_map(Vector3::from)
    }

    proptest! {
        /// Along any line, and along the axes, the chord and the point test agree; little is left to the point test.
        #[test]
        fn chords_and_points_agree(seed in 0_u64..20, from in vector(1.0), towards in vector(1.0), axis in 0_usize..6) {
            let bodies = [
                Body::sphere(1.0).unwrap(),
                Body::ellipsoid([1.0, 0.6, 0.3]).unwrap(),
                Body::cuboid([1.0, 2.0, 0.5]).unwrap(),
                Body::rock(seed),
            ];
            let direction = if axis < 3 { Vector3::ith(axis, 0.7) } else { towards };
            prop_assume!(direction.norm() > 0.01);
            for body in bodies.map(|body| UnitBody::new(&body)) {
                let Some(chord) = body.chord(&Point3::from(from), &direction) else { continue };
                for i in -200..200 {
                    let t = f64::from(i) * 0.02;
                    let inside = body.contains(&Point3::from(from + t * direction));
                    let between = |ends: [f64; 2]| t > ends[0] && t < ends[1];
                    prop_assert!(!between(chord.sure) || inside);
                    prop_assert!(between(chord.possible) || !inside);
                }
                let length = |ends: [f64; 2]| (ends[1] - ends[0]).max(0.0) * direction.norm();
                prop_assert!(length(chord.sure) <= length(chord.possible));
                prop_assert!(length(chord.possible) <= 2.0 * body.bounding_radius() + 1e-9);
            }
        }
    }

    #[test]
    fn far_origins_and_misses() {
        let ball = UnitBody::new(&Body::sphere(3.0).unwrap());
        let chord = ball.chord(&Point3::new(-1e6, 0.3, 0.0), &Vector3::x()).unwrap();
        assert!((chord.sure[1] - chord.sure[0] - 0.8).abs() < 1e-4);
        let missed = ball.chord(&Point3::new(0.0, 0.6, 0.0), &Vector3::x()).unwrap();
        assert!(missed.possible[0] > missed.possible[1]);
        let cube = UnitBody::new(&Body::cuboid([1.0; 3]).unwrap());
        let above = cube.chord(&Point3::new(0.0, 0.0, 0.9), &Vector3::x()).unwrap();
        assert!(above.possible[0] > above.possible[1]);
    }
}
