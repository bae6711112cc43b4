//! Band variances of the cuts of all directions, made right at once by a change of the power of the volume's waves.
//!
//! Every wave shows on the planes of every normal, each time at another tangential frequency κ_n, so what is changed for the slices
//! along an axis changes the cuts along the diagonals too. The power that gives the planes of thirteen normals (axes, face and
//! space diagonals) all the band variances wanted, and is else as near as can be to the one there is:
//!
//! ```text
//! P(k) ← P(k) exp(Σ_n Σ_b λ_nb G_b²(κ_n))        minimal Σ P' ln(P'/P) − P' + P under Σ_k P' G_b²(κ_n) = wanted_b
//! ```
//!
//! λ is found by Newton's method: the gradient is wanted − found, the Hessian Σ_k P G_b²(κ_n) G_c²(κ_m). The Hessian hardly
//! changes with P, so it is summed up once for three steps, over one row of waves in four and all of the coarsest (see `wave_change`).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

use crate::cuts::{Cuts, STEPS, thirteen_normals};
use crate::wave_change::Change;

/// Newton's steps at most.
const MOST_STEPS: usize = 9;
/// Steps after which the Hessian is summed up anew.
const STEPS_OF_HESSIAN: usize = 3;
/// Largest ln(variance / wanted) that is let be.
const NEAR_ENOUGH: f64 = 1e-3;
/// Part of the Hessian's diagonal added to it, for bands that say the same.
const DAMPING: f64 = 1e-5;

/// How the band variances of one field answer to a change of λ: the factored Hessian, scaled to a diagonal of one.
pub(crate) struct Curvature {
    scale: DVector<f64>,
    factored: Cholesky<f64, Dyn>,
}

impl Curvature {
    /// Of the lower triangle of the Hessian, by rows.
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
    /// Gives the cuts along the axes, face diagonals and space diagonals the band variances wanted (high-pass, levels, low-pass;
    /// zero where none is). `known` is kept for the next call with a field of nearly the same spectrum. `O(N log N)`.
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
            if ratios.iter().all(|ratio| ratio.ln().abs() < NEAR_ENOUGH) {
                break;
            }
            let lambda = curvature.solve(&DVector::from_fn(unknowns, |i, _| {
                (ratios[i].clamp(0.5, 2.0) - 1.0) * found[i]
            }));
            // Half of it, since amplitudes are multiplied.
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
