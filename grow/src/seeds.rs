//! Seeds: measured areas, random voxels, and one seed for each part of the mask that would have none.

use ndarray::{Array3, ArrayView3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use stereology_imaging::{Connectivity, label_components_3d};

use crate::numbers::number;

/// Seed voxels (z, y, x) with the number of their cell, from 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Seeds {
    pub(crate) voxels: Vec<([usize; 3], u32)>,
    pub(crate) cells: usize,
    /// Cells that were added because a part of the mask had no seed.
    pub(crate) added: usize,
}

impl Seeds {
    /// The measured voxels, sorted by position: connected ones (26 neighbours) share a cell, numbered in the order of
    /// their first voxel.
    pub(crate) fn measured(size: (usize, usize, usize), measured: &[[usize; 3]]) -> Self {
        if measured.is_empty() {
            return Self::default();
        }
        let mut is_measured = Array3::from_elem(size, false);
        measured.iter().for_each(|voxel| is_measured[*voxel] = true);
        let (areas, count) = label_components_3d(is_measured.view(), |here| here, Connectivity::Corners);
        Self {
            voxels: measured.iter().map(|voxel| (*voxel, areas[*voxel])).collect(),
            cells: count as usize,
            added: 0,
        }
    }

    /// Adds up to `count` random voxels of the mask that are not measured, each a cell of its own.
    pub(crate) fn add_random(&mut self, mask: ArrayView3<'_, bool>, count: usize, rng: &mut ChaCha8Rng) {
        if count == 0 {
            return;
        }
        let measured: Vec<[usize; 3]> = self.voxels.iter().map(|(voxel, _)| *voxel).collect();
        let mut free: Vec<[usize; 3]> = mask
            .indexed_iter()
            .filter(|(_, inside)| **inside)
            .map(|((z, y, x), _)| [z, y, x])
            .filter(|voxel| measured.binary_search(voxel).is_err())
            .collect();
        for i in 0..count.min(free.len()) {
            let j = rng.random_range(i..free.len());
            free.swap(i, j);
            self.add(free[i]);
        }
    }

    /// Adds the first voxel of each connected component of the mask (26 neighbours) that has no seed. Cost: linear.
    pub(crate) fn complete(&mut self, mask: ArrayView3<'_, bool>) {
        let (components, count) = label_components_3d(mask, |inside| inside, Connectivity::Corners);
        // Component 0 is what lies outside the mask.
        let mut has_seed = vec![false; count as usize + 1];
        has_seed[0] = true;
        for (voxel, _) in &self.voxels {
            has_seed[components[*voxel] as usize] = true;
        }
        for ((z, y, x), &component) in components.indexed_iter() {
            if !std::mem::replace(&mut has_seed[component as usize], true) {
                self.add([z, y, x]);
                self.added += 1;
            }
        }
    }

    fn add(&mut self, voxel: [usize; 3]) {
        self.cells += 1;
        self.voxels.push((voxel, number(self.cells)));
    }
}

#[cfg(test)]
mod tests {
    use super::Seeds;
    use crate::flood_fill::flood_fill;
    use ndarray::Array3;
    use proptest::prelude::*;

    /// Fills the mask again for every part without a seed, and seeds its first voxel: slow, but plainly right.
    fn by_repeated_fills(mask: &Array3<bool>, mut seeds: Seeds) -> Seeds {
        loop {
            let fill = flood_fill(mask.view(), &seeds.voxels);
            let free = mask
                .indexed_iter()
                .find(|(at, inside)| **inside && fill.labels[*at] == 0);
            let Some(((z, y, x), _)) = free else { return seeds };
            seeds.add([z, y, x]);
            seeds.added += 1;
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]

        /// The same seeds, in the same order, as filling again for every part without a seed; and one fill with them
        /// reaches every voxel.
        #[test]
        fn components_are_seeded_as_by_repeated_fills(
            bits in prop::collection::vec(prop::bool::weighted(0.15), 9 * 10 * 11),
            measured in prop::collection::btree_set((0_usize..9, 0_usize..10, 0_usize..11), 0..6),
        ) {
            let mut mask = Array3::from_shape_vec((9, 10, 11), bits).unwrap_or_default();
            let measured: Vec<[usize; 3]> = measured.into_iter().map(|(z, y, x)| [z, y, x]).collect();
            measured.iter().for_each(|voxel| mask[*voxel] = true);
            let begun = Seeds::measured(mask.dim(), &measured);
            let mut found = begun.clone();
            found.complete(mask.view());
            let fill = flood_fill(mask.view(), &found.voxels);
            prop_assert_eq!(fill.order.len(), mask.iter().filter(|inside| **inside).count());
            prop_assert_eq!(found, by_repeated_fills(&mask, begun));
        }
    }

    /// Measured voxels that share a corner are one cell.
    #[test]
    fn connected_measurements_share_a_cell() {
        let seeds = Seeds::measured((6, 6, 6), &[[0, 0, 0], [0, 1, 1], [5, 5, 5]]);
        let cells: Vec<u32> = seeds.voxels.iter().map(|(_, cell)| *cell).collect();
        assert_eq!((cells, seeds.cells), (vec![1, 1, 2], 2));
    }

    /// Thousands of separate parts are seeded and filled by one pass each; filling again for every part would visit
    /// 8,000 times as many voxels.
    #[test]
    fn thousands_of_components() {
        let mask = Array3::from_shape_fn((80, 80, 80), |(z, y, x)| [z, y, x].iter().all(|i| i % 4 < 3));
        let mut seeds = Seeds::default();
        seeds.complete(mask.view());
        assert_eq!((seeds.cells, seeds.added, seeds.voxels[1].0), (8_000, 8_000, [0, 0, 4]));
        let fill = flood_fill(mask.view(), &seeds.voxels);
        assert_eq!(fill.order.len(), 27 * 8_000);
    }
}
