//! Halos: categories of labels that are blurred rims of particles rather than particles.

use ndarray::Array2;

use crate::labels::category::Category;
use crate::labels::profile::{Index, Profile};

/// Steps from a pixel to the label that it hugs, along rows and columns.
const NEAR: usize = 2;
/// Fraction of its outline near another label from which a label hugs.
const HUGS: f64 = 0.3;
/// Fewest labels of a category that can be a halo.
const FEWEST: usize = 3;
/// Fraction of a category's labels that hug from which it is a halo.
const ALL: f64 = 0.9;
/// Part of the way from the binder's colour to that of another category at which mixed colours are.
const MIXED: std::ops::Range<f64> = 0.05..0.8;
/// Distance of a mixed colour from the line between the two, as a fraction of the way.
const OFF_LINE: f64 = 0.3;

/// Categories whose labels all hug labels of other categories and whose colours are mixtures of the binder's with that
/// of another category. One that only touches others keeps its place: sections of particles touch over a small part of
/// their outline. Never all categories.
///
/// # Complexity
///
/// Linear in pixels.
pub(crate) fn halo_categories(
    labels: &Array2<u32>,
    profiles: &[Profile],
    categories: &[Category],
    binder: [f64; 3],
) -> Vec<u8> {
    let candidates: Vec<u8> = (0..=u8::MAX)
        .zip(categories)
        .filter(|(_, of)| of.profiles >= FEWEST && is_mixed(of, categories, binder))
        .map(|(number, _)| number)
        .collect();
    if candidates.is_empty() {
        return candidates;
    }
    let hugging = hugging(labels, profiles);
    let is_halo = |category: &u8| {
        let members = || profiles.iter().zip(&hugging).filter(|(p, _)| p.category == *category);
        members().filter(|(_, hugs)| **hugs).count() as f64 >= ALL * members().count() as f64
    };
    candidates.into_iter().filter(is_halo).collect()
}

/// Whether a category's colour is between the binder's and that of a category that differs more from the binder.
fn is_mixed(of: &Category, categories: &[Category], binder: [f64; 3]) -> bool {
    let from_binder = |colour: [f64; 3]| -> [f64; 3] { std::array::from_fn(|c| colour[c] - binder[c]) };
    let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|c| a[c] * b[c]).sum::<f64>();
    let own = from_binder(of.colour);
    categories.iter().any(|other| {
        let whole = from_binder(other.colour);
        let part = dot(own, whole) / dot(whole, whole).max(f64::MIN_POSITIVE);
        let off: [f64; 3] = std::array::from_fn(|c| own[c] - part * whole[c]);
        MIXED.contains(&part) && dot(off, off) <= OFF_LINE.powi(2) * part.powi(2) * dot(whole, whole)
    })
}

/// Whether each profile has a large part of its outline beside profiles of other categories.
fn hugging(labels: &Array2<u32>, profiles: &[Profile]) -> Vec<bool> {
    let ids: Vec<u32> = profiles.iter().map(|p| p.id).collect();
    let index = Index::new(&ids);
    let category = |label: u32| profiles[index.of(label)].category;
    let mut outline = vec![(0_usize, 0_usize); profiles.len()];
    let (height, width) = labels.dim();
    for ((y, x), &label) in labels.indexed_iter().filter(|(_, l)| **l != 0) {
        let around = |reach: usize| {
            let rows = y.saturating_sub(reach)..(y + reach + 1).min(height);
            rows.flat_map(move |j| (x.saturating_sub(reach)..(x + reach + 1).min(width)).map(move |i| labels[[j, i]]))
        };
        if around(1).all(|l| l == label) {
            continue;
        }
        let (all, near) = &mut outline[index.of(label)];
        *all += 1;
        let own = category(label);
        *near += usize::from(around(NEAR).any(|l| l != 0 && l != label && category(l) != own));
    }
    outline
        .iter()
        .map(|&(all, near)| near as f64 >= HUGS * all as f64)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::SegmentOptions;
    use crate::segmentation::Segmentation;
    use image::{Rgb, RgbImage};

    const BINDER: u8 = 200;

    /// Dark squares, and beside each a bar whose colour is between binder and square: one pixel away, or `gap` pixels.
    fn squares_with_bars(gap: usize) -> Segmentation {
        let labels = Array2::from_shape_fn((60, 200), |(y, x)| {
            let (u, v, cell) = (x % 40, y % 30, index(1 + x / 40 + 5 * (y / 30)));
            let inside = |left: usize, right: usize| (left..right).contains(&u) && (4..20).contains(&v);
            match (inside(2, 18), inside(18 + gap, 22 + gap)) {
                (true, _) => cell,
                (_, true) => cell + 100,
                _ => 0,
            }
        });
        let photo = RgbImage::from_fn(200, 60, |x, y| {
            Rgb([match labels[[y as usize, x as usize]] {
                0 => BINDER,
                1..=100 => 40,
                _ => 140,
            }; 3])
        });
        let options = SegmentOptions::default().with_categories(2);
        Segmentation::from_labels(&photo, labels, &options).unwrap()
    }

    fn index(i: usize) -> u32 {
        u32::try_from(i).unwrap()
    }

    /// A category of mixed colour is a halo where it lies along particles, and one of particles where it does not.
    #[test]
    fn bars_along_squares_are_halos() {
        for (gap, halos) in [(1, 1), (8, 0)] {
            let found = squares_with_bars(gap);
            let of = halo_categories(
                &found.labels,
                &found.profiles,
                &found.categories,
                [f64::from(BINDER) / 255.0; 3],
            );
            assert_eq!(of.len(), halos, "gap {gap}");
            assert!(of.iter().all(|c| found.categories[usize::from(*c)].colour[0] > 0.4));
        }
    }
}
