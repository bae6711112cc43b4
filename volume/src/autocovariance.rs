//! Autocovariance of neighbouring voxels of a periodic colour volume.

use crate::narrow::single;
use rayon::prelude::*;

/// A step from a voxel to a neighbour along x, y, z, and the index a + 2b + 4c of its products for lag (±a, ±b, ±c). A
/// step and its opposite are equivalent; only one of them is listed.
const STEPS: [(usize, [i8; 3]); 14] = [
    (0, [0, 0, 0]),
    (1, [1, 0, 0]),
    (2, [0, 1, 0]),
    (3, [1, 1, 0]),
    (3, [1, -1, 0]),
    (4, [0, 0, 1]),
    (5, [1, 0, 1]),
    (5, [-1, 0, 1]),
    (6, [0, 1, 1]),
    (6, [0, -1, 1]),
    (7, [1, 1, 1]),
    (7, [1, -1, 1]),
    (7, [-1, 1, 1]),
    (7, [-1, -1, 1]),
];

/// Mean and autocovariance, averaged over the signs of the lag, of each channel of samples (z, y, x, 3). Summed plane
/// by plane in order.
pub(crate) fn mean_and_autocovariance(samples: &[f32], [nx, ny, nz]: [usize; 3]) -> ([f32; 3], [[f32; 3]; 8]) {
    let of_row = 3 * nx;
    let plane = |z: usize| &samples[(z % nz) * ny * of_row..][..ny * of_row];
    let per_voxel = ((nx * ny * nz) as f64).recip();
    let sums: Vec<[f64; 3]> = (0..nz)
        .into_par_iter()
        .map(|z| plane(z).chunks_exact(of_row).map(sum).fold([0.0; 3], plus))
        .collect();
    let mean = sums.into_iter().fold([0.0; 3], plus).map(|sum| single(sum * per_voxel));
    // Differences before products: for values far from zero the difference of mean products would lose all digits.
    let centred = |z: usize| -> Vec<f32> {
        let voxels = plane(z).as_chunks::<3>().0.iter();
        voxels
            .flat_map(|rgb| [rgb[0] - mean[0], rgb[1] - mean[1], rgb[2] - mean[2]])
            .collect()
    };
    let products_of_plane = |z: usize| {
        let planes = [centred(z), centred(z + 1)];
        let row = |plane: usize, y: usize| &planes[plane][y % ny * of_row..][..of_row];
        STEPS.map(|(_, [x, y, z])| {
            let (x, y) = ([0, 1, nx - 1][usize_of(x)], [0, 1, ny - 1][usize_of(y)]);
            (0..ny)
                .map(|here| products(row(0, here), row(usize_of(z), here + y), 3 * (x % nx)))
                .fold([0.0; 3], plus)
        })
    };
    let planes: Vec<[[f64; 3]; 14]> = (0..nz).into_par_iter().map(products_of_plane).collect();
    let mut covariance = [[0.0; 3]; 8];
    for (step, (index, _)) in STEPS.iter().enumerate() {
        let signs = STEPS.iter().filter(|(other, _)| other == index).count() as f64;
        let sum = planes.iter().map(|sums| sums[step]).fold([0.0; 3], plus);
        covariance[*index] = plus(covariance[*index], sum.map(|sum| sum * per_voxel / signs));
    }
    (mean, covariance.map(|rgb| rgb.map(single)))
}

/// 0, 1 or, for −1, 2.
fn usize_of(step: i8) -> usize {
    usize::from(step.rem_euclid(3).unsigned_abs())
}

/// Sums of the channels of a row.
fn sum(row: &[f32]) -> [f64; 3] {
    let voxels = row.as_chunks::<3>().0.iter();
    voxels.fold([0.0; 3], |sum, rgb| plus(sum, rgb.map(f64::from)))
}

/// Sums of the products of one row with another from sample `shift` on, around its end.
fn products(here: &[f32], there: &[f32], shift: usize) -> [f64; 3] {
    let (before, after) = there.split_at(shift);
    let (most, last) = here.split_at(after.len());
    plus(straight_products(most, after), straight_products(last, before))
}

/// Sums of products, channel by channel: four voxels side by side, in f32 along a row.
fn straight_products(a: &[f32], b: &[f32]) -> [f64; 3] {
    let mut sums = [0.0_f32; 12];
    let ((a, rest_of_a), (b, rest_of_b)) = (a.as_chunks::<12>(), b.as_chunks::<12>());
    for (a, b) in a.iter().zip(b) {
        for k in 0..12 {
            sums[k] += a[k] * b[k];
        }
    }
    for (k, (a, b)) in rest_of_a.iter().zip(rest_of_b).enumerate() {
        sums[k] += a * b;
    }
    [0, 1, 2].map(|c| sums[c..].iter().step_by(3).copied().map(f64::from).sum())
}

fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[cfg(test)]
mod tests {
    use super::mean_and_autocovariance;
    use proptest::prelude::*;

    proptest! {
        /// The mean over all voxels and both signs of every lag, on boxes of any size down to one voxel and far from
        /// zero.
        #[test]
        fn products_are_those_of_all_pairs(sizes in prop::array::uniform3(1_usize..7), offset in -100.0..100.0_f32, seed in 0_u32..99) {
            let [nx, ny, nz] = sizes;
            let at = |x: usize, y: usize, z: usize, c: usize| {
                let number = (((z % nz) * ny + y % ny) * nx + x % nx) * 3 + c;
                offset + ((u32::try_from(number).unwrap() + seed).wrapping_mul(2_654_435_761) >> 8) as f32 / 1e7
            };
            let voxels: Vec<[usize; 3]> = (0..nx * ny * nz).map(|i| [i % nx, i / nx % ny, i / nx / ny]).collect();
            let samples: Vec<f32> = voxels.iter().flat_map(|&[x, y, z]| [0, 1, 2].map(|c| at(x, y, z, c))).collect();
            let (mean, covariance) = mean_and_autocovariance(&samples, sizes);
            for c in 0..3 {
                let average = |value: &dyn Fn([usize; 3]) -> f64| voxels.iter().map(|v| value(*v)).sum::<f64>() / voxels.len() as f64;
                let expected = average(&|[x, y, z]| f64::from(at(x, y, z, c)));
                prop_assert!((f64::from(mean[c]) - expected).abs() < 1e-5);
                for (index, covariance) in covariance.iter().enumerate() {
                    let lag = [index & 1, index >> 1 & 1, index >> 2 & 1];
                    let signs = [0, 1, 2, 3, 4, 5, 6, 7].map(|signs| {
                        average(&|v| {
                            let there = [0, 1, 2].map(|k| if signs >> k & 1 == 0 { v[k] + lag[k] } else { v[k] + sizes[k] - lag[k] });
                            let [here, there] = [v, there].map(|[x, y, z]| f64::from(at(x, y, z, c)) - expected);
                            here * there
                        })
                    });
                    let expected = signs.iter().sum::<f64>() / 8.0;
                    prop_assert!((f64::from(covariance[c]) - expected).abs() < 1e-5, "{lag:?} {} {expected}", covariance[c]);
                }
            }
        }
    }
}
