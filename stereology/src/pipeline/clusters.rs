//! Clustered profiles: found by their positions on a photograph, or by their number on several slices; and what is
//! resampled then.

use crate::pipeline::MeasuredProfiles;
use stereology_metrics::Finding;
use stereology_unfold::{Bootstrap, Clustering, Resampling, Tiling, clustering, clustering_of_slices};

/// Clustering of the counted profiles, and what the bootstrap resamples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clusters {
    /// `None` if it could not be judged: few profiles, or no positions and one slice.
    pub clustering: Option<Clustering>,
    /// What the bootstrap resamples; never [`Resampling::Auto`]. `None` without a bootstrap.
    pub resampling: Option<Resampling>,
    /// The tiles of [`Resampling::Blocks`].
    pub(crate) tiling: Option<Tiling>,
}

/// Intervals contain the clustering below this p-value. Undetected clusters make intervals much too narrow; without
/// clusters one interval in ten becomes slightly too wide.
const USED: f64 = 0.1;
/// A finding is reported below this p-value.
const REPORTED: f64 = 0.01;

impl Clusters {
    /// Clustering of the profiles at `counted`.
    pub(crate) fn of(profiles: &MeasuredProfiles, counted: &[usize], bootstrap: Option<&Bootstrap>) -> Self {
        let slices = number_of_slices(profiles);
        let points: Vec<[f64; 2]> = if profiles.positions.len() == profiles.sizes.len() && slices < 2 {
            counted.iter().map(|&i| profiles.positions[i]).collect()
        } else {
            Vec::new()
        };
        let weights: Vec<f64> = counted.iter().map(|&i| profiles.weights[i]).collect();
        let found = if slices < 2 {
            let sizes: Vec<f64> = counted.iter().map(|&i| profiles.sizes[i]).collect();
            clustering(&points, &sizes)
        } else {
            clustering_of_slices(&on_slices(profiles, counted, slices))
        };
        let is_used = found.is_some_and(|of| of.p_value < USED);
        // The dispersion is that of clusters, whether there are any or not.
        let found = found.map(|of| Clustering {
            dispersion: if is_used { of.dispersion } else { 1.0 },
            ..of
        });
        let resampling = bootstrap.map(|of| match of.resampling {
            Resampling::Auto if is_used && slices >= 2 => Resampling::Slices,
            Resampling::Auto if is_used => Resampling::Blocks,
            Resampling::Auto => Resampling::Counts,
            given => given,
        });
        let dispersion = found.map_or(1.0, |of| of.dispersion);
        let tiling = (resampling == Some(Resampling::Blocks))
            .then(|| Tiling::new(&points, Some(&weights), dispersion))
            .flatten();
        Self {
            clustering: found,
            resampling,
            tiling,
        }
    }

    /// `clustered`, if they are.
    pub(crate) fn finding(&self) -> Option<Finding> {
        let of = self.clustering.filter(|of| of.p_value < REPORTED)?;
        let done = match self.resampling {
            None => "intervals, which were not requested, would be wider than those of Poisson counts".to_owned(),
            Some(Resampling::Counts) => format!(
                "the intervals are those of Poisson counts as requested, too narrow by a factor of about {:.1}",
                of.dispersion.sqrt()
            ),
            Some(Resampling::Slices) => "the intervals are from resampled slices".to_owned(),
            Some(_) => format!(
                "the intervals are from {} resampled tiles of the photograph",
                self.tiling.map_or(0, |tiling| tiling.tiles())
            ),
        };
        Some(Finding::new(
            "clustered",
            format!(
                "the profiles are clustered (p = {:.1e}): their number varies {:.1} times as much as that of independent profiles; {done}",
                of.p_value, of.dispersion
            ),
        ))
    }
}

/// One more than the largest number of a slice; 0 if slices are not known.
fn number_of_slices(profiles: &MeasuredProfiles) -> usize {
    profiles.slices.iter().max().map_or(0, |last| last + 1)
}

/// The number of profiles on each slice, in profiles of mean weight. Numbers that are not consecutive count as slices
/// without profiles, up to as many as there are profiles.
fn on_slices(profiles: &MeasuredProfiles, counted: &[usize], slices: usize) -> Vec<f64> {
    let mut counts = vec![0.0; slices.min(profiles.sizes.len())];
    let (mut sum, mut squares) = (0.0, 0.0);
    for &i in counted {
        if let Some(count) = counts.get_mut(profiles.slices[i]) {
            *count += profiles.weights[i];
        }
        sum += profiles.weights[i];
        squares += profiles.weights[i].powi(2);
    }
    counts.iter().map(|count| count * sum / squares).collect()
}
