//! Connected components of images and volumes, found run by run.

use ndarray::{Array2, Array3, ArrayView2, ArrayView3, Axis};

use crate::disjoint_sets::DisjointSets;

/// Which pixels or voxels are neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Connectivity {
    /// Those that have a side of a pixel (a face of a voxel) in common: 4 neighbours in an image, 6 in a volume.
    #[default]
    Sides,
    /// Those that have a side, an edge or a corner in common: 8 neighbours in an image, 26 in a volume.
    Corners,
}

/// Connected components (4 neighbours) of equal, chosen values of an image, axes (y, x): a number from 1 for each, in
/// order of their first pixel, and 0 elsewhere; and how many there are.
///
/// # Complexity
///
/// Nearly linear in pixels: runs of rows are joined, not pixels.
///
/// # Examples
///
/// ```
/// use ndarray::array;
/// use stereology_imaging::connected_components;
///
/// let (components, count) = connected_components(array![[7, 7, 0, 7], [0, 3, 0, 0]].view(), |v| v != 0);
/// assert_eq!((components, count), (array![[1, 1, 0, 2], [0, 3, 0, 0]], 3));
/// ```
#[must_use]
pub fn connected_components<T: PartialEq + Copy>(
    values: ArrayView2<'_, T>,
    chosen: impl Fn(T) -> bool,
) -> (Array2<u32>, u32) {
    label_components(values, chosen, Connectivity::Sides)
}

/// [`connected_components`] of either connectivity.
///
/// # Examples
///
/// ```
/// use ndarray::array;
/// use stereology_imaging::{Connectivity, label_components};
///
/// let diagonal = array![[true, false], [false, true]];
/// assert_eq!(label_components(diagonal.view(), |v| v, Connectivity::Sides).1, 2);
/// assert_eq!(label_components(diagonal.view(), |v| v, Connectivity::Corners).1, 1);
/// ```
#[must_use]
pub fn label_components<T: PartialEq + Copy>(
    values: ArrayView2<'_, T>,
    chosen: impl Fn(T) -> bool,
    connectivity: Connectivity,
) -> (Array2<u32>, u32) {
    let (components, count) = label_components_3d(values.insert_axis(Axis(0)), chosen, connectivity);
    (components.remove_axis(Axis(0)), count)
}

/// Connected components of equal, chosen values of a volume, axes (z, y, x), as [`connected_components`] of an image.
///
/// # Complexity
///
/// Nearly linear in voxels. Runs are numbered in 32 bits: volumes of up to 2³² voxels always fit.
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use stereology_imaging::{Connectivity, label_components_3d};
///
/// // Two of the eight voxels, at opposite corners.
/// let mask = Array3::from_shape_fn((2, 2, 2), |(z, y, x)| z == y && y == x);
/// assert_eq!(label_components_3d(mask.view(), |m| m, Connectivity::Sides).1, 2);
/// assert_eq!(label_components_3d(mask.view(), |m| m, Connectivity::Corners).1, 1);
/// ```
#[must_use]
pub fn label_components_3d<T: PartialEq + Copy>(
    values: ArrayView3<'_, T>,
    chosen: impl Fn(T) -> bool,
    connectivity: Connectivity,
) -> (Array3<u32>, u32) {
    let (depth, height, width) = values.dim();
    let values = values.as_standard_layout();
    let values = values.as_slice().unwrap_or_default();
    let mut runs = Runs::default();
    let mut rows: Vec<std::ops::Range<usize>> = Vec::with_capacity(depth * height);
    for z in 0..depth {
        for y in 0..height {
            let row = &values[(z * height + y) * width..][..width];
            let first = runs.runs.len();
            runs.append(row, &chosen);
            for earlier in earlier_rows(z, y, height, connectivity) {
                let value_at = |column: usize| values[earlier * width + column];
                runs.join_touching(first, row, rows[earlier].clone(), value_at, connectivity);
            }
            rows.push(first..runs.runs.len());
        }
    }
    let (numbers, count) = runs.numbered();
    let mut out = Vec::with_capacity(values.len());
    for (y, rows) in rows.into_iter().enumerate() {
        for run in rows {
            out.resize(y * width + runs.runs[run].start, 0);
            out.resize(y * width + runs.runs[run].end, numbers[run]);
        }
    }
    out.resize(values.len(), 0);
    (
        Array3::from_shape_vec((depth, height, width), out).unwrap_or_default(),
        count,
    )
}

/// Rows before row (z, y) that touch it, numbered z · height + y.
fn earlier_rows(z: usize, y: usize, height: usize, connectivity: Connectivity) -> impl Iterator<Item = usize> {
    let corners = connectivity == Connectivity::Corners;
    let below = (z > 0).then(|| (z - 1) * height);
    [
        below.filter(|_| corners && y > 0).map(|row| row + y - 1),
        below.map(|row| row + y),
        below.filter(|_| corners && y + 1 < height).map(|row| row + y + 1),
        (y > 0).then(|| z * height + y - 1),
    ]
    .into_iter()
    .flatten()
}

/// A run of equal, chosen values in a row: columns from `start` to before `end`.
#[derive(Clone, Copy)]
struct Run {
    start: usize,
    end: usize,
}

/// Runs of all rows so far, and the sets of those that touch.
#[derive(Default)]
struct Runs {
    runs: Vec<Run>,
    /// The number of a run is its index.
    sets: DisjointSets,
}

impl Runs {
    fn append<T: PartialEq + Copy>(&mut self, row: &[T], chosen: &impl Fn(T) -> bool) {
        let mut x = 0;
        while x < row.len() {
            if !chosen(row[x]) {
                x += 1;
                continue;
            }
            let start = x;
            while x < row.len() && row[x] == row[start] {
                x += 1;
            }
            self.runs.push(Run { start, end: x });
            self.sets.push();
        }
    }

    /// Joins the runs of `row`, from number `first` on, with those of an earlier row that they touch and whose value is
    /// the same.
    fn join_touching<T: PartialEq + Copy>(
        &mut self,
        first: usize,
        row: &[T],
        earlier: std::ops::Range<usize>,
        value_at: impl Fn(usize) -> T,
        connectivity: Connectivity,
    ) {
        let reach = usize::from(connectivity == Connectivity::Corners);
        let mut next = earlier.start;
        // Both are below 2³²: `push` numbers the runs in 32 bits.
        let numbers = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        for this in first..self.runs.len() {
            let Run { start, end } = self.runs[this];
            while next < earlier.end && self.runs[next].end + reach <= start {
                next += 1;
            }
            let mut other = next;
            while other < earlier.end && self.runs[other].start < end + reach {
                if value_at(self.runs[other].start) == row[start] {
                    self.sets.unite(numbers(other), numbers(this));
                }
                other += 1;
            }
        }
    }

    /// The component of every run, from 1, and how many there are. The first run of a component is its root, so
    /// components are numbered by their first pixels.
    fn numbered(&mut self) -> (Vec<u32>, u32) {
        let mut count = 0;
        let mut numbers: Vec<u32> = Vec::with_capacity(self.runs.len());
        for (run, _) in (0..).zip(&self.runs) {
            let root = self.sets.root(run);
            let number = match numbers.get(root as usize) {
                Some(&number) => number,
                None => {
                    count += 1;
                    count
                }
            };
            numbers.push(number);
        }
        (numbers, count)
    }
}

#[cfg(test)]
mod tests {
    use super::{Connectivity, connected_components, label_components, label_components_3d};
    use ndarray::{Array2, Array3};
    use proptest::prelude::*;

    /// Voxel by voxel, from the first of each component to all neighbours.
    fn flooded(values: &Array3<u8>, connectivity: Connectivity) -> (Array3<u32>, u32) {
        let mut components = Array3::zeros(values.dim());
        let mut count = 0;
        for (start, &value) in values.indexed_iter() {
            if components[start] != 0 || value == 0 {
                continue;
            }
            count += 1;
            components[start] = count;
            let mut stack = vec![start];
            while let Some((z, y, x)) = stack.pop() {
                for (q, &there) in values.indexed_iter() {
                    let steps = [z.abs_diff(q.0), y.abs_diff(q.1), x.abs_diff(q.2)];
                    let touches = match connectivity {
                        Connectivity::Sides => steps.iter().sum::<usize>() == 1,
                        Connectivity::Corners => steps.iter().all(|s| *s <= 1),
                    };
                    if touches && components[q] == 0 && there == value {
                        components[q] = count;
                        stack.push(q);
                    }
                }
            }
        }
        (components, count)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]

        /// Joining runs gives the components that a flood fill gives.
        #[test]
        fn runs_give_the_components_of_a_flood_fill(depth in 1_usize..5, width in 1_usize..7, values in prop::collection::vec(0_u8..3, 1..150)) {
            let height = values.len() / (depth * width);
            let values = Array3::from_shape_fn((depth, height, width), |(z, y, x)| values[(z * height + y) * width + x]);
            for connectivity in [Connectivity::Sides, Connectivity::Corners] {
                prop_assert_eq!(label_components_3d(values.view(), |v| v != 0, connectivity), flooded(&values, connectivity));
            }
        }

        /// An image is a volume of one layer; its transpose, which is not contiguous, has as many components.
        #[test]
        fn images_are_volumes_of_one_layer(width in 1_usize..20, values in prop::collection::vec(0_u8..3, 1..200)) {
            let height = values.len() / width;
            let image = Array2::from_shape_fn((height, width), |(y, x)| values[y * width + x]);
            let layer = image.clone().insert_axis(ndarray::Axis(0));
            for connectivity in [Connectivity::Sides, Connectivity::Corners] {
                let (found, count) = label_components(image.view(), |v| v != 0, connectivity);
                prop_assert_eq!((found.insert_axis(ndarray::Axis(0)), count), flooded(&layer, connectivity));
            }
            let count = connected_components(image.view(), |v| v != 0).1;
            prop_assert_eq!(connected_components(image.t(), |v| v != 0).1, count);
        }
    }
}
