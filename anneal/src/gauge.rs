//! The factor to which two convex bodies would have to shrink about their centroids to separate.
//!
//! # Formula
//!
//! ```text
//! γ(A, B) = max over n of  n·d / (h_A(n) + h_B(−n)),     d = c_B − c_A,  h the support function about the centroid
//! ```
//!
//! `γ ≥ 1` exactly if the bodies share no interior point, and every direction `n` with quotient `≥ 1` proves it; for
//! spheres `γ = |d| / (r_A + r_B)`. Unlike the penetration depth of GJK and EPA it has a single maximum however deep
//! the overlap is, is convex in `d`, has the direction found as its gradient, and is smooth where the bodies touch: an
//! energy in `1 − γ` can be minimised by dynamics.
//!
//! The maximum is where the ray along `d` leaves the difference body `A ⊕ (−B)`. It is found by refining a portal: a
//! triangle of points of the difference body that the ray passes through (Snethen 2008, "XenoCollide").

use crate::difference::{Difference, Meeting, Posed};
use nalgebra::Vector3;

/// The result of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gauge {
    /// Unit vector from `a` to `b` in world axes; the quotient there is `value`.
    pub(crate) normal: Vector3<f64>,
    /// Largest quotient found.
    pub(crate) value: f64,
    /// Upper bound of the quotient over all directions; infinite if the search ended before.
    pub(crate) at_most: f64,
    /// `h_A(n) + h_B(−n)` at `normal`.
    pub(crate) width: f64,
    /// Contact point of the shrunken bodies: the point of `a`, relative to its centroid, in world axes.
    pub(crate) on_a: Vector3<f64>,
    /// The same for `b`.
    pub(crate) on_b: Vector3<f64>,
}

/// Stopping rules of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search {
    /// Stop as soon as a direction proves at least this quotient.
    pub(crate) enough: f64,
    /// Stop when the quotient is known to this relative precision.
    pub(crate) precision: f64,
    /// Maximum number of refinements.
    pub(crate) steps: usize,
}

impl Gauge {
    /// The quotient and the width in one direction: the value of a witness.
    pub(crate) fn along(a: &Posed<'_>, b: &Posed<'_>, d: &Vector3<f64>, direction: &Vector3<f64>) -> (f64, f64) {
        let difference = Difference::new(a, b);
        let local = a.rotation.tr_mul(direction);
        let width = difference.furthest(&local).at.dot(&local);
        (direction.dot(d) / width, width)
    }

    /// Searches for the largest quotient.
    pub(crate) fn search(a: &Posed<'_>, b: &Posed<'_>, d: &Vector3<f64>, search: &Search) -> Self {
        let difference = Difference::new(a, b);
        let ray = a.rotation.tr_mul(d);
        let distance = ray.norm();
        if distance <= 1e-12 * (a.size + b.size) {
            // The centres coincide: the quotient is 0 in every direction.
            let local = a.rotation.tr_mul(&Vector3::x());
            let there = difference.furthest(&local);
            let width = there.at.dot(&local);
            return Self {
                normal: Vector3::x(),
                value: 0.0,
                at_most: 0.0,
                width,
                on_a: Vector3::zeros(),
                on_b: Vector3::zeros(),
            };
        }
        let mut best = Best::none();
        let mut portal = [Meeting::CENTRE; 3];
        let first = ray / distance;
        let found = best.discover(&difference, &ray, &first, search, &mut portal) && {
            best.refine(&difference, &ray, search, &mut portal);
            true
        };
        let (on_a, on_b) = if found {
            meeting_points(&portal, &ray)
        } else {
            best.points()
        };
        Self {
            normal: a.rotation * best.normal,
            value: best.value,
            at_most: best.at_most,
            width: best.width,
            on_a: a.rotation * on_a,
            on_b: a.rotation * on_b,
        }
    }
}

/// The best direction so far.
struct Best {
    normal: Vector3<f64>,
    value: f64,
    at_most: f64,
    width: f64,
    there: Meeting,
}

impl Best {
    fn none() -> Self {
        Self {
            normal: Vector3::zeros(),
            value: f64::NEG_INFINITY,
            at_most: f64::INFINITY,
            width: 0.0,
            there: Meeting::CENTRE,
        }
    }

    /// Evaluates the quotient in a unit direction and keeps it if it is the largest so far.
    fn evaluate(&mut self, difference: &Difference<'_>, ray: &Vector3<f64>, normal: &Vector3<f64>) -> Meeting {
        let there = difference.furthest(normal);
        let width = there.at.dot(normal);
        let value = normal.dot(ray) / width;
        if value > self.value && width > 0.0 {
            (self.normal, self.value, self.width, self.there) = (*normal, value, width, there);
        }
        there
    }

    fn points(&self) -> (Vector3<f64>, Vector3<f64>) {
        (self.there.on_a, self.there.on_a - self.there.at)
    }

    /// Finds three points of the difference body whose cone contains the ray. Returns false if the search can end
    /// without them.
    fn discover(
        &mut self,
        difference: &Difference<'_>,
        ray: &Vector3<f64>,
        first: &Vector3<f64>,
        search: &Search,
        portal: &mut [Meeting; 3],
    ) -> bool {
        portal[0] = self.evaluate(difference, ray, first);
        if self.value >= search.enough {
            return false;
        }
        let Some(aside) = portal[0]
            .at
            .cross(ray)
            .try_normalize(1e-10 * ray.norm() * portal[0].at.norm())
        else {
            // The support point lies on the ray: its tangent plane gives the maximum.
            self.at_most = self.value;
            return false;
        };
        portal[1] = self.evaluate(difference, ray, &aside);
        let mut across = portal[0].at.cross(&portal[1].at);
        if across.dot(ray) < 0.0 {
            portal.swap(0, 1);
            across = -across;
        }
        for _ in 0..search.steps {
            let Some(normal) = across.try_normalize(0.0) else {
                return false;
            };
            portal[2] = self.evaluate(difference, ray, &normal);
            if self.value >= search.enough {
                return false;
            }
            if portal[0].at.cross(&portal[2].at).dot(ray) > 0.0 {
                portal[1] = portal[2];
            } else if portal[2].at.cross(&portal[1].at).dot(ray) > 0.0 {
                portal[0] = portal[2];
            } else {
                // The portal is counter-clockwise seen from outside.
                return true;
            }
            across = portal[0].at.cross(&portal[1].at);
        }
        false
    }

    /// Moves the portal outwards to the surface of the difference body.
    fn refine(&mut self, difference: &Difference<'_>, ray: &Vector3<f64>, search: &Search, portal: &mut [Meeting; 3]) {
        for _ in 0..search.steps {
            let [p, q, r] = [&portal[0].at, &portal[1].at, &portal[2].at];
            let Some(normal) = (q - p).cross(&(r - p)).try_normalize(0.0) else {
                return;
            };
            let inner = normal.dot(p);
            let bound = normal.dot(ray) / inner;
            if bound > 0.0 {
                self.at_most = self.at_most.min(bound);
            }
            let next = self.evaluate(difference, ray, &normal);
            let outer = normal.dot(&next.at);
            if self.value >= search.enough || outer - inner <= search.precision * outer {
                return;
            }
            // The new point splits the portal into three; the ray passes through one of them.
            let across = next.at.cross(ray);
            let side = [across.dot(p) > 0.0, across.dot(q) > 0.0, across.dot(r) > 0.0];
            let replaced = match side {
                [false, true, _] => 2,
                [_, false, true] => 0,
                [true, _, false] => 1,
                // The ray passes through the new point, within rounding.
                _ => return,
            };
            portal[replaced] = next;
        }
    }
}

/// The points of both bodies where the ray passes through the portal.
fn meeting_points(portal: &[Meeting; 3], ray: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let [p, q, r] = [&portal[0].at, &portal[1].at, &portal[2].at];
    let weights = [
        q.cross(r).dot(ray).abs(),
        r.cross(p).dot(ray).abs(),
        p.cross(q).dot(ray).abs(),
    ];
    let sum: f64 = weights.iter().sum();
    if sum <= 0.0 {
        return (portal[0].on_a, portal[0].on_a - portal[0].at);
    }
    let mut on_a = Vector3::zeros();
    let mut at = Vector3::zeros();
    for (corner, weight) in portal.iter().zip(weights) {
        on_a += corner.on_a * (weight / sum);
        at += corner.at * (weight / sum);
    }
    (on_a, on_a - at)
}
