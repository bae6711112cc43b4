//! Label maps of other tools.

use image::{Rgb, RgbImage};
use ndarray::Array2;
use proptest::prelude::*;
use stereology_segment::{SegmentError, SegmentOptions, Segmentation};

fn colours(width: u32, height: u32) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        Rgb([(x * 3) as u8, (y * 5) as u8, ((x + y) % 256) as u8])
    })
}

/// Squares of 6 pixels in a grid of 10, numbered as given.
fn squares(numbers: &[u32]) -> Array2<u32> {
    Array2::from_shape_fn((40, 10 * numbers.len()), |(y, x)| {
        let inside = (2..8).contains(&(x % 10)) && (12..18).contains(&y);
        if inside { numbers[x / 10] } else { 0 }
    })
}

proptest! {
    /// Other numbers, same profiles.
    #[test]
    fn numbers_do_not_matter(numbers in proptest::sample::subsequence((1_u32..2000).collect::<Vec<_>>(), 8).prop_shuffle()) {
        let photo = colours(80, 40);
        let options = SegmentOptions::default();
        let plain = Segmentation::from_labels(&photo, squares(&[1, 2, 3, 4, 5, 6, 7, 8]), &options).unwrap();
        let other = Segmentation::from_labels(&photo, squares(&numbers), &options).unwrap();
        for (number, p) in numbers.iter().zip(&plain.profiles) {
            let q = other.profiles.iter().find(|q| q.id == *number).unwrap();
            prop_assert_eq!((q.x, q.y, q.area, q.colour, q.weight), (p.x, p.y, p.area, p.colour, p.weight));
        }
        prop_assert_eq!(plain.area_fraction, other.area_fraction);
        prop_assert_eq!(plain.number_per_area, other.number_per_area);
    }
}

/// One label with two components is one profile, with a finding; so has the largest number of 8 bits if it has several.
#[test]
fn pieces_and_clipping() {
    let found =
        Segmentation::from_labels(&colours(40, 40), squares(&[3, 255, 3, 255]), &SegmentOptions::default()).unwrap();
    assert_eq!(
        found.profiles.iter().map(|p| (p.id, p.area)).collect::<Vec<_>>(),
        [(3, 72.0), (255, 72.0)]
    );
    let codes: Vec<_> = found.findings.iter().map(|f| f.code).collect();
    assert!(
        codes.contains(&"split-label") && codes.contains(&"clipped-labels"),
        "{codes:?}"
    );
}

/// Maps that cannot be labels are refused.
#[test]
fn refused() {
    let options = SegmentOptions::default();
    let photo = colours(80, 40);
    assert!(matches!(
        Segmentation::from_labels(&photo, Array2::zeros((40, 80)), &options),
        Err(SegmentError::NoLabels)
    ));
    assert!(matches!(
        Segmentation::from_labels(&photo, Array2::ones((80, 40)), &options),
        Err(SegmentError::LabelSize { .. })
    ));
    let classes = squares(&[1, 2, 1, 2, 1, 2, 1, 2]);
    assert!(matches!(
        Segmentation::from_labels(&photo, classes, &options),
        Err(SegmentError::ClassMask { components: 8, .. })
    ));
}

/// Masks of classes are refused however few their components: two particles, each in a rim. Two labels side by side are
/// not such a mask.
#[test]
fn sparse_masks() {
    let options = SegmentOptions::default();
    let rimmed = Array2::from_shape_fn((40, 80), |(y, x)| {
        let from = |c: f64| (x as f64 - c).hypot(y as f64 - 20.0);
        let d = from(20.0).min(from(60.0));
        if d < 10.0 { 1 } else { u32::from(d < 13.0) * 2 }
    });
    let swapped = rimmed.mapv(|l| [0, 2, 1][l as usize]);
    for mask in [rimmed.clone(), swapped] {
        let refused = Segmentation::from_labels(&colours(80, 40), mask, &options);
        assert!(matches!(refused, Err(SegmentError::ClassMask { .. })));
    }
    assert!(Segmentation::from_labels(&colours(20, 40), squares(&[1, 2]), &options).is_ok());
    assert!(Segmentation::from_labels(&colours(20, 40), squares(&[1, 1]), &options).is_ok());
}

/// Small labels are left out, with a finding.
#[test]
fn small_labels() {
    let mut labels = squares(&[1, 2, 3, 4]);
    labels[[1, 1]] = 9;
    let found = Segmentation::from_labels(&colours(40, 40), labels, &SegmentOptions::default()).unwrap();
    assert_eq!((found.profiles.len(), found.labels[[1, 1]]), (4, 0));
    assert!(found.findings.iter().any(|f| f.code == "small-labels"));
}
