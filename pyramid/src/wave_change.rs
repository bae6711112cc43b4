//! A change of the amplitudes of the volume's waves, and the sums from which the Hessian of the band variances follows.

use stereology_spectrum::{Complex, frequency};

use crate::matching::whole_and_part;

/// The Hessian is summed over one row of waves in so many.
const ROWS_SAMPLED: usize = 4;
/// Below this frequency all rows are summed.
const COARSE: f64 = 0.06;
/// One step changes the logarithm of an amplitude by at most this much.
const MOST: f32 = 1.0;

/// A change of the amplitudes of waves, and the responses for the Hessian.
pub(crate) struct Change<'a> {
    /// Logarithm of the factor of amplitudes over the radius, by normal; none before the first step.
    pub(crate) logs: Vec<Vec<f32>>,
    /// Squared responses, with the bands of each step of the radius contiguous; empty if no Hessian is needed.
    pub(crate) responses: &'a [f32],
    pub(crate) bands: usize,
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
                // The nearest step is sufficient, since the resulting power is measured.
                *sum += table[whole_and_part(position).0 as usize];
            }
        }
        for (bin, sum) in bins.iter_mut().zip(&sums) {
            *bin *= sum.clamp(-MOST, MOST).exp();
        }
    }

    /// Adds P G_b² G_c² of a row of waves for all pairs of bands of all normals, if the row is sampled.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "positions in a table"
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
        if !coarse && !(y + 3 * z).is_multiple_of(ROWS_SAMPLED) {
            return;
        }
        let weight = if coarse { 1.0 } else { ROWS_SAMPLED as f64 };
        // For each normal only adjacent bands respond to a wave.
        let mut responding: Vec<(usize, f64)> = Vec::with_capacity(unknowns);
        for (x, power) in power.iter().enumerate() {
            responding.clear();
            for (n, positions) in positions.iter().enumerate() {
                let responses = &self.responses[positions[x] as usize * self.bands..][..self.bands];
                let of_normal = responses.iter().enumerate().filter(|(_, response)| **response > 0.0);
                responding.extend(of_normal.map(|(b, &response)| (n * self.bands + b, f64::from(response))));
            }
            for (i, &(row, a)) in responding.iter().enumerate() {
                let (a, products) = (weight * power * a, &mut products[row * unknowns..][..unknowns]);
                for &(column, b) in &responding[..=i] {
                    products[column] += a * b;
                }
            }
        }
    }
}
