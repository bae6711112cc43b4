//! Colour categories of profiles.

use crate::{
    kmeans::{Clusters, kmeans, silhouette},
    lab::lab,
    profile::Profile,
};

/// Profiles of like colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Category {
    /// Mean colour of its profiles, each weighted by its area, sRGB / 255.
    pub colour: [f64; 3],
    /// Profiles in it.
    pub profiles: usize,
    /// Their area, pixels.
    pub area: f64,
}

/// Silhouette below which colours form no groups.
const GROUPED: f64 = 0.5;
/// Most categories looked for.
const MOST: usize = 8;

/// Groups profiles by mean colour, in Lab: k-means for a number given, else for the number from 2 to 8 with the best silhouette, or one if the best is below 0.5. Sets [`Profile::category`] and returns the
/// categories, most profiles first.
///
/// # Complexity
///
/// Profiles × categories × rounds.
pub fn categorise(profiles: &mut [Profile], count: Option<usize>, seed: u64) -> Vec<Category> {
    let colours: Vec<[f64; 3]> = profiles
        .iter()
        .map(|p| lab(p.colour.map(|c| c as f32)).map(f64::from))
        .collect();
    let clusters = match count {
        Some(k) => kmeans(&colours, k.min(255), seed),
        None => best_by_silhouette(&colours, seed),
    };
    let mut sums = vec![([0.0; 3], 0.0, 0_usize); clusters.centres.len()];
    for (p, &group) in profiles.iter_mut().zip(&clusters.assignment) {
        p.category = group as u8; // at most 255 groups
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
