//! Outlines of labels: from a label map to rings of corners and back.

use ndarray::Array2;
use stereology_imaging::connected_components;

use crate::conversions::whole_part;

/// Corners of a closed line, (x, y) in pixels from the photo's upper left corner, the first not repeated at the end.
pub type Ring = Vec<[f64; 2]>;

/// The outline of a label.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// The label.
    pub id: u32,
    /// Its connected components, each the ring around it and then those around its holes.
    pub components: Vec<Vec<Ring>>,
}

impl Outline {
    /// Area inside the rings, square pixels.
    #[must_use]
    pub fn area(&self) -> f64 {
        let rings = self.components.iter().map(|component| match component.split_first() {
            Some((outer, holes)) => ring_area(outer).abs() - holes.iter().map(|h| ring_area(h).abs()).sum::<f64>(),
            None => 0.0,
        });
        rings.sum()
    }
}

/// Outlines of all labels but 0, by increasing label, along the sides of pixels: [`fill_outlines`] gives exactly the
/// same map back.
///
/// # Complexity
///
/// Linear in pixels.
///
/// # Examples
///
/// ```
/// use ndarray::array;
/// use stereology_segment::{fill_outlines, outlines};
///
/// let labels = array![[0, 5, 5, 5], [0, 5, 0, 5], [2, 5, 5, 5]];
/// let rings = outlines(&labels);
/// assert_eq!((rings[1].id, rings[1].components[0].len(), rings[1].area()), (5, 2, 8.0)); // the ring around it and that of its hole
/// assert_eq!(rings[0].components[0][0], [[0.0, 2.0], [1.0, 2.0], [1.0, 3.0], [0.0, 3.0]]);
/// assert_eq!(fill_outlines(&rings, labels.dim()).0, labels);
/// ```
#[must_use]
pub fn outlines(labels: &Array2<u32>) -> Vec<Outline> {
    let (components, count) = connected_components(labels.view(), |l| l != 0);
    let (height, width) = labels.dim();
    let mut rings: Vec<(u32, Vec<Ring>)> = vec![(0, Vec::new()); count as usize + 1];
    let mut seen = Array2::from_elem(labels.dim(), false);
    for y in 0..height {
        for x in 0..width {
            let component = components[[y, x]];
            if component == 0 || seen[[y, x]] || (y > 0 && components[[y - 1, x]] == component) {
                continue;
            }
            let entry = &mut rings[component as usize];
            entry.0 = labels[[y, x]];
            // In reading order the first ring of a component is the one around it.
            entry.1.push(follow(&components, &mut seen, [x, y]));
        }
    }
    let mut found: Vec<Outline> = Vec::new();
    rings.retain(|(_, r)| !r.is_empty());
    rings.sort_by_key(|(id, _)| *id); // stable: components stay in reading order
    for (id, rings) in rings {
        match found.last_mut().filter(|o| o.id == id) {
            Some(outline) => outline.components.push(rings),
            None => found.push(Outline {
                id,
                components: vec![rings],
            }),
        }
    }
    found
}

/// The ring that begins eastwards along the upper side of pixel (x, y), with its component on the right; upper sides
/// passed on the way are marked in `seen`.
fn follow(components: &Array2<u32>, seen: &mut Array2<bool>, start: [usize; 2]) -> Ring {
    let component = components[[start[1], start[0]]];
    let inside = |x: isize, y: isize| {
        let at = usize::try_from(y).ok().zip(usize::try_from(x).ok());
        at.and_then(|p| components.get(p)) == Some(&component)
    };
    let (mut x, mut y, mut heading) = (start[0] as isize, start[1] as isize, 0_usize);
    let first = (x, y);
    let mut ring = Vec::new();
    loop {
        if heading == 0 {
            seen[[y.unsigned_abs(), x.unsigned_abs()]] = true;
        }
        let (dx, dy) = [(1, 0), (0, 1), (-1, 0), (0, -1)][heading];
        (x, y) = (x + dx, y + dy);
        // Pixels ahead on the right and on the left, heading east, south, west, north.
        let (right, left) = [
            ((x, y), (x, y - 1)),
            ((x - 1, y), (x, y)),
            ((x - 1, y - 1), (x - 1, y)),
            ((x, y - 1), (x - 1, y - 1)),
        ][heading];
        let turn = if !inside(right.0, right.1) {
            1
        } else if inside(left.0, left.1) {
            3
        } else {
            0
        };
        if turn != 0 {
            ring.push([x as f64, y as f64]);
            heading = (heading + turn) % 4;
        }
        if (x, y) == first && heading == 0 {
            break;
        }
    }
    ring.rotate_right(1);
    ring
}

/// Label map of outlines, axes (y, x), and how many pixels lie in more than one. A pixel belongs to the outline that
/// contains its centre, to the smaller one where outlines overlap; what lies outside the photo is left out.
///
/// # Complexity
///
/// Corners times the rows they span, and the pixels inside.
///
/// # Examples
///
/// See [`outlines`].
#[must_use]
pub fn fill_outlines(outlines: &[Outline], (height, width): (usize, usize)) -> (Array2<u32>, usize) {
    let mut labels = Array2::zeros((height, width));
    let mut overlap = 0;
    let mut order: Vec<(f64, &Outline)> = outlines.iter().map(|o| (o.area(), o)).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0)); // stable
    for (_, outline) in order {
        for component in &outline.components {
            for (y, crossings) in crossings(component, height) {
                for pair in crossings.chunks_exact(2) {
                    let pixel = |at: f64| whole_part((at - 0.5).ceil()).min(width);
                    for x in pixel(pair[0])..pixel(pair[1]) {
                        let label: &mut u32 = &mut labels[[y, x]];
                        overlap += usize::from(*label != 0 && *label != outline.id);
                        *label = outline.id;
                    }
                }
            }
        }
    }
    (labels, overlap)
}

/// Where the rings cross the centre lines of rows, increasing in each row.
fn crossings(rings: &[Ring], height: usize) -> Vec<(usize, Vec<f64>)> {
    let mut all: Vec<(usize, f64)> = Vec::new();
    for ring in rings {
        for (i, a) in ring.iter().enumerate() {
            let b = ring[(i + 1) % ring.len()];
            let (top, bottom) = if a[1] < b[1] { (*a, b) } else { (b, *a) };
            let row = |at: f64| whole_part((at - 0.5).ceil()).min(height);
            for y in row(top[1])..row(bottom[1]) {
                let fraction = (y as f64 + 0.5 - top[1]) / (bottom[1] - top[1]);
                all.push((y, top[0] + fraction * (bottom[0] - top[0])));
            }
        }
    }
    all.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut rows: Vec<(usize, Vec<f64>)> = Vec::new();
    for (y, x) in all {
        match rows.last_mut().filter(|row| row.0 == y) {
            Some(row) => row.1.push(x),
            None => rows.push((y, vec![x])),
        }
    }
    rows
}

/// Signed area of a ring, positive if clockwise on the screen.
pub(crate) fn ring_area(ring: &[[f64; 2]]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    0.5 * ring
        .iter()
        .zip(next)
        .map(|(a, b)| a[0] * b[1] - b[0] * a[1])
        .sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A map survives the round trip through outlines, whatever its components, holes and touching corners; areas
        /// are numbers of pixels.
        #[test]
        fn maps_survive_the_round_trip(values in proptest::collection::vec(0_u32..4, 63)) {
            let labels = Array2::from_shape_vec((7, 9), values).unwrap();
            let found = outlines(&labels);
            for o in &found {
                let pixels = labels.iter().filter(|l| **l == o.id).count();
                prop_assert!((o.area() - pixels as f64).abs() < 1e-9);
            }
            prop_assert_eq!(fill_outlines(&found, labels.dim()), (labels, 0));
        }
    }
}
