//! Contact distributions of eq. (1) with structuring sets other than discs.

use std::f64::consts::{PI, TAU};

use ndarray::ArrayView2;

use crate::conversions::whole_part;
use crate::error::MicrogeometryError;

/// The structuring set B about the origin, which grows until it touches the other region (section 3.2).
#[derive(Clone, Debug, PartialEq)]
pub enum StructuringSet {
    /// The unit disc: radial contact, the distance.
    Disc,
    /// The square of half side 1: the larger of the two coordinate distances.
    Square,
    /// Star-shaped: its radius in equally spaced directions, counter-clockwise from +x, linear between them.
    Star(Vec<f64>),
}

impl StructuringSet {
    /// Star-shaped with these radii.
    ///
    /// # Errors
    ///
    /// [`MicrogeometryError::Parameter`] for fewer than 3 radii or one that is not a positive number.
    pub fn star(radii: Vec<f64>) -> Result<Self, MicrogeometryError> {
        if radii.len() < 3 || !radii.iter().all(|r| r.is_finite() && *r > 0.0) {
            return Err(MicrogeometryError::Parameter(
                "a star-shaped set has at least 3 radii, positive and finite".to_owned(),
            ));
        }
        Ok(Self::Star(radii))
    }

    /// |B|.
    ///
    /// ```
    /// use stereology_microgeometry::StructuringSet;
    /// let diamond = StructuringSet::star(vec![1.0; 4])?;
    /// assert!((diamond.area() - 2.0).abs() < 1e-12);
    /// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
    /// ```
    #[must_use]
    pub fn area(&self) -> f64 {
        match self {
            Self::Disc => PI,
            Self::Square => 4.0,
            Self::Star(radii) => {
                let turn = (TAU / radii.len() as f64).sin();
                let next = radii.iter().cycle().skip(1);
                0.5 * turn * radii.iter().zip(next).map(|(a, b)| a * b).sum::<f64>()
            }
        }
    }

    /// The least r with (x, y) in rB.
    #[must_use]
    pub fn gauge(&self, x: f64, y: f64) -> f64 {
        match self {
            Self::Disc => x.hypot(y),
            Self::Square => x.abs().max(y.abs()),
            Self::Star(radii) => {
                let n = radii.len();
                let step = TAU / n as f64;
                let place = y.atan2(x).rem_euclid(TAU) / step;
                let k = (whole_part(place)).min(n - 1);
                let corner = |i: usize| {
                    let (sin, cos) = (i as f64 * step).sin_cos();
                    (radii[i % n] * cos, radii[i % n] * sin)
                };
                // (x, y) = s a + t b with the corners a, b beside it: it lies on the edge of (s + t) B.
                let ((ax, ay), (bx, by)) = (corner(k), corner(k + 1));
                let turn = ax * by - ay * bx;
                ((x * by - y * bx) + (ax * y - ay * x)) / turn
            }
        }
    }

    /// Eq. (1) for a Poisson process of points, `intensity` per unit of area: the probability that rB contains at least
    /// one, 1 − exp(−λ |rB|).
    ///
    /// ```
    /// use stereology_microgeometry::StructuringSet;
    /// let h = StructuringSet::Square.poisson_contact(0.25, 1.0);
    /// assert!((h - (1.0 - (-1.0_f64).exp())).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn poisson_contact(&self, intensity: f64, r: f64) -> f64 {
        -(-intensity * self.area() * r * r).exp_m1()
    }

    /// The contact distribution of the false pixels of an image: for r = 1 … `radii` pixels, the fraction of them whose
    /// rB contains a true one. Only pixels whose rB stays inside the image for all radii are used (minus-sampling).
    /// Cost: pixels times |B| `radii`².
    ///
    /// # Errors
    ///
    /// [`MicrogeometryError::Parameter`] if no pixel is that far from the border, or all of those are true.
    pub fn contact(&self, picture: ArrayView2<'_, bool>, radii: usize) -> Result<Vec<f64>, MicrogeometryError> {
        let reach = match self {
            Self::Disc | Self::Square => 1.0,
            Self::Star(of) => of.iter().fold(0.0_f64, |most, r| most.max(*r)),
        };
        let margin = whole_part((reach * radii as f64).ceil()).cast_signed();
        let mut steps: Vec<(f64, isize, isize)> = (-margin..=margin)
            .flat_map(|dy| (-margin..=margin).map(move |dx| (dy, dx)))
            .map(|(dy, dx)| (self.gauge(dx as f64, dy as f64), dy, dx))
            .filter(|(r, ..)| *r <= radii as f64 + 1e-9)
            .collect();
        steps.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let (height, width) = picture.dim();
        let (mut hits, mut asked) = (vec![0_u64; radii + 1], 0_u64);
        let inner = |n: usize| margin as usize..n.saturating_sub(margin as usize);
        for y in inner(height) {
            for x in inner(width) {
                if picture[[y, x]] {
                    continue;
                }
                asked += 1;
                let at = |dy: isize, dx: isize| picture[[y.wrapping_add_signed(dy), x.wrapping_add_signed(dx)]];
                if let Some((r, ..)) = steps.iter().find(|&&(_, dy, dx)| at(dy, dx)) {
                    hits[whole_part((r - 1e-9).ceil())] += 1;
                }
            }
        }
        if asked == 0 {
            return Err(MicrogeometryError::Parameter(format!(
                "no pixel outside the set is farther than {margin} pixels from the border: give fewer radii"
            )));
        }
        let mut sum = 0;
        Ok(hits
            .into_iter()
            .map(|count| {
                sum += count;
                sum as f64 / asked as f64
            })
            .skip(1)
            .collect())
    }
}

#[cfg(test)]
mod tests {
    use super::StructuringSet;
    use ndarray::Array2;
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};

    proptest! {
        /// Twice as far is twice the gauge, and a star with many equal radii is a disc.
        #[test]
        fn gauges_scale(x in -9.0..9.0_f64, y in -9.0..9.0_f64, factor in 0.1..9.0_f64, radii in prop::collection::vec(0.2..3.0_f64, 3..12)) {
            let star = StructuringSet::star(radii).unwrap();
            prop_assert!((star.gauge(factor * x, factor * y) - factor * star.gauge(x, y)).abs() < 1e-9 * (1.0 + factor * 100.0));
            let round = StructuringSet::star(vec![1.0; 720]).unwrap();
            prop_assert!((round.gauge(x, y) - x.hypot(y)).abs() < 1e-4 * (1.0 + x.hypot(y)));
        }
    }

    /// A Poisson process: 1 − exp(−λ|rB|) for disc, square and star, within six standard deviations (false alarms:
    /// 1e-6).
    #[test]
    fn points_at_random_follow_equation_1() {
        let (n, share) = (400, 0.004);
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let picture = Array2::from_shape_simple_fn((n, n), || random.random::<f64>() < share);
        let star = StructuringSet::star(vec![1.0, 0.4, 1.0, 0.4, 1.0, 0.4]).unwrap();
        for set in [StructuringSet::Disc, StructuringSet::Square, star] {
            let measured = set.contact(picture.view(), 12).unwrap();
            for (k, h) in measured.iter().enumerate() {
                // On the lattice |rB| is the number of its pixels without the central one.
                let r = k as f64 + 1.0;
                let inside = |dy: i32, dx: i32| set.gauge(f64::from(dx), f64::from(dy)) <= r + 1e-9;
                let pixels = (-13..=13)
                    .flat_map(|dy| (-13..=13).map(move |dx| (dy, dx)))
                    .filter(|&(dy, dx)| inside(dy, dx))
                    .count();
                let expected = 1.0 - (1.0 - share).powf(pixels as f64 - 1.0);
                // Neighbouring pixels share points: about one independent observation per |2rB|.
                let answers = (n * n) as f64 / (4.0 * pixels as f64);
                let spread = (expected * (1.0 - expected) / answers).sqrt();
                assert!(
                    (h - expected).abs() < 6.0 * spread + 1e-3,
                    "{set:?} {r}: {h} {expected}"
                );
            }
        }
    }
}
