//! Regions of a mask: hysteresis, holes, opening.

use ndarray::Array2;
use stereology_imaging::{Connectivity, connected_components, label_components};

/// Hysteresis threshold: connected components (8 neighbours) of pixels of at least `low` that contain one of at least
/// `high`.
///
/// # Examples
///
/// ```
/// let z = ndarray::array![[6.0_f32, 10.0, 0.0, 6.0, 6.0]];
/// let mask = stereology_segment::hysteresis(&z, 5.0, 9.0);
/// assert_eq!(mask, ndarray::array![[true, true, false, false, false]]);
/// ```
#[must_use]
pub fn hysteresis(distance: &Array2<f32>, low: f32, high: f32) -> Array2<bool> {
    let candidates = distance.mapv(|z| z >= low);
    let (components, count) = label_components(candidates.view(), |c| c, Connectivity::Corners);
    let mut strong = vec![false; count as usize + 1];
    for (&component, &z) in components.iter().zip(distance) {
        strong[component as usize] |= z >= high;
    }
    strong[0] = false;
    components.mapv(|component| strong[component as usize])
}

/// Fills the holes of a mask: connected components (4 neighbours) of the outside that do not reach the photo's edge and
/// for which `fill(area of the hole, area of the mask around it)` holds, in pixels. The area around a hole is that of
/// the component of the mask that its first pixel's left neighbour belongs to.
///
/// # Examples
///
/// ```
/// let mut ring = ndarray::Array2::from_shape_fn((5, 5), |(y, x)| (1..4).contains(&y) && (1..4).contains(&x) && (y, x) != (2, 2));
/// stereology_segment::fill_holes(&mut ring, |_, _| true);
/// assert!(ring[[2, 2]] && !ring[[0, 0]]);
/// ```
pub fn fill_holes(mask: &mut Array2<bool>, fill: impl Fn(usize, usize) -> bool) {
    let (outside, count) = connected_components(mask.view(), |m| !m);
    let (inside, components) = connected_components(mask.view(), |m| m);
    let mut areas = vec![0_usize; components as usize + 1];
    inside.iter().for_each(|&i| areas[i as usize] += 1);
    let mut holes = vec![(0_usize, 0_usize); count as usize + 1];
    for ((y, x), &o) in outside.indexed_iter() {
        let hole = &mut holes[o as usize];
        if hole.0 == 0 && x > 0 {
            hole.1 = areas[inside[[y, x - 1]] as usize];
        }
        hole.0 += 1;
    }
    let (height, width) = mask.dim();
    let mut filled: Vec<bool> = holes.iter().map(|&(area, around)| fill(area, around)).collect();
    filled[0] = false;
    for x in 0..width {
        filled[outside[[0, x]] as usize] = false;
        filled[outside[[height - 1, x]] as usize] = false;
    }
    for y in 0..height {
        filled[outside[[y, 0]] as usize] = false;
        filled[outside[[y, width - 1]] as usize] = false;
    }
    mask.zip_mut_with(&outside, |m, &o| *m |= filled[o as usize]);
}

/// Opening by a cross of radius 1: removes lines and specks thinner than three pixels. There is no erosion from the
/// photo's edge.
///
/// # Examples
///
/// ```
/// let mut line = ndarray::Array2::from_shape_fn((5, 9), |(y, _)| y == 2);
/// stereology_segment::open(&mut line);
/// assert!(line.iter().all(|m| !m));
/// ```
pub fn open(mask: &mut Array2<bool>) {
    let dim = mask.dim();
    let eroded = Array2::from_shape_fn(dim, |(y, x)| mask[[y, x]] && neighbours4([y, x], dim).all(|q| mask[q]));
    *mask = Array2::from_shape_fn(dim, |(y, x)| {
        eroded[[y, x]] || neighbours4([y, x], dim).any(|q| eroded[q])
    });
}

/// The neighbours of a pixel across its sides.
pub(crate) fn neighbours4([y, x]: [usize; 2], (height, width): (usize, usize)) -> impl Iterator<Item = [usize; 2]> {
    [
        (y > 0).then(|| [y - 1, x]),
        (x > 0).then(|| [y, x - 1]),
        (x + 1 < width).then(|| [y, x + 1]),
        (y + 1 < height).then(|| [y + 1, x]),
    ]
    .into_iter()
    .flatten()
}

/// The neighbours of a pixel across its sides and corners.
pub(crate) fn neighbours8([y, x]: [usize; 2], (height, width): (usize, usize)) -> impl Iterator<Item = [usize; 2]> {
    let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
    rows.flat_map(move |j| (x.saturating_sub(1)..=(x + 1).min(width - 1)).map(move |i| [j, i]))
        .filter(move |q| *q != [y, x])
}
