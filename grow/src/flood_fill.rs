//! Priority flood fill: all seeds grow at once, nearest voxels first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use ndarray::{Array3, ArrayView3};

use crate::neighbours::{is_inside, moved, neighbours};

/// The order in which voxels are filled, and the seed from which each is reached.
#[derive(Clone, Debug, PartialEq)]
pub struct FloodFill {
    /// Voxels (z, y, x) in the order of filling; the seeds come first.
    pub order: Vec<[usize; 3]>,
    /// Label of the seed from which a voxel is reached; 0 for voxels that are not filled.
    pub labels: Array3<u32>,
}

/// Fills the mask (z, y, x) outwards from seed voxels. A heap ordered by distance to the own seed, then by time of
/// insertion, gives the next voxel, so that each seed's cell is its Voronoi cell.
///
/// Seeds carry labels from 1; several may share one. Distances are Euclidean, in voxels, and the front advances to all
/// 26 neighbours, so a cell extends around corners of the mask. Seeds outside the mask and repeated seeds are skipped.
/// Voxels of components without a seed keep the label 0. Cost: N log N.
///
/// # References
///
/// Stone et al. 2014, section 4.1.1 and figure 3.
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use stereology_grow::flood_fill;
///
/// let line = Array3::from_elem((1, 1, 6), true);
/// let fill = flood_fill(line.view(), &[([0, 0, 0], 1), ([0, 0, 5], 2)]);
/// assert_eq!(fill.labels.iter().copied().collect::<Vec<_>>(), [1, 1, 1, 2, 2, 2]);
/// assert_eq!(fill.order[2], [0, 0, 1]);
/// ```
#[must_use]
pub fn flood_fill(mask: ArrayView3<'_, bool>, seeds: &[([usize; 3], u32)]) -> FloodFill {
    let mut labels = Array3::zeros(mask.dim());
    let mut order = Vec::new();
    // The nearest seed a voxel was offered so far: farther offers need no place in the heap.
    let mut offered = Array3::from_elem(mask.dim(), u64::MAX);
    let mut heap = BinaryHeap::new();
    let mut inserted = 0_u64;
    for (seed, (voxel, _)) in seeds.iter().enumerate() {
        if is_inside(&mask, *voxel) && offered[*voxel] > 0 {
            offered[*voxel] = 0;
            heap.push(Reverse((0, inserted, seed, *voxel)));
            inserted += 1;
        }
    }
    let steps: Vec<[isize; 3]> = neighbours().collect();
    while let Some(Reverse((_, _, seed, voxel))) = heap.pop() {
        if labels[voxel] != 0 {
            continue;
        }
        labels[voxel] = seeds[seed].1;
        order.push(voxel);
        for step in &steps {
            let Some(near) = moved(voxel, *step).filter(|near| is_inside(&mask, *near)) else {
                continue;
            };
            let distance: u64 = near
                .iter()
                .zip(&seeds[seed].0)
                .map(|(a, b)| (a.abs_diff(*b) as u64).pow(2))
                .sum();
            if labels[near] == 0 && distance < offered[near] {
                offered[near] = distance;
                heap.push(Reverse((distance, inserted, seed, near)));
                inserted += 1;
            }
        }
    }
    FloodFill { order, labels }
}

#[cfg(test)]
mod tests {
    use super::flood_fill;
    use ndarray::Array3;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(30))]

        /// In a box every voxel belongs to its nearest seed: Voronoi cells. The front may miss the few voxels of a cell
        /// that are not connected with it by neighbours.
        #[test]
        fn cells_are_voronoi_cells(seeds in prop::collection::btree_set((0_usize..16, 0_usize..16, 0_usize..16), 1..12)) {
            let seeds: Vec<[usize; 3]> = seeds.into_iter().map(|(z, y, x)| [z, y, x]).collect();
            let labelled: Vec<_> = seeds.iter().zip(1..).map(|(s, l)| (*s, l)).collect();
            let fill = flood_fill(Array3::from_elem((16, 16, 16), true).view(), &labelled);
            prop_assert_eq!(fill.order.len(), 4096);
            let square = |a: [usize; 3], b: [usize; 3]| a.iter().zip(&b).map(|(a, b)| a.abs_diff(*b).pow(2)).sum::<usize>();
            let wrong = fill.labels.indexed_iter().filter(|((z, y, x), label)| {
                let here = [*z, *y, *x];
                let nearest = seeds.iter().map(|s| square(*s, here)).min().unwrap();
                square(seeds[**label as usize - 1], here) > nearest
            });
            prop_assert!(wrong.count() <= 4);
            // Distances do not decrease along the order.
            let of = |v: &[usize; 3]| square(seeds[fill.labels[*v] as usize - 1], *v);
            prop_assert!(fill.order.windows(2).filter(|pair| of(&pair[0]) > of(&pair[1])).count() <= 4);
        }
    }

    /// A wall divides the mask: voxels behind it are not reached.
    #[test]
    fn unconnected_voxels_stay_empty() {
        let mut mask = Array3::from_elem((3, 3, 7), true);
        mask.index_axis_mut(ndarray::Axis(2), 3).fill(false);
        let fill = flood_fill(mask.view(), &[([0, 0, 0], 7), ([9, 9, 9], 1)]);
        assert_eq!(fill.order.len(), 27);
        assert_eq!((fill.labels[[2, 2, 2]], fill.labels[[2, 2, 4]]), (7, 0));
    }
}
