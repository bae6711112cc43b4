//! Labels spread to the pixels of a mask.

use std::collections::VecDeque;

use ndarray::Array2;

use crate::outlines::regions::neighbours4;

/// The labels of a mask's pixels: those they have, or those of the nearest labelled pixel of the mask, by steps within
/// it. Pixels outside the mask, and those that no label reaches, have 0.
///
/// # Complexity
///
/// Linear in pixels.
pub(crate) fn nearest_labels(labels: &Array2<u32>, mask: &Array2<bool>) -> Array2<u32> {
    let mut out = labels.clone();
    out.zip_mut_with(mask, |l, &m| *l = if m { *l } else { 0 });
    let dim = out.dim();
    let mut queue: VecDeque<[usize; 2]> = VecDeque::new();
    for ((y, x), &l) in out.indexed_iter() {
        if l != 0 && neighbours4([y, x], dim).any(|q| mask[q] && out[q] == 0) {
            queue.push_back([y, x]);
        }
    }
    while let Some(p) = queue.pop_front() {
        let label = out[p];
        for q in neighbours4(p, dim) {
            if mask[q] && out[q] == 0 {
                out[q] = label;
                queue.push_back(q);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::nearest_labels;
    use ndarray::array;

    /// Each pixel of the mask takes the label of its side of the gap; one that no label reaches has none.
    #[test]
    fn labels_spread_within_the_mask() {
        let labels = array![[1, 0, 0, 0, 2, 0, 0], [1, 3, 0, 0, 2, 0, 0]];
        let mask = array![
            [true, true, true, true, true, false, true],
            [true, false, false, false, true, false, true]
        ];
        let spread = nearest_labels(&labels, &mask);
        assert_eq!(spread, array![[1, 1, 1, 2, 2, 0, 0], [1, 0, 0, 0, 2, 0, 0]]);
    }
}
