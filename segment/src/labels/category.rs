//! Colour categories of profiles.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_imaging::lab;
use stereology_metrics::{KruskalWallis, kruskal_wallis};

use crate::conversions::single;
use crate::ground::kmeans::{Clusters, kmeans, silhouette};
use crate::labels::profile::Profile;
use crate::labels::separated::separated_groups;
use crate::options::CategoryCount;

/// Profiles of similar colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Category {
    /// Mean colour of its profiles, each weighted by its area, sRGB / 255.
    pub colour: [f64; 3],
    /// Profiles in it.
    pub profiles: usize,
    /// Their area, pixels.
    pub area: f64,
}

/// Mean silhouette below which colours form no groups.
const GROUPED: f64 = 0.5;
/// Most categories looked for.
const MOST: usize = 8;

/// Groups profiles by mean colour in CIE Lab, where distances are perceptual: k-means, as in the paper, for a given or
/// chosen number of groups. Sets [`Profile::category`] and returns the categories, most profiles first.
///
/// # Complexity
///
/// Profiles × categories × iterations.
///
/// # References
///
/// Jagnow, Dorsey & Rushmeier 2004, section 5.2.
///
/// # Examples
///
/// ```
/// use stereology_segment::{CategoryCount, SegmentOptions, Segmentation, categorise};
///
/// let photo = image::RgbImage::from_fn(60, 20, |x, _| image::Rgb([if x < 30 { 30 } else { 220 }; 3]));
/// let labels = ndarray::Array2::from_shape_fn((20, 60), |(y, x)| if x % 10 > 5 && y > 5 { 1 + x as u32 / 10 } else { 0 });
/// let mut profiles = Segmentation::from_labels(&photo, labels, &SegmentOptions::default())?.profiles;
/// let categories = categorise(&mut profiles, CategoryCount::Given(2), 0);
/// assert_eq!([categories[0].profiles, categories[1].profiles], [3, 3]);
/// assert_ne!(profiles[0].category, profiles[5].category);
/// # Ok::<(), stereology_segment::SegmentError>(())
/// ```
pub fn categorise(profiles: &mut [Profile], count: CategoryCount, seed: u64) -> Vec<Category> {
    let colours: Vec<[f64; 3]> = profiles
        .iter()
        .map(|p| lab(p.colour.map(single)).map(f64::from))
        .collect();
    let clusters = match count {
        CategoryCount::Given(k) => kmeans(&colours, k.min(255), seed),
        CategoryCount::Separated => separated_groups(&colours, seed),
        CategoryCount::Silhouette => best_by_silhouette(&colours, seed),
        CategoryCount::Gap => kmeans(&colours, best_by_gap(&colours, seed), seed),
    };
    let mut sums = vec![([0.0; 3], 0.0, 0_usize); clusters.centres.len()];
    for (p, &group) in profiles.iter_mut().zip(&clusters.assignment) {
        p.category = u8::try_from(group).unwrap_or(u8::MAX); // at most 255 groups
        let s = &mut sums[group];
        (0..3).for_each(|c| s.0[c] += p.colour[c] * p.area);
        s.1 += p.area;
        s.2 += 1;
    }
    sums.into_iter()
        .map(|(colour, area, profiles)| Category {
            colour: colour.map(|c| c / area),
            profiles,
            area,
        })
        .collect()
}

fn best_by_silhouette(colours: &[[f64; 3]], seed: u64) -> Clusters {
    let mut best = (GROUPED, kmeans(colours, 1, seed));
    for k in 2..=MOST.min(colours.len().saturating_sub(1)) {
        let clusters = kmeans(colours, k, seed);
        let score = silhouette(colours, &clusters.assignment);
        if score > best.0 {
            best = (score, clusters);
        }
    }
    best.1
}

/// Reference sets of uniformly distributed colours.
const REFERENCES: u64 = 10;
/// Most colours used by the gap statistic.
const GAP_SAMPLE: usize = 400;

/// Number of groups by the gap statistic: how much smaller the inertia of k groups of the colours is than that of k
/// groups of as many colours distributed uniformly over their box.
fn best_by_gap(colours: &[[f64; 3]], seed: u64) -> usize {
    let step = colours.len().div_ceil(GAP_SAMPLE).max(1);
    let points: Vec<[f64; 3]> = colours.iter().copied().step_by(step).collect();
    let bounds = points
        .iter()
        .fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], p| {
            [
                std::array::from_fn(|c| low[c].min(p[c])),
                std::array::from_fn(|c| high[c].max(p[c])),
            ]
        });
    let references: Vec<Vec<[f64; 3]>> = (0..REFERENCES)
        .map(|stream| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(1000 + stream);
            let [low, high] = bounds;
            let draw = |_: &[f64; 3]| std::array::from_fn(|c| low[c] + (high[c] - low[c]) * rng.random::<f64>());
            points.iter().map(draw).collect()
        })
        .collect();
    let spread = |points: &[[f64; 3]], k: usize| kmeans(points, k, seed).inertia.max(1e-12).ln();
    let gap = |k: usize| {
        let logs: Vec<f64> = references.iter().map(|r| spread(r, k)).collect();
        let n = logs.len() as f64;
        let mean = logs.iter().sum::<f64>() / n;
        let variance = logs.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / n;
        (mean - spread(&points, k), (variance * (1.0 + 1.0 / n)).sqrt())
    };
    let mut here = gap(1);
    for k in 1..MOST.min(points.len().max(1)) {
        let next = gap(k + 1);
        if here.0 >= next.0 - next.1 {
            return k;
        }
        here = next;
    }
    MOST.min(points.len().max(1))
}

/// Tests whether the sizes of whole profiles differ between categories ([`kruskal_wallis`]); `None` if fewer than two
/// categories have five whole profiles or more. A small p-value means that size and colour are associated, so that
/// categories should be unfolded separately.
///
/// # Examples
///
/// ```
/// use stereology_segment::{SegmentOptions, Segmentation};
///
/// // Small dark squares, large pale ones.
/// let photo = image::RgbImage::from_fn(320, 40, |x, _| image::Rgb([if x / 20 % 2 == 0 { 30 } else { 220 }; 3]));
/// let labels = ndarray::Array2::from_shape_fn((40, 320), |(y, x)| {
///     let side = if x / 20 % 2 == 0 { 6 } else { 10 + x / 40 };
///     if x % 20 < side && (2..2 + side).contains(&y) && x % 20 > 0 { 1 + x as u32 / 20 } else { 0 }
/// });
/// let found = Segmentation::from_labels(&photo, labels, &SegmentOptions::default().with_categories(2))?;
/// assert!(found.size_by_category.is_some_and(|test| test.p_value < 0.01));
/// # Ok::<(), stereology_segment::SegmentError>(())
/// ```
#[must_use]
pub fn size_by_category(profiles: &[Profile]) -> Option<KruskalWallis> {
    let mut groups: Vec<Vec<f64>> = Vec::new();
    for profile in profiles.iter().filter(|p| !p.touches_edge) {
        let category = usize::from(profile.category);
        groups.resize_with(groups.len().max(category + 1), Vec::new);
        groups[category].push(profile.size);
    }
    kruskal_wallis(&groups)
}
