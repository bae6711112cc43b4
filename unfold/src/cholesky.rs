//! Factors of symmetric positive definite matrices, small and dense, without allocation between fits.

/// A symmetric matrix of which the lower triangle is used, row by row; then its factor in the same place.
#[derive(Clone, Debug)]
pub(crate) struct Symmetric {
    size: usize,
    entries: Vec<f64>,
}

impl Symmetric {
    pub(crate) fn zeros(size: usize) -> Self {
        Self {
            size,
            entries: vec![0.0; size * size],
        }
    }

    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Entry (i, j), j ≤ i.
    pub(crate) fn entry(&mut self, i: usize, j: usize) -> &mut f64 {
        &mut self.entries[i * self.size + j]
    }

    /// Replaces the matrix by L with L Lᵀ the matrix; `false` if it is not positive definite.
    pub(crate) fn factorise(&mut self) -> bool {
        let n = self.size;
        for i in 0..n {
            let (above, row) = self.entries.split_at_mut(i * n);
            for j in 0..i {
                let other = &above[j * n..=j * n + j];
                row[j] = (row[j] - dot(&row[..j], &other[..j])) / other[j];
            }
            let left = row[i] - dot(&row[..i], &row[..i]);
            if left.is_nan() || left <= 0.0 {
                return false;
            }
            row[i] = left.sqrt();
        }
        true
    }

    /// ln of the determinant of the factorised matrix.
    pub(crate) fn log_determinant(&self) -> f64 {
        (0..self.size).map(|i| 2.0 * self.entries[i * self.size + i].ln()).sum()
    }

    /// Solves with the factorised matrix, in place.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        let n = self.size;
        for i in 0..n {
            let row = &self.entries[i * n..=i * n + i];
            x[i] = (x[i] - dot(&row[..i], &x[..i])) / row[i];
        }
        for i in (0..n).rev() {
            let row = &self.entries[i * n..=i * n + i];
            x[i] /= row[i];
            let value = x[i];
            for (left, l) in x[..i].iter_mut().zip(row) {
                *left -= l * value;
            }
        }
    }
}

/// Σ a b, in four sums side by side so that a processor can take four terms at once; the same order, so the same bits, always.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (a_fours, b_fours) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest = a_fours.remainder().iter().zip(b_fours.remainder());
    let rest: f64 = rest.map(|(a, b)| a * b).sum();
    for (a, b) in a_fours.zip(b_fours) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::Symmetric;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    proptest! {
        /// AᵀA + 1 is positive definite: its factor solves, and its determinant is nalgebra's.
        #[test]
        fn positive_definite_systems_are_solved(entries in prop::collection::vec(-1.0..1.0_f64, 49), right in prop::collection::vec(-1.0..1.0_f64, 7)) {
            let a = DMatrix::from_vec(7, 7, entries);
            let matrix = a.tr_mul(&a) + DMatrix::identity(7, 7);
            let mut own = Symmetric::zeros(7);
            for i in 0..7 {
                for j in 0..=i {
                    *own.entry(i, j) = matrix[(i, j)];
                }
            }
            prop_assert!(own.factorise());
            let mut x = right.clone();
            own.solve(&mut x);
            let back = &matrix * DVector::from_vec(x);
            prop_assert!((back - DVector::from_vec(right)).amax() < 1e-9);
            prop_assert!((own.log_determinant() - matrix.determinant().ln()).abs() < 1e-9);
        }
    }

    #[test]
    fn an_indefinite_matrix_has_no_factor() {
        let mut matrix = Symmetric::zeros(2);
        *matrix.entry(0, 0) = 1.0;
        *matrix.entry(1, 0) = 2.0;
        *matrix.entry(1, 1) = 1.0;
        assert!(!matrix.factorise());
    }
}
