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
//! changes with P, so it is summed up once for three steps, over one row of waves in [`ROWS_ASKED`] and all of the coarsest.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;
use stereology_spectrum::{Complex, frequency};

use crate::cuts::{Cuts, STEPS, thirteen_normals};
use crate::matching::whole_and_part;

/// Newton's steps at most.
const MOST_STEPS: usize = 9;
/// Steps after which the Hessian is summed up anew.
const STEPS_OF_HESSIAN: usize = 3;
/// Largest ln(variance / wanted) that is let be.
const NEAR_ENOUGH: f64 = 1e-3;
/// Rows of waves of which one is asked how the bands hang together.
const ROWS_ASKED: usize = 4;
/// Rows below this frequency are all asked.
const COARSE: f64 = 0.06;
/// Part of the Hessian's diagonal added to it, for bands that say the same.
const DAMPING: f64 = 1e-5;
/// No step multiplies an amplitude by more than the exponential of this.
const MOST: f32 = 1.0;

/// A change of waves, and what is asked about them.
pub(crate) struct Change<'a> {
    /// Logarithm of the factor of amplitudes over the radius, by normal; none before the first step.
    logs: Vec<Vec<f32>>,
    /// Squared responses, the bands of a step of the radius side by side; empty if nothing is asked.
    responses: &'a [f32],
    bands: usize,
}

impl Change<'_> {
    /// Multiplies a row of waves.
    pub(crate) fn apply(&self, bins: &mut [Complex<f32>], positions: &[Vec<f32>]) {
        if self.logs.is_empty() {
            return;
        }
        let mut sums = vec![0.0_f32; bins.len()];
        for (table, positions) in self.logs.iter().zip(positions) {
            for (sum, &position) in sums.iter_mut().zip(positions) {
                // Near enough, since what it gives is measured.
                *sum += table[whole_and_part(position).0 as usize];
            }
        }
        for (bin, sum) in bins.iter_mut().zip(&sums) {
            *bin *= sum.clamp(-MOST, MOST).exp();
        }
    }

    /// Adds P G_b² G_c² of a row of waves for all pairs of bands of all normals, if the row is one of those asked.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "places in a table"
    )]
    pub(crate) fn add_products(
        &self,
        size: [usize; 3],
        row: usize,
        positions: &[Vec<f32>],
        power: &[f64],
        products: &mut Vec<f64>,
    ) {
        if self.responses.is_empty() {
            return;
        }
        let unknowns = positions.len() * self.bands;
        products.resize(unknowns * unknowns, 0.0);
        let (y, z) = (row % size[1], row / size[1]);
        let coarse = frequency(z, size[0]).hypot(frequency(y, size[1])) < COARSE;
        if !coarse && !(y + 3 * z).is_multiple_of(ROWS_ASKED) {
            return;
        }
        let weight = if coarse { 1.0 } else { ROWS_ASKED as f64 };
        // Of each normal only neighbouring bands see a wave.
        let mut seen: Vec<(usize, f64)> = Vec::with_capacity(unknowns);
        for (x, power) in power.iter().enumerate() {
            seen.clear();
            for (n, positions) in positions.iter().enumerate() {
                let responses = &self.responses[positions[x] as usize * self.bands..][..self.bands];
                let of_normal = responses.iter().enumerate().filter(|(_, response)| **response > 0.0);
                seen.extend(of_normal.map(|(b, &response)| (n * self.bands + b, f64::from(response))));
            }
            for (i, &(row, a)) in seen.iter().enumerate() {
                let (a, products) = (weight * power * a, &mut products[row * unknowns..][..unknowns]);
                for &(column, b) in &seen[..=i] {
                    products[column] += a * b;
                }
            }
        }
    }
}

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
