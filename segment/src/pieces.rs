//! Connected pieces of a picture, found run by run.

use ndarray::Array2;

/// What two pixels of one piece share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Contact {
    /// A side: 4 neighbours.
    Sides,
    /// A side or a corner: 8 neighbours.
    Corners,
}

/// Connected pieces (4 neighbours) of equal, chosen values: a number from 1 for each, in order of their first pixel, and 0 elsewhere; and how many.
///
/// # Complexity
///
/// Linear in pixels but for the inverse Ackermann function: runs of rows are joined, not pixels.
///
/// # Examples
///
/// ```
/// use ndarray::array;
/// let (pieces, count) = stereology_segment::connected_pieces(&array![[7, 7, 0, 7], [0, 3, 0, 0]], |v| v != 0);
/// assert_eq!((pieces, count), (array![[1, 1, 0, 2], [0, 3, 0, 0]], 3));
/// ```
#[must_use]
pub fn connected_pieces<T: PartialEq + Copy>(values: &Array2<T>, chosen: impl Fn(T) -> bool) -> (Array2<u32>, u32) {
    pieces(values, chosen, Contact::Sides)
}

/// A run of equal, chosen values in a row: columns from `start` to before `end`.
#[derive(Clone, Copy)]
struct Run {
    start: usize,
    end: usize,
}

/// [`connected_pieces`] by sides or corners.
pub(crate) fn pieces<T: PartialEq + Copy>(
    values: &Array2<T>,
    chosen: impl Fn(T) -> bool,
    contact: Contact,
) -> (Array2<u32>, u32) {
    let (height, width) = values.dim();
    let values = values.as_standard_layout();
    let values = values.as_slice().unwrap_or_default();
    let reach = usize::from(contact == Contact::Corners);
    let mut runs: Vec<Run> = Vec::new();
    let mut parent: Vec<u32> = Vec::new();
    let mut rows = vec![0..0; height];
    for y in 0..height {
        let row = &values[y * width..(y + 1) * width];
        let above = if y == 0 { 0..0 } else { rows[y - 1].clone() };
        let mut upper = above.start;
        let first = runs.len();
        let mut x = 0;
        while x < width {
            if !chosen(row[x]) {
                x += 1;
                continue;
            }
            let start = x;
            while x < width && row[x] == row[start] {
                x += 1;
            }
            let this = runs.len();
            runs.push(Run { start, end: x });
            parent.push(this as u32);
            while upper < above.end && runs[upper].end + reach <= start {
                upper += 1;
            }
            let mut other = upper;
            while other < above.end && runs[other].start < x + reach {
                if values[(y - 1) * width + runs[other].start] == row[start] {
                    join(&mut parent, other as u32, this as u32);
                }
                other += 1;
            }
        }
        rows[y] = first..runs.len();
    }
    // The first run of a piece is its root, so that pieces are numbered by their first pixels.
    let mut count = 0;
    let mut numbers = vec![0_u32; runs.len()];
    for run in 0..runs.len() {
        let root = find(&mut parent, run as u32) as usize;
        if root == run {
            count += 1;
            numbers[run] = count;
        } else {
            numbers[run] = numbers[root];
        }
    }
    let mut out = Vec::with_capacity(values.len());
    for (y, rows) in rows.into_iter().enumerate() {
        for run in rows {
            out.resize(y * width + runs[run].start, 0);
            out.resize(y * width + runs[run].end, numbers[run]);
        }
    }
    out.resize(values.len(), 0);
    (Array2::from_shape_vec((height, width), out).unwrap_or_default(), count)
}

/// Root of a set; paths are halved on the way.
pub(crate) fn find(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        let up = parent[parent[i as usize] as usize];
        parent[i as usize] = up;
        i = up;
    }
    i
}

/// Makes two sets one, whose root is the smaller number.
fn join(parent: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(parent, a), find(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regions::{neighbours4, neighbours8};
    use proptest::prelude::*;

    /// Pixel by pixel.
    fn flooded(values: &Array2<u8>, contact: Contact) -> (Array2<u32>, u32) {
        let mut pieces = Array2::zeros(values.dim());
        let mut count = 0;
        for ((y, x), &value) in values.indexed_iter() {
            if pieces[[y, x]] != 0 || value == 0 {
                continue;
            }
            count += 1;
            pieces[[y, x]] = count;
            let mut stack = vec![[y, x]];
            while let Some(p) = stack.pop() {
                let around: Vec<[usize; 2]> = match contact {
                    Contact::Sides => neighbours4(p, values.dim()).collect(),
                    Contact::Corners => neighbours8(p, values.dim()).collect(),
                };
                for q in around {
                    if pieces[q] == 0 && values[q] == value {
                        pieces[q] = count;
                        stack.push(q);
                    }
                }
            }
        }
        (pieces, count)
    }

    proptest! {
        /// Runs give what a flood gives.
        #[test]
        fn runs_as_floods(width in 1_usize..20, values in proptest::collection::vec(0_u8..3, 1..300)) {
            let height = values.len() / width;
            let values = Array2::from_shape_fn((height, width), |(y, x)| values[y * width + x]);
            for contact in [Contact::Sides, Contact::Corners] {
                prop_assert_eq!(pieces(&values, |v| v != 0, contact), flooded(&values, contact));
            }
            let turned = values.clone().reversed_axes();
            prop_assert_eq!(pieces(&turned, |v| v != 0, Contact::Sides).1, pieces(&values, |v| v != 0, Contact::Sides).1);
        }
    }
}
