//! The Minkowski difference of two bodies, by its furthest points.

use nalgebra::{Matrix3, Vector3};
use stereology_shape::UnitBody;

/// A body at a size and in an orientation, about its own centroid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Posed<'a> {
    pub(crate) body: &'a UnitBody,
    pub(crate) size: f64,
    /// From the body's axes to the world's.
    pub(crate) rotation: &'a Matrix3<f64>,
}

/// All `p_A − p_B`, in the axes of the first body.
pub(crate) struct Difference<'a> {
    a: &'a UnitBody,
    b: &'a UnitBody,
    size_a: f64,
    size_b: f64,
    /// From the axes of `b` to those of `a`.
    turn: Matrix3<f64>,
}

/// A point of the difference, and the point of the first body it comes from; the point of the second is `on_a − at`.
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
            a: a.body,
            b: b.body,
            size_a: a.size,
            size_b: b.size,
            turn,
        }
    }

    /// The furthest point in `direction`; of non-convex bodies, that of their hulls.
    pub(crate) fn furthest(&self, direction: &Vector3<f64>) -> Meeting {
        let on_a = self.a.support(direction).coords * self.size_a;
        let in_b = self.b.support(&-self.turn.tr_mul(direction)).coords * self.size_b;
        Meeting {
            at: on_a - self.turn * in_b,
            on_a,
        }
    }
}
