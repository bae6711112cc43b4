//! Non-negative least squares by active sets (Lawson & Hanson 1974).

use nalgebra::{DMatrix, DVector};

/// A column of length 1 is in the span of others if no more than this is outside.
const LEAST_OUTSIDE: f64 = 1e-12;

/// A minimiser of ‖A x − b‖ over x ≥ 0, and how many times the set of positive entries grew.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Minimiser {
    pub(crate) solution: DVector<f64>,
    pub(crate) iterations: usize,
    pub(crate) converged: bool,
}

/// Minimises ‖A x − b‖ over x ≥ 0.
///
/// The columns are scaled to length 1 inside, so that the order of magnitude of a bin plays no part. At the end the
/// gradient w = Aᵀ (b − A x) is zero where x > 0 and not positive where x = 0, to rounding: the Kuhn-Tucker conditions,
/// which are enough for a minimum. A column that all but lies in the span of the others has a gradient below rounding
/// however much of b it alone explains; it is judged by its part outside that span.
pub(crate) fn minimise(a: &DMatrix<f64>, b: &DVector<f64>) -> Minimiser {
    let unknowns = a.ncols();
    let lengths: Vec<f64> = a.column_iter().map(|column| column.norm()).collect();
    let scaled = DMatrix::from_fn(a.nrows(), unknowns, |i, j| {
        if lengths[j] > 0.0 { a[(i, j)] / lengths[j] } else { 0.0 }
    });
    let tolerance = 1e-13 * b.norm() * a.nrows().max(unknowns) as f64;
    let mut x = DVector::zeros(unknowns);
    let mut free = vec![false; unknowns];
    let mut iterations = 0;
    // Columns that rounding made enter and leave at once since x last changed.
    let mut barred = vec![false; unknowns];
    while iterations < 10 * unknowns.max(3) {
        let rest = b - &scaled * &x;
        let may_enter = |j: &usize| !free[*j] && lengths[*j] > 0.0 && !barred[*j];
        let steepest = |gradient: &DVector<f64>| {
            (0..unknowns)
                .filter(|&j| may_enter(&j) && gradient[j] > tolerance)
                .max_by(|&i, &j| gradient[i].total_cmp(&gradient[j]).then(j.cmp(&i)))
        };
        let Some(enter) =
            steepest(&scaled.tr_mul(&rest)).or_else(|| steepest(&gradient_outside(&scaled, &free, &rest)))
        else {
            let solution = DVector::from_fn(unknowns, |j, _| if free[j] { x[j] / lengths[j] } else { 0.0 });
            return Minimiser {
                solution,
                iterations,
                converged: true,
            };
        };
        iterations += 1;
        free[enter] = true;
        loop {
            let trial = least_squares(&scaled, b, &free);
            let leaving = |j: &usize| free[*j] && trial[*j] <= 0.0;
            if leaving(&enter) && x[enter] <= 0.0 {
                free[enter] = false;
                barred[enter] = true;
                break;
            }
            barred.fill(false);
            let step = (0..unknowns)
                .filter(leaving)
                .map(|j| x[j] / (x[j] - trial[j]))
                .fold(1.0, f64::min);
            x += (trial - &x) * step;
            if step >= 1.0 {
                break;
            }
            for j in 0..unknowns {
                if free[j] && x[j] <= 1e-15 * x.amax() {
                    free[j] = false;
                    x[j] = 0.0;
                }
            }
        }
    }
    let solution = DVector::from_fn(unknowns, |j, _| if free[j] { x[j] / lengths[j] } else { 0.0 });
    Minimiser {
        solution,
        iterations,
        converged: false,
    }
}

/// The slope of ‖rest‖ along each column's part outside the span of the free columns, made of length 1; 0 where nothing
/// is outside.
fn gradient_outside(a: &DMatrix<f64>, free: &[bool], rest: &DVector<f64>) -> DVector<f64> {
    let span = a.select_columns(&indices(free)).qr().q();
    DVector::from_fn(a.ncols(), |j, _| {
        // Twice: once leaves of a nearly dependent column as much inside the span as rounding.
        let once = a.column(j) - &span * span.tr_mul(&a.column(j));
        let outside = &once - &span * span.tr_mul(&once);
        let length = outside.norm();
        if length > LEAST_OUTSIDE {
            outside.dot(rest) / length
        } else {
            0.0
        }
    })
}

fn indices(free: &[bool]) -> Vec<usize> {
    (0..free.len()).filter(|&j| free[j]).collect()
}

/// Least squares over the free columns; zero elsewhere.
fn least_squares(a: &DMatrix<f64>, b: &DVector<f64>, free: &[bool]) -> DVector<f64> {
    let columns = indices(free);
    let mut solution = DVector::zeros(a.ncols());
    let svd = a.select_columns(&columns).svd(true, true);
    if let Ok(part) = svd.solve(b, 1e-14) {
        for (k, &j) in columns.iter().enumerate() {
            solution[j] = part[k];
        }
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::minimise;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    fn system() -> impl Strategy<Value = (DMatrix<f64>, DVector<f64>)> {
        (1_usize..12, 1_usize..8).prop_flat_map(|(rows, columns)| {
            let entries = prop::collection::vec(0.0..1.0_f64, rows * columns);
            let right = prop::collection::vec(-1.0..1.0_f64, rows);
            (entries, right)
                .prop_map(move |(entries, right)| (DMatrix::from_vec(rows, columns, entries), DVector::from_vec(right)))
        })
    }

    /// Columns so alike that the gradient of the one left out is below rounding: only one set of them explains b.
    #[test]
    fn a_nearly_dependent_column_is_not_left_out() {
        // The counts of flattened particles: largest sections are rare, so that neighbouring sizes look alike.
        for rare in [1e-1, 1e-2, 1e-3, 3e-4] {
            let a = DMatrix::from_fn(7, 7, |i, j| match j.checked_sub(i) {
                None => 0.0,
                Some(0) => rare,
                Some(apart) => 0.3 * (-0.5 * apart as f64).exp(),
            });
            let truth = DVector::from_fn(7, |j, _| if j == 6 { 0.8 } else { 0.05 });
            let found = minimise(&a, &(&a * &truth));
            assert!(found.converged);
            assert!(
                (&a * &found.solution - &a * &truth).norm() < 1e-14,
                "{rare} {}",
                found.solution
            );
        }
    }

    /// With no column free, too, what leads away stays out.
    #[test]
    fn nothing_explains_what_is_not_positive() {
        let a = DMatrix::from_element(3, 2, 1.0);
        for b in [0.0, -1.0] {
            let found = minimise(&a, &DVector::from_element(3, b));
            assert!(found.converged);
            assert_eq!(found.solution, DVector::zeros(2));
        }
    }

    proptest! {
        /// Kuhn-Tucker: nothing negative, no descent into the positive, no slope where positive.
        #[test]
        fn solution_satisfies_kuhn_tucker((a, b) in system()) {
            let found = minimise(&a, &b);
            prop_assert!(found.converged);
            let gradient = a.tr_mul(&(&b - &a * &found.solution));
            for j in 0..a.ncols() {
                prop_assert!(found.solution[j] >= 0.0);
                prop_assert!(gradient[j] <= 1e-9, "gradient {} at {}", gradient[j], j);
                if found.solution[j] > 1e-9 {
                    prop_assert!(gradient[j].abs() <= 1e-9, "gradient {} at positive {}", gradient[j], j);
                }
            }
        }
    }
}
