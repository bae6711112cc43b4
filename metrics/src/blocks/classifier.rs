//! Two-sample test by a classifier: if two samples have one distribution, no classifier can separate them.

use nalgebra::{DMatrix, DVector};
use ndarray::ArrayView2;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// Result of a classifier two-sample test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassifierTest {
    /// Fraction of the members whose sample the classifier finds without having seen them; about .5 if the samples have
    /// one distribution.
    pub accuracy: f64,
    /// Probability of at least this accuracy if the labels of the samples mean nothing: by permutation of the labels.
    pub p_value: f64,
}

/// Parts of the samples that are classified by the others.
const FOLDS: usize = 5;
/// Random permutations of the labels; the smallest p-value is 1 / 1000.
const PERMUTATIONS: usize = 999;
/// Weight of the penalty on the classifier's coefficients, for features of unit variance and kernels of their mean
/// product: as much as a variance of 1 that no feature explains.
const RIDGE: f64 = 1.0;
/// Features are limited to this many standard deviations, so that single members do not decide.
const LIMIT: f64 = 3.0;
/// Members of a sample without which there is no test: with 8, the smallest p-value of a separation without errors is
/// 2 / C(16, 8) = .0002, below that of the permutations.
const FEWEST: usize = 8;

/// Tests whether two samples of feature vectors (member, feature), of equal numbers of members, have one distribution:
/// ridge regression on the sample's label (a linear discriminant), cross-validated in five parts of consecutive
/// members, with 999 permutations of the labels.
///
/// Features should be on a scale on which differences of `resolution` are irrelevant: it is added to their standard
/// deviation, so that a feature that hardly varies is not amplified. Under the hypothesis that all members are
/// exchangeable, the p-value is at most α in a fraction α of the cases. `None` with fewer than 8 members in a sample,
/// with different numbers, or with values that are not finite. Cost: n³ + 1000 n² for n members.
///
/// # Formula
///
/// ```text
/// H = K (K + λ I)⁻¹,  K = X Xᵀ / features          X: standardised features of both samples, y: labels ±1
/// prediction of part F without its labels: (I − H_FF)⁻¹ (H y − H_FF y_F)        linear in y: one matrix for all permutations
/// p = (1 + permutations with at least the accuracy found) / (1 + permutations)
/// ```
///
/// # References
///
/// Lopez-Paz & Oquab 2017; Golland & Fischl 2003.
///
/// # Examples
///
/// ```
/// use ndarray::Array2;
/// use stereology_metrics::classifier_test;
///
/// let sample = |shift: f64| Array2::from_shape_fn((20, 3), |(i, k)| ((7 * i + 3 * k) % 20) as f64 / 20.0 + shift);
/// let test = classifier_test(sample(0.0).view(), sample(1.0).view(), 0.01, 0).unwrap();
/// assert!(test.accuracy > 0.95 && test.p_value == 0.001);
/// ```
#[must_use]
pub fn classifier_test(
    a: ArrayView2<'_, f64>,
    b: ArrayView2<'_, f64>,
    resolution: f64,
    seed: u64,
) -> Option<ClassifierTest> {
    let n = a.nrows();
    if n < FEWEST || a.dim() != b.dim() || a.ncols() == 0 || a.iter().chain(&b).any(|v| !v.is_finite()) {
        return None;
    }
    let predict = predictor(&standardised(a, b, resolution), n)?;
    let accuracy = |labels: &DVector<f64>| {
        let found = &predict * labels;
        let right = found
            .iter()
            .zip(labels.iter())
            .filter(|(found, label)| *found * *label > 0.0);
        right.count()
    };
    let mut labels = DVector::from_fn(2 * n, |i, _| if i < n { 1.0 } else { -1.0 });
    let right = accuracy(&labels);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let as_good = (0..PERMUTATIONS)
        .filter(|_| {
            labels.as_mut_slice().shuffle(&mut rng);
            accuracy(&labels) >= right
        })
        .count();
    Some(ClassifierTest {
        accuracy: right as f64 / (2 * n) as f64,
        p_value: (1 + as_good) as f64 / (1 + PERMUTATIONS) as f64,
    })
}

/// Both samples, one after the other, with mean 0 and variance about 1 of each feature.
fn standardised(a: ArrayView2<'_, f64>, b: ArrayView2<'_, f64>, resolution: f64) -> DMatrix<f64> {
    let n = a.nrows();
    let mut features = DMatrix::from_fn(2 * n, a.ncols(), |i, k| if i < n { a[[i, k]] } else { b[[i - n, k]] });
    for mut column in features.column_iter_mut() {
        let mean = column.mean();
        let spread = (column.variance() + resolution * resolution)
            .sqrt()
            .max(f64::MIN_POSITIVE);
        column.apply(|v| *v = ((*v - mean) / spread).clamp(-LIMIT, LIMIT));
        let mean = column.mean();
        column.add_scalar_mut(-mean);
    }
    features
}

/// The matrix that gives each member's cross-validated prediction from the labels of both samples of `n` members.
fn predictor(features: &DMatrix<f64>, n: usize) -> Option<DMatrix<f64>> {
    let kernel = features * features.transpose() / features.ncols() as f64;
    let ridge = DMatrix::from_diagonal_element(2 * n, 2 * n, RIDGE);
    // Both factors commute, so the product is symmetric.
    let hat = (&kernel + ridge).cholesky()?.solve(&kernel);
    let mut predict = DMatrix::zeros(2 * n, 2 * n);
    for fold in 0..FOLDS {
        // Consecutive members may be neighbours in space; they are left out together.
        let members: Vec<usize> = (0..2 * n).filter(|i| (i % n) * FOLDS / n == fold).collect();
        let mut own = DMatrix::identity(members.len(), members.len());
        let mut rows = hat.select_rows(&members);
        for (i, _) in members.iter().enumerate() {
            for (j, &member) in members.iter().enumerate() {
                own[(i, j)] -= rows[(i, member)];
                rows[(i, member)] = 0.0;
            }
        }
        let predicted = own.lu().solve(&rows)?;
        for (i, &member) in members.iter().enumerate() {
            predict.set_row(member, &predicted.row(i));
        }
    }
    Some(predict)
}

#[cfg(test)]
mod tests {
    use super::{classifier_test, predictor, standardised};
    use nalgebra::{DMatrix, DVector};
    use ndarray::Array2;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn sample(rng: &mut ChaCha8Rng, shift: f64) -> Array2<f64> {
        Array2::from_shape_fn((24, 6), |_| (0..4).map(|_| rng.random::<f64>()).sum::<f64>() + shift)
    }

    /// The closed form of the cross-validation is that of fitting without each part.
    #[test]
    fn predictions_are_those_of_the_other_parts() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let (a, b) = (sample(&mut rng, 0.0), sample(&mut rng, 0.3));
        let features = standardised(a.view(), b.view(), 0.05);
        let labels = DVector::from_fn(48, |i, _| if i < 24 { 1.0 } else { -1.0 });
        let found = predictor(&features, 24).unwrap() * &labels;
        for fold in 0..5 {
            let is_own = |i: &usize| (i % 24) * 5 / 24 == fold;
            let others: Vec<usize> = (0..48).filter(|i| !is_own(i)).collect();
            let x = features.select_rows(&others);
            let y = DVector::from_iterator(others.len(), others.iter().map(|&i| labels[i]));
            // Ridge regression: (XᵀX / m + λ) c = Xᵀ y / m.
            let m = x.ncols() as f64;
            let normal = x.transpose() * &x / m + DMatrix::identity(x.ncols(), x.ncols());
            let coefficients = normal.lu().solve(&(x.transpose() * y / m)).unwrap();
            for i in (0..48).filter(is_own) {
                assert!((found[i] - (features.row(i) * &coefficients)[0]).abs() < 1e-9);
            }
        }
    }

    /// Samples of one distribution have a p-value of at most α with probability at most α. Of 400 tests the number at
    /// α = .05 is binomial with mean at most 20; it exceeds 46 once in 10⁷ times.
    #[test]
    fn false_alarms_are_as_stated() {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let alarms = (0..400)
            .filter(|&seed| {
                let (a, b) = (sample(&mut rng, 0.0), sample(&mut rng, 0.0));
                classifier_test(a.view(), b.view(), 0.05, seed).unwrap().p_value <= 0.05
            })
            .count();
        assert!(alarms <= 46, "{alarms}");
    }

    /// Too few members, and members without numbers, cannot be tested.
    #[test]
    fn what_cannot_be_tested() {
        let few = Array2::zeros((7, 2));
        assert_eq!(classifier_test(few.view(), few.view(), 0.1, 0), None);
        let nan = Array2::from_elem((9, 2), f64::NAN);
        assert_eq!(classifier_test(nan.view(), nan.view(), 0.1, 0), None);
        let equal = Array2::from_elem((9, 2), 1.0);
        assert!(classifier_test(equal.view(), equal.view(), 0.1, 0).unwrap().p_value > 0.5);
    }
}
