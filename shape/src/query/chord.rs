//! Chords of parallel lines in a body: exact for convex bodies with few faces, bounded by two balls for others.

use nalgebra::{Vector3, Vector4};

/// Heights above a surface, in units of the body's size, below which rounding may decide whether a point is inside.
const MARGIN: f64 = 1e-9;

/// Parameters between which a line is certainly inside and possibly inside.
///
/// Points at parameters in `sure` are inside, points not in `possible` are outside. Test the points between with
/// [`contains`](crate::UnitBody::contains). An interval is empty if its first end is not below its second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chord {
    /// The line is inside between these.
    pub sure: [f64; 2],
    /// The line is outside beyond these.
    pub possible: [f64; 2],
}

impl Chord {
    const NONE: Self = Self {
        sure: NOWHERE,
        possible: NOWHERE,
    };
}

const NOWHERE: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// The chords of the lines of a plane: `origin + s across + t along`, one line for every s.
///
/// # Formula
///
/// The point of a line nearest to the centre of a ball is at t = m₀ + m₁ s, at the squared distance d² = n (s − s₀)² +
/// d₀²; the line is in the ball within √((r² − d²) / along²) of it. A face n·p = w is met where t = −(n·p₀ − w) /
/// (n·along), linear in s too.
#[derive(Clone, Debug)]
pub struct Chords {
    /// The plane: m₀ and m₁, s₀, d₀², n, and 1 / along².
    middle: [f64; 2],
    nearest_at: f64,
    nearest: f64,
    spread: f64,
    per_square: f64,
    /// Squared radius of a ball that contains the body.
    outer: f64,
    /// The region that is certainly inside before faces are considered: the ball of this squared radius, or all of the
    /// outer ball.
    inner: Option<f64>,
    /// Faces that bound the body towards higher t and towards lower t.
    ends: Vec<Face>,
    starts: Vec<Face>,
    /// Margin for their rounding.
    margin: f64,
    /// Faces that the lines meet at a small angle, and faces parallel to the lines.
    shallow: Vec<Shallow>,
}

/// Where the lines meet the plane of a face, relative to their points nearest to the centre: t = at + turn s.
#[derive(Clone, Copy, Debug)]
struct Face {
    at: f64,
    turn: f64,
}

/// A face by the height of the lines' points above it: height + climb s + slope t.
#[derive(Clone, Copy, Debug)]
struct Shallow {
    height: f64,
    climb: f64,
    slope: f64,
}

/// Sines of the angles between lines and faces: below the first a face counts as parallel, below the second it gets its
/// own margin.
const LEVEL: f64 = 1e-9;
const SHALLOW: f64 = 1e-3;

impl Chords {
    /// Chords of a body between the balls of radius `inner` and `outer` about the origin.
    pub(crate) fn of_balls(
        [inner, outer]: [f64; 2],
        origin: &Vector3<f64>,
        across: &Vector3<f64>,
        along: &Vector3<f64>,
    ) -> Self {
        let mut chords = Self::of_plane(&Plane::new(origin, across, along), outer);
        // Without an inner ball nothing is certain: a negative square.
        chords.inner = Some((inner - MARGIN).powi(2).copysign(inner - MARGIN));
        chords
    }

    /// Chords of the region below the planes of the faces, all within the ball of radius `outer`.
    pub(crate) fn of_faces(
        outer: f64,
        faces: &[Vector4<f64>],
        origin: &Vector3<f64>,
        across: &Vector3<f64>,
        along: &Vector3<f64>,
    ) -> Self {
        let plane = Plane::new(origin, across, along);
        let mut chords = Self::of_plane(&plane, outer);
        let normal = across.cross(along).normalize();
        // The plane cuts a disc from the ball, centred at this point along its normal.
        let depth = normal.dot(&plane.nearest());
        let disc = (chords.outer - depth * depth).max(0.0);
        let per_length = along.norm().recip();
        chords.ends.reserve(faces.len());
        chords.starts.reserve(faces.len());
        for face in faces {
            let upright = face.xyz().dot(&normal);
            let height = upright * depth - face.w;
            // The disc extends above and below its centre by the square root of this.
            let reach = disc * (1.0 - upright * upright);
            let clear = height.abs() - MARGIN;
            if clear > 0.0 && clear * clear > reach {
                if height > 0.0 {
                    // All of the disc is above the face.
                    chords.outer = f64::NEG_INFINITY;
                    break;
                }
                continue;
            }
            let slope = face.xyz().dot(along);
            let [height, climb] = [face.xyz().dot(&plane.origin) - face.w, face.xyz().dot(&plane.across)];
            if slope.abs() * per_length < SHALLOW {
                chords.shallow.push(Shallow { height, climb, slope });
                continue;
            }
            let per_slope = slope.recip();
            chords.margin = higher(chords.margin, MARGIN * per_slope.abs());
            let side = if slope > 0.0 {
                &mut chords.ends
            } else {
                &mut chords.starts
            };
            side.push(Face {
                at: -height * per_slope,
                turn: -climb * per_slope,
            });
        }
        chords
    }

    fn of_plane(plane: &Plane, outer: f64) -> Self {
        Self {
            middle: plane.middle,
            nearest_at: plane.nearest_at,
            nearest: plane.nearest().norm_squared(),
            spread: plane.across.norm_squared(),
            per_square: plane.per_square,
            outer: (outer + MARGIN).powi(2),
            inner: None,
            ends: Vec::new(),
            starts: Vec::new(),
            margin: 0.0,
            shallow: Vec::new(),
        }
    }

    /// The chord of one line.
    #[must_use]
    pub fn at(&self, s: f64) -> Chord {
        let off = s - self.nearest_at;
        let nearest = self.nearest + self.spread * off * off;
        // NaN if the line misses the ball.
        let half = |square: f64| ((square - nearest) * self.per_square).sqrt();
        let outer = half(self.outer);
        if outer.is_nan() {
            return Chord::NONE;
        }
        let middle = self.middle[0] + self.middle[1] * s;
        if let Some(square) = self.inner {
            let inner = half(square);
            return Chord {
                sure: if inner.is_nan() {
                    NOWHERE
                } else {
                    [middle - inner, middle + inner]
                },
                possible: [middle - outer, middle + outer],
            };
        }
        let end = self
            .ends
            .iter()
            .fold(outer, |end, face| lower(end, face.at + face.turn * s));
        let start = self
            .starts
            .iter()
            .fold(-outer, |start, face| higher(start, face.at + face.turn * s));
        let mut chord = Chord {
            sure: [start + self.margin, end - self.margin],
            possible: [start - self.margin, end + self.margin],
        };
        for face in &self.shallow {
            face.cut(s, outer, self.per_square, &mut chord);
        }
        Chord {
            sure: chord.sure.map(|t| middle + t),
            possible: chord.possible.map(|t| middle + t),
        }
    }
}

impl Shallow {
    /// Shortens a chord by the part that the face cuts off; t is at most `outer`.
    fn cut(&self, s: f64, outer: f64, per_square: f64, chord: &mut Chord) {
        let height = self.height + self.climb * s;
        if self.slope * self.slope * per_square < LEVEL * LEVEL {
            // Along the chord the height changes by less than this.
            let margin = MARGIN + self.slope.abs() * outer;
            if height > margin {
                *chord = Chord::NONE;
            } else if height > -margin {
                chord.sure = NOWHERE;
            }
            return;
        }
        let (at, margin) = (-height / self.slope, MARGIN / self.slope.abs());
        if self.slope > 0.0 {
            chord.sure[1] = lower(chord.sure[1], at - margin);
            chord.possible[1] = lower(chord.possible[1], at + margin);
        } else {
            chord.sure[0] = higher(chord.sure[0], at + margin);
            chord.possible[0] = higher(chord.possible[0], at - margin);
        }
    }
}

/// `min` and `max` in one instruction, for numbers other than NaN.
fn lower(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

fn higher(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// Lines, given by their points nearest to the centre: `origin + s across`.
struct Plane {
    origin: Vector3<f64>,
    across: Vector3<f64>,
    middle: [f64; 2],
    nearest_at: f64,
    per_square: f64,
}

impl Plane {
    fn new(origin: &Vector3<f64>, across: &Vector3<f64>, along: &Vector3<f64>) -> Self {
        let per_square = along.norm_squared().recip();
        let middle = [origin, across].map(|from| -from.dot(along) * per_square);
        let origin = origin + middle[0] * along;
        let across = across + middle[1] * along;
        let spread = across.norm_squared();
        Self {
            nearest_at: if spread > 0.0 {
                -origin.dot(&across) / spread
            } else {
                0.0
            },
            origin,
            across,
            middle,
            per_square,
        }
    }

    /// The point of the plane nearest to the centre. For distant planes it keeps digits that differences of large
    /// squares would lose.
    fn nearest(&self) -> Vector3<f64> {
        self.origin + self.nearest_at * self.across
    }
}

#[cfg(test)]
mod tests {
    use crate::{Body, UnitBody};
    use nalgebra::{Point3, Vector3};
    use proptest::prelude::*;
    use std::sync::LazyLock;

    fn vector(reach: f64) -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-reach..reach).prop_map(Vector3::from)
    }

    /// The last of them by its two balls only.
    static BODIES: LazyLock<Vec<UnitBody>> = LazyLock::new(|| {
        let rocks = (0..8).map(|seed| Ok(Body::rock(seed)));
        let others = [
            Body::sphere(1.0),
            Body::ellipsoid([1.0, 0.6, 0.3]),
            Body::cuboid([1.0, 2.0, 0.5]),
            Body::cylinder(1.0, 2.0),
        ];
        rocks.chain(others).map(|body| UnitBody::new(&body.unwrap())).collect()
    });

    proptest! {
        /// Along the lines of any plane, and of planes along the axes, chords and the point test agree; few points are
        /// left to the point test.
        #[test]
        fn chords_and_points_agree(
            from in vector(1.0),
            directions in prop::array::uniform2(vector(1.0)),
            axis in 0_usize..6,
            lines in prop::collection::vec(-1.0..1.0_f64, 4),
        ) {
            let [along, across] = if axis < 3 {
                [Vector3::ith(axis, 0.7), Vector3::ith((axis + 1) % 3, 0.7)]
            } else {
                directions
            };
            prop_assume!(along.norm() > 0.01);
            for (index, body) in BODIES.iter().enumerate() {
                let chords = body.chords(&Point3::from(from), &across, &along);
                for s in &lines {
                    let chord = chords.at(*s);
                    for i in -100..100 {
                        let t = f64::from(i) * 0.03;
                        let inside = body.contains(&Point3::from(from + *s * across + t * along));
                        let between = |ends: [f64; 2]| t > ends[0] && t < ends[1];
                        prop_assert!(!between(chord.sure) || inside);
                        prop_assert!(between(chord.possible) || !inside);
                    }
                    let length = |ends: [f64; 2]| (ends[1] - ends[0]).max(0.0) * along.norm();
                    let [sure, possible] = [chord.sure, chord.possible].map(length);
                    prop_assert!(sure <= possible);
                    prop_assert!(possible <= 2.0 * body.bounding_radius() + 1e-8);
                    // On a line that touches the surface, a length of √margin is uncertain.
                    prop_assert!(index + 1 == BODIES.len() || possible - sure < 1e-3);
                }
            }
        }
    }

    #[test]
    fn far_origins_and_misses() {
        let chord = |body: &UnitBody, origin: [f64; 3], s: f64| {
            body.chords(&Point3::from(origin), &Vector3::z(), &Vector3::x()).at(s)
        };
        let ball = UnitBody::new(&Body::sphere(3.0).unwrap());
        let far = chord(&ball, [-1e6, 0.3, 1e6], -1e6);
        assert!((far.sure[1] - far.sure[0] - 0.8).abs() < 1e-4);
        assert!((far.sure[0] - (1e6 - 0.4)).abs() < 1e-4);
        let missed = chord(&ball, [0.0, 0.6, 0.0], 0.0);
        assert!(missed.possible[0] > missed.possible[1]);
        let cube = UnitBody::new(&Body::cuboid([1.0; 3]).unwrap());
        let above = chord(&cube, [0.0; 3], 0.9);
        assert!(above.possible[0] > above.possible[1]);
        let through = chord(&cube, [0.0; 3], 0.3);
        assert!(through.sure[0] < through.sure[1]);
    }
}
