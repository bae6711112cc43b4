//! Outlines of the profiles on sections compared with those on the photograph: axis ratios and solidities.

use stereology_metrics::wasserstein;
use stereology_segment::Segmentation;

/// Differences of the outlines on drawn sections from those on the photograph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlineComparison {
    /// Profiles of the photograph whose shape is known: at least 50 pixels, counted by the edge rule.
    pub profiles_photo: usize,
    /// The same of the sections.
    pub profiles_synthetic: usize,
    /// Axis ratios: minor over major axis of the ellipse of equal second moments.
    pub axis_ratio: OutlineDistance,
    /// Solidities: area over that of the convex hull.
    pub solidity: OutlineDistance,
}

/// Distance of the distributions of a quantity of outlines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlineDistance {
    /// Mean on the photograph.
    pub photo: f64,
    /// Mean on the sections.
    pub synthetic: f64,
    /// Wasserstein-1 distance of both distributions.
    pub distance: f64,
    /// Expected distance of two samples of as many profiles of one distribution.
    pub expected: f64,
}

/// Profiles of each side without which distributions are not compared.
const FEWEST: usize = 20;

/// Compares the outlines of `sections` with those of `photo`; `None` with fewer than 20 profiles of known shape on a
/// side.
pub(crate) fn compare_outlines(photo: &Segmentation, sections: &[Segmentation]) -> Option<OutlineComparison> {
    let photo = shapes([photo]);
    let synthetic = shapes(sections);
    if photo.len().min(synthetic.len()) < FEWEST {
        return None;
    }
    Some(OutlineComparison {
        profiles_photo: photo.len(),
        profiles_synthetic: synthetic.len(),
        axis_ratio: OutlineDistance::of(&photo, &synthetic, |shape| shape[0]),
        solidity: OutlineDistance::of(&photo, &synthetic, |shape| shape[1]),
    })
}

/// Axis ratio, solidity and weight of the profiles of known shape.
fn shapes<'a>(of: impl IntoIterator<Item = &'a Segmentation>) -> Vec<[f64; 3]> {
    let profiles = of.into_iter().flat_map(|segmentation| &segmentation.profiles);
    profiles
        .filter(|profile| profile.weight > 0.0)
        .filter_map(|profile| {
            profile
                .shape
                .map(|shape| [shape.axis_ratio, shape.solidity, profile.weight])
        })
        .collect()
}

impl OutlineDistance {
    fn of(photo: &[[f64; 3]], synthetic: &[[f64; 3]], value: impl Fn(&[f64; 3]) -> f64) -> Self {
        let weighted = |of: &[[f64; 3]]| of.iter().map(|shape| (value(shape), shape[2])).collect::<Vec<_>>();
        let (photo, synthetic) = (weighted(photo), weighted(synthetic));
        let mean = |of: &[(f64, f64)]| {
            let weight: f64 = of.iter().map(|(_, weight)| weight).sum();
            of.iter().map(|(value, weight)| value * weight).sum::<f64>() / weight
        };
        Self {
            photo: mean(&photo),
            synthetic: mean(&synthetic),
            distance: wasserstein(&photo, &synthetic),
            expected: expected_distance(&photo, synthetic.len()),
        }
    }
}

/// Expected Wasserstein-1 distance of two samples of the distribution of `sample`: one of as many values, the other of
/// `others`.
///
/// # Formula
///
/// ```text
/// E W₁ = √(2/π) √(1/n + 1/m) ∫ √(F (1 − F)) dx      each F_n(x) − F_m(x) is normal about 0
/// ```
fn expected_distance(sample: &[(f64, f64)], others: usize) -> f64 {
    let mut sample = sample.to_vec();
    sample.sort_by(|a, b| a.0.total_cmp(&b.0));
    let weight: f64 = sample.iter().map(|(_, weight)| weight).sum();
    let (mut below, mut integral) = (0.0, 0.0);
    for pair in sample.windows(2) {
        below += pair[0].1 / weight;
        integral += (below * (1.0 - below)).max(0.0).sqrt() * (pair[1].0 - pair[0].0);
    }
    let counts = 1.0 / sample.len().max(1) as f64 + 1.0 / others.max(1) as f64;
    (2.0 / std::f64::consts::PI * counts).sqrt() * integral
}

#[cfg(test)]
mod tests {
    use super::expected_distance;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use stereology_metrics::wasserstein;

    /// Samples of one distribution have the expected distance on average: of 400 pairs, whose distances vary by less
    /// than half of it, the mean is within 5 standard errors, 12 %.
    #[test]
    fn equal_distributions_have_the_expected_distance() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut sample = |n: usize| -> Vec<(f64, f64)> {
            (0..n)
                .map(|_| (rng.random::<f64>() * rng.random::<f64>(), 1.0))
                .collect()
        };
        let (mut found, mut expected) = (0.0, 0.0);
        for _ in 0..400 {
            let (a, b) = (sample(60), sample(200));
            found += wasserstein(&a, &b);
            expected += expected_distance(&a, b.len());
        }
        assert!((found / expected - 1.0).abs() < 0.12, "{found} {expected}");
    }
}
