//! Small labels that are texture or compression artefacts rather than particles.

use ndarray::Array2;

use crate::ground::binder::length;

/// Least mean difference of a small profile from the binder, in standard deviations of the blunted binder.
const VISIBLE: f64 = 2.5;

/// Removes labels of fewer than eight times `least` pixels that are flecks: of the binder's texture, where less than a
/// tenth of the label is at least `high` from the binder, or of the photo's compression, where the mean difference is
/// hardly visible. `blunted` is the deviation from a [`blunted`](crate::BinderModel::blunted) binder.
pub(crate) fn remove_flecks(
    labels: &mut Array2<u32>,
    distance: &Array2<f32>,
    blunted: &Array2<[f32; 3]>,
    high: f32,
    least: usize,
) {
    let count = labels.iter().copied().max().unwrap_or(0) as usize + 1;
    let mut sums = vec![(0_usize, 0_usize, 0.0_f64); count];
    for ((&label, z), d) in labels.iter().zip(distance).zip(blunted) {
        let (strong, all, difference) = &mut sums[label as usize];
        *strong += usize::from(*z >= high);
        *all += 1;
        *difference += f64::from(length(*d));
    }
    let kept: Vec<bool> = sums
        .iter()
        .map(|&(strong, all, difference)| {
            all >= 8 * least || (10 * strong >= all && difference >= VISIBLE * all as f64)
        })
        .collect();
    labels.mapv_inplace(|l| if l != 0 && kept[l as usize] { l } else { 0 });
}
