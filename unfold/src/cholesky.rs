//! Factors of symmetric positive definite matrices, small and dense, without allocation between fits.

/// Rows of a factor that are finished together.
const PANEL: usize = 4;

/// A symmetric matrix of which one triangle is used; then its factor U, with UᵀU the matrix, in the same place, row by
/// row.
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
        &mut self.entries[j * self.size + i]
    }

    /// Replaces the matrix by U with Uᵀ U the matrix; `false` if it is not positive definite.
    ///
    /// Four rows are finished at a time and taken off those below together: rows are short, so what counts is how often
    /// each is read.
    pub(crate) fn factorise(&mut self) -> bool {
        let n = self.size;
        let mut first = 0;
        while first < n {
            let height = (n - first).min(PANEL);
            for k in first..first + height {
                let (above, rest) = self.entries.split_at_mut(k * n);
                let row = &mut rest[k..n];
                for done in above[first * n..].chunks_exact(n) {
                    let factor = done[k];
                    row.iter_mut().zip(&done[k..]).for_each(|(x, u)| *x -= factor * u);
                }
                let pivot = row[0];
                if pivot.is_nan() || pivot <= 0.0 {
                    return false;
                }
                let root = pivot.sqrt();
                let scale = 1.0 / root;
                row[0] = root;
                row[1..].iter_mut().for_each(|u| *u *= scale);
            }
            let (done, below) = self.entries.split_at_mut((first + height) * n);
            // Fewer than four rows are left only at the end, where nothing is below them.
            if let [a, b, c, d] = done[first * n..].chunks_exact(n).collect::<Vec<_>>()[..] {
                for (i, row) in (first + height..).zip(below.chunks_exact_mut(n)) {
                    let (fa, fb, fc, fd) = (a[i], b[i], c[i], d[i]);
                    let four = a[i..].iter().zip(&b[i..]).zip(c[i..].iter().zip(&d[i..]));
                    for (x, ((a, b), (c, d))) in row[i..].iter_mut().zip(four) {
                        *x -= (fa * a + fb * b) + (fc * c + fd * d);
                    }
                }
            }
            first += height;
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
            let row = &self.entries[i * n + i..(i + 1) * n];
            x[i] /= row[0];
            let value = x[i];
            for (right, u) in x[i + 1..].iter_mut().zip(&row[1..]) {
                *right -= u * value;
            }
        }
        for i in (0..n).rev() {
            let row = &self.entries[i * n + i..(i + 1) * n];
            x[i] = (x[i] - dot(&row[1..], &x[i + 1..])) / row[0];
        }
    }
}

/// Σ a b, in four sums side by side so that a processor can take four terms at once; the same order, so the same bits,
/// always.
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

/// Four columns of a matrix side by side, row by row.
pub(crate) type Fours = [[f64; 4]];

/// Products of four columns with four others: entry (p, q) is that of column p of `a` and column q of `b`.
pub(crate) fn products(a: &Fours, b: &Fours) -> [[f64; 4]; 4] {
    let mut sums = [[0.0; 4]; 4];
    for (a, b) in a.iter().zip(b) {
        for p in 0..4 {
            for q in 0..4 {
                sums[p][q] += a[p] * b[q];
            }
        }
    }
    sums
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
