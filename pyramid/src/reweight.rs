//! Correction of the band variances of cuts in all directions at once, by a change of the power of the volume's waves.
//!
//! Every wave appears on the planes of every normal, each time with another tangential frequency κ_n, so a change for
//! the slices along an axis also changes the cuts along the diagonals. The power closest to the present one that gives
//! the planes of thirteen normals (axes, face and space diagonals) all target band variances is:
//!
//! ```text
//! P(k) ← P(k) exp(Σ_n Σ_b λ_nb G_b²(κ_n))        minimal Σ P' ln(P'/P) − P' + P under Σ_k P' G_b²(κ_n) = wanted_b
//! ```
//!
//! λ is found by Newton's method: the gradient is wanted − found, the Hessian Σ_k P G_b²(κ_n) G_c²(κ_m). The Hessian
//! hardly changes with P, so it is summed once for three steps, over one row of waves in four and all of the coarsest
//! (see `wave_change`).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

use crate::cuts::{Cuts, STEPS, thirteen_normals};
use crate::wave_change::Change;

/// Maximum number of Newton steps.
const MOST_STEPS: usize = 9;
/// Number of steps after which the Hessian is recomputed.
const STEPS_OF_HESSIAN: usize = 3;
/// Tolerance of ln(variance / wanted).
const TOLERANCE: f64 = 1e-3;
/// Fraction of the diagonal of the Hessian that is added to it, because bands can be linearly dependent.
const DAMPING: f64 = 1e-5;

/// Response of the band variances of one field to a change of λ: the factored Hessian, scaled to a unit diagonal.
pub(crate) struct Curvature {
    scale: DVector<f64>,
    factored: Cholesky<f64, Dyn>,
}

impl Curvature {
    /// From the lower triangle of the Hessian, by rows.
    fn new(lower: Vec<f64>, unknowns: usize) -> Option<Self> {
        let mut hessian = DMatrix::from_row_slice(unknowns, unknowns, &lower);
        let scale = hessian.diagonal().map(|d| if d > 0.0 { d.sqrt().recip() } else { 0.0 });
        for i in 0..unknowns {
            for j in 0..unknowns {
                hessian[(i, j)] *= scale[i] * scale[j];
            }
            hessian[(i, i)] += DAMPING;
        }
        hessian.fill_upper_triangle_with_lower_triangle();
        Some(Self {
            scale,
            factored: hessian.cholesky()?,
        })
    }

    fn solve(&self, gradient: &DVector<f64>) -> DVector<f64> {
        self.factored
            .solve(&gradient.component_mul(&self.scale))
            .component_mul(&self.scale)
    }
}

impl Cuts {
    /// Gives the cuts along the axes, face diagonals and space diagonals the wanted band variances (high-pass, levels,
    /// low-pass; zero without a target). `known` is reused by the next call with a field of nearly the same spectrum.
    /// `O(N log N)`.
    #[allow(clippy::cast_possible_truncation, reason = "kept in f32")]
    pub(crate) fn reweight(&mut self, field: &mut [f32], wanted: &[f64], known: &mut Option<Curvature>) {
        let normals = thirteen_normals();
        let bands = self.tables.len();
        let unknowns = normals.len() * bands;
        self.transform(field);
        let per_sample = 1.0 / field.len() as f32;
        self.spectrum.par_iter_mut().for_each(|v| *v *= per_sample);
        let responses: Vec<f32> = (0..STEPS + 2)
            .flat_map(|i| self.tables.iter().map(move |table| table[i] as f32))
            .collect();
        let mut change = Change {
            logs: Vec::new(),
            responses: if known.is_none() { &responses } else { &[] },
            bands,
        };
        for step in 0..MOST_STEPS {
            if step > 0 && step.is_multiple_of(STEPS_OF_HESSIAN) {
                *known = None;
                change.responses = &responses;
            }
            let (power, products) = self.power_by_radius(&normals, Some(&change));
            change.logs.clear();
            if known.is_none() {
                *known = Curvature::new(products, unknowns);
                change.responses = &[];
            }
            let Some(curvature) = known.as_ref() else { break };
            let found = self.band_powers(&power, 1.0).concat();
            let ratios: Vec<f64> = found
                .iter()
                .zip(wanted.iter().cycle())
                .map(|(&found, &wanted)| {
                    if found > 0.0 && wanted > 0.0 {
                        wanted / found
                    } else {
                        1.0
                    }
                })
                .collect();
            if ratios.iter().all(|ratio| ratio.ln().abs() < TOLERANCE) {
                break;
            }
            let lambda = curvature.solve(&DVector::from_fn(unknowns, |i, _| {
                (ratios[i].clamp(0.5, 2.0) - 1.0) * found[i]
            }));
            // Half, since amplitudes are multiplied.
            let log = |n: usize, i: usize| {
                let of_bands = self.tables.iter().enumerate();
                of_bands
                    .map(|(b, table)| 0.5 * lambda[n * bands + b] * table[i])
                    .sum::<f64>() as f32
            };
            change.logs = (0..normals.len())
                .map(|n| (0..STEPS + 2).map(|i| log(n, i)).collect())
                .collect();
        }
        if !change.logs.is_empty() {
            self.power_by_radius(&normals, Some(&change));
        }
        self.fft.inverse_into(&mut self.spectrum, field, &mut self.work);
    }
}
