//! The paper's estimator: N_V = K⁻¹ N_A, eqs. (4), (8), by back-substitution where the kernel is upper triangular.

use nalgebra::{DMatrix, DVector};

/// Solves `kernel x = profiles`; `None` if the kernel is singular. The solution may have negative entries.
pub(crate) fn solve(kernel: &DMatrix<f64>, profiles: &DVector<f64>) -> Option<DVector<f64>> {
    let solution = if is_upper_triangular(kernel) {
        kernel.solve_upper_triangular(profiles)?
    } else {
        kernel.clone().lu().solve(profiles)?
    };
    solution.iter().all(|value| value.is_finite()).then_some(solution)
}

fn is_upper_triangular(kernel: &DMatrix<f64>) -> bool {
    (0..kernel.ncols()).all(|j| (j + 1..kernel.nrows()).all(|i| kernel[(i, j)].abs() <= 0.0))
}

#[cfg(test)]
mod tests {
    use super::solve;
    use nalgebra::{dmatrix, dvector};

    #[test]
    fn triangular_and_full_systems_are_solved_and_singular_ones_refused() {
        assert_eq!(
            solve(&dmatrix![1.0, 1.0; 0.0, 2.0], &dvector![3.0, 4.0]),
            Some(dvector![1.0, 2.0])
        );
        let full = solve(&dmatrix![1.0, 1.0; 1.0, 2.0], &dvector![3.0, 5.0]).unwrap();
        assert!((full - dvector![1.0, 2.0]).norm() < 1e-12);
        assert_eq!(solve(&dmatrix![1.0, 1.0; 0.0, 0.0], &dvector![3.0, 4.0]), None);
    }
}
