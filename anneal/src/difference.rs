//! The Minkowski difference of two bodies, through its support points.

use nalgebra::{Matrix3, Vector3};
use stereology_shape::UnitBody;

/// A convex solid around the origin, in its own axes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Solid<'a> {
    /// A body about its centroid, or its convex hull.
    Body(&'a UnitBody),
    /// The convex hull of points, with the origin inside.
    Points(&'a [Vector3<f64>]),
}

impl Solid<'_> {
    /// The support point in `direction`.
    fn support(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Body(body) => body.support(direction).coords,
            Self::Points(points) => {
                let mut best = (f64::NEG_INFINITY, Vector3::zeros());
                for point in *points {
                    let height = point.dot(direction);
                    if height > best.0 {
                        best = (height, *point);
                    }
                }
                best.1
            }
        }
    }
}

/// A solid with a size and an orientation, about its own origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Posed<'a> {
    pub(crate) solid: Solid<'a>,
    pub(crate) size: f64,
    /// From body axes to world axes.
    pub(crate) rotation: &'a Matrix3<f64>,
}

impl Posed<'_> {
    /// Support function of the solid in a unit direction in world axes.
    pub(crate) fn reach(&self, direction: &Vector3<f64>) -> f64 {
        let local = self.rotation.tr_mul(direction);
        self.size * local.dot(&self.solid.support(&local))
    }
}

/// All `p_A − p_B`, in the axes of the first body.
pub(crate) struct Difference<'a> {
    a: Solid<'a>,
    b: Solid<'a>,
    size_a: f64,
    size_b: f64,
    /// From the axes of `b` to those of `a`.
    turn: Matrix3<f64>,
}

/// A point of the difference and the corresponding point of the first body; the point of the second body is `on_a −
/// at`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Meeting {
    pub(crate) at: Vector3<f64>,
    pub(crate) on_a: Vector3<f64>,
}

impl Meeting {
    pub(crate) const CENTRE: Self = Self {
        at: Vector3::new(0.0, 0.0, 0.0),
        on_a: Vector3::new(0.0, 0.0, 0.0),
    };
}

impl<'a> Difference<'a> {
    pub(crate) fn new(a: &Posed<'a>, b: &Posed<'a>) -> Self {
        let turn = a.rotation.tr_mul(b.rotation);
        Self {
            a: a.solid,
            b: b.solid,
            size_a: a.size,
            size_b: b.size,
            turn,
        }
    }

    /// The support point in `direction`.
    pub(crate) fn furthest(&self, direction: &Vector3<f64>) -> Meeting {
        let on_a = self.a.support(direction) * self.size_a;
        let in_b = self.b.support(&-self.turn.tr_mul(direction)) * self.size_b;
        Meeting {
            at: on_a - self.turn * in_b,
            on_a,
        }
    }
}
