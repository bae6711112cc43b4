//! Profiles counted by size on an examined area.

use crate::tiling::Tiling;
use stereology_metrics::{EdgesError, check_edges};

/// Slices with numbers above this are renumbered.
const MOST_SLICES: usize = 1_000_000;

/// Profiles counted in bins (a, b] of their size, on a known area.
///
/// Bins are closed above: a profile exactly as large as the largest particle belongs to the last bin. The density of
/// profiles is singular there, so bins closed below would move the result by up to 1.6 %.
///
/// # Examples
///
/// ```
/// use stereology_unfold::ProfileCounts;
///
/// let counts = ProfileCounts::from_sizes(&[0.2, 0.5, 0.9, 1.0], None, &[0.0, 0.5, 1.0], 8.0)?;
/// assert_eq!(counts.counts(), [2.0, 2.0]);
/// assert_eq!(counts.per_area(), [0.25, 0.25]);
/// # Ok::<(), stereology_unfold::ProfilesError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileCounts {
    edges: Vec<f64>,
    counts: Vec<f64>,
    area: f64,
    profiles: usize,
    dispersion: f64,
    /// Σ π d² / 4 for each bin.
    areas: Vec<f64>,
    /// Counts of each slice.
    slices: Option<Vec<Vec<f64>>>,
    tiles: Option<Tiles>,
    /// Size of the largest profile, if sizes were counted.
    largest: Option<f64>,
}

/// Counts of the tiles of a photograph.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tiles {
    pub(crate) tiling: Tiling,
    /// Counts of a tile at each of its places.
    pub(crate) parts: Vec<Vec<f64>>,
}

/// Why profiles cannot be counted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProfilesError {
    /// There are no profiles.
    #[error(
        "no profiles: unfolding needs at least one (give the profiles of the examined area, or lower the threshold)"
    )]
    None,
    /// The area is not a positive number.
    #[error("the examined area is {0}: it must be positive and finite, in the square of the unit of the sizes")]
    Area(f64),
    /// A size that is not a positive length.
    #[error("profile {index} has size {size}: sizes must be positive and finite")]
    Size {
        /// Index of the profile, from 0.
        index: usize,
        /// Its size.
        size: f64,
    },
    /// A weight that is negative or not finite.
    #[error("profile {index} has weight {weight}: weights must be finite and not negative")]
    Weight {
        /// Index of the profile, from 0.
        index: usize,
        /// Its weight.
        weight: f64,
    },
    /// Weights and sizes differ in number.
    #[error("{weights} weights for {sizes} sizes: give one weight per profile")]
    WeightCount {
        /// Number of weights.
        weights: usize,
        /// Number of sizes.
        sizes: usize,
    },
    /// Points and sizes differ in number.
    #[error("{points} positions for {sizes} sizes: give the position of every profile")]
    PointCount {
        /// Number of points.
        points: usize,
        /// Number of sizes.
        sizes: usize,
    },
    /// Slices and sizes differ in number.
    #[error("{slices} slices for {sizes} sizes: give the slice of every profile")]
    SliceCount {
        /// Number of slices.
        slices: usize,
        /// Number of sizes.
        sizes: usize,
    },
    /// Profiles larger than the last edge: dropping or moving them would shift every bin.
    #[error(
        "{count} profiles are larger than the largest size {largest} (the largest is {size}, profile {index}): raise the maximum size"
    )]
    TooLarge {
        /// Their number.
        count: usize,
        /// The last edge.
        largest: f64,
        /// Size of the largest of them.
        size: f64,
        /// Index of the largest of them, from 0.
        index: usize,
    },
    /// A count that is negative or not finite, or counts and bins that differ in number.
    #[error("{counts} counts for {bins} bins: give one count per bin, finite and not negative")]
    Counts {
        /// Number of counts.
        counts: usize,
        /// Number of bins.
        bins: usize,
    },
    /// The edges do not define bins.
    #[error(transparent)]
    Edges(#[from] EdgesError),
}

impl ProfileCounts {
    /// Counts profile sizes (diameters of the circles of their areas) in the bins between `edges`, on `area`.
    ///
    /// `weights`, one per profile, multiply the count of each profile: Miles-Lantuejoul weights of an edge correction,
    /// or 0 outside a counting frame. Profiles not larger than the first edge are not counted. Complexity: O(`sizes` ×
    /// log `edges`).
    ///
    /// # Errors
    ///
    /// [`ProfilesError`]: no profiles, invalid sizes or weights, sizes beyond the last edge, an invalid area or invalid
    /// edges.
    pub fn from_sizes(sizes: &[f64], weights: Option<&[f64]>, edges: &[f64], area: f64) -> Result<Self, ProfilesError> {
        check_edges(edges)?;
        check_area(area)?;
        if let Some(weights) = weights
            && weights.len() != sizes.len()
        {
            return Err(ProfilesError::WeightCount {
                weights: weights.len(),
                sizes: sizes.len(),
            });
        }
        let weight_of = |index: usize| weights.map_or(1.0, |weights| weights[index]);
        let largest = edges[edges.len() - 1];
        let (mut beyond, mut furthest) = (0, (0, largest));
        for (index, &size) in sizes.iter().enumerate() {
            if !(size.is_finite() && size > 0.0) {
                return Err(ProfilesError::Size { index, size });
            }
            let weight = weight_of(index);
            if !(weight.is_finite() && weight >= 0.0) {
                return Err(ProfilesError::Weight { index, weight });
            }
            if size > largest {
                beyond += 1;
                if size > furthest.1 {
                    furthest = (index, size);
                }
            }
        }
        if beyond > 0 {
            return Err(ProfilesError::TooLarge {
                count: beyond,
                largest,
                size: furthest.1,
                index: furthest.0,
            });
        }
        let mut counts = vec![0.0; edges.len() - 1];
        let mut areas = vec![0.0; edges.len() - 1];
        let (mut profiles, mut squares) = (0, 0.0);
        for (index, &size) in sizes.iter().enumerate() {
            let weight = weight_of(index);
            // The number of edges below the size: bin k holds sizes in (edges[k], edges[k + 1]].
            let below = edges.partition_point(|&edge| edge < size);
            if below == 0 || weight == 0.0 {
                continue;
            }
            counts[below - 1] += weight;
            areas[below - 1] += weight * 0.25 * std::f64::consts::PI * size * size;
            squares += weight * weight;
            profiles += 1;
        }
        let total: f64 = counts.iter().sum();
        if profiles == 0 {
            return Err(ProfilesError::None);
        }
        Ok(Self {
            edges: edges.to_vec(),
            counts,
            area,
            profiles,
            dispersion: squares / total,
            areas,
            slices: None,
            tiles: None,
            largest: sizes.iter().copied().reduce(f64::max),
        })
    }

    /// [`from_sizes`](Self::from_sizes) with the slice of each profile, so that slices can be resampled
    /// ([`Resampling::Slices`](crate::Resampling)).
    ///
    /// `area` is that of all slices together, and all slices are assumed to have the same area. Slices are numbered
    /// from 0 to the largest number that occurs, so a slice without profiles counts only if its number is below that.
    ///
    /// # Errors
    ///
    /// As [`from_sizes`](Self::from_sizes), and [`ProfilesError::SliceCount`].
    ///
    /// ```
    /// use stereology_unfold::ProfileCounts;
    /// let counts = ProfileCounts::from_slices(&[0.2, 0.9, 0.4], None, &[0, 2, 2], &[0.0, 0.5, 1.0], 3.0)?;
    /// assert_eq!(counts.slices(), Some(3));
    /// # Ok::<(), stereology_unfold::ProfilesError>(())
    /// ```
    pub fn from_slices(
        sizes: &[f64],
        weights: Option<&[f64]>,
        slices: &[usize],
        edges: &[f64],
        area: f64,
    ) -> Result<Self, ProfilesError> {
        let mut whole = Self::from_sizes(sizes, weights, edges, area)?;
        if slices.len() != sizes.len() {
            return Err(ProfilesError::SliceCount {
                slices: slices.len(),
                sizes: sizes.len(),
            });
        }
        // Numbers need not be consecutive: beyond a million, slices without profiles are not allocated.
        let most = slices.iter().max().map_or(0, |&last| last);
        let numbers: Option<Vec<usize>> = (most >= MOST_SLICES).then(|| {
            let mut numbers = slices.to_vec();
            numbers.sort_unstable();
            numbers.dedup();
            numbers
        });
        let place = |slice: usize| match &numbers {
            None => slice,
            Some(numbers) => numbers.partition_point(|&n| n < slice),
        };
        let count = if slices.is_empty() { 0 } else { place(most) + 1 };
        let mut by_slice = vec![vec![0.0; edges.len() - 1]; count];
        for (index, (&size, &slice)) in sizes.iter().zip(slices).enumerate() {
            let below = edges.partition_point(|&edge| edge < size);
            if below > 0 {
                by_slice[place(slice)][below - 1] += weights.map_or(1.0, |weights| weights[index]);
            }
        }
        whole.slices = Some(by_slice);
        Ok(whole)
    }

    /// [`from_sizes`](Self::from_sizes) with the position of each profile, so that tiles of the photograph can be
    /// resampled ([`Resampling::Blocks`](crate::Resampling)).
    ///
    /// Parts of the profiles of a photograph share the tiling of the whole.
    ///
    /// # Errors
    ///
    /// As [`from_sizes`](Self::from_sizes), and [`ProfilesError::PointCount`].
    ///
    /// ```
    /// use stereology_unfold::{ProfileCounts, Tiling};
    /// let points = [[1.0, 2.0], [7.0, 4.0], [3.0, 9.0]];
    /// let tiling = Tiling::new(&points, None, 2.0).ok_or("no area")?;
    /// let counts = ProfileCounts::from_tiles(&[0.2, 0.9, 0.4], None, &points, &tiling, &[0.0, 0.5, 1.0], 100.0)?;
    /// assert_eq!(counts.counts(), [2.0, 1.0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn from_tiles(
        sizes: &[f64],
        weights: Option<&[f64]>,
        points: &[[f64; 2]],
        tiling: &Tiling,
        edges: &[f64],
        area: f64,
    ) -> Result<Self, ProfilesError> {
        let mut whole = Self::from_sizes(sizes, weights, edges, area)?;
        if points.len() != sizes.len() {
            return Err(ProfilesError::PointCount {
                points: points.len(),
                sizes: sizes.len(),
            });
        }
        let mut cells = vec![vec![0.0; edges.len() - 1]; tiling.cells()];
        for (index, (&size, point)) in sizes.iter().zip(points).enumerate() {
            let below = edges.partition_point(|&edge| edge < size);
            if below > 0 {
                cells[tiling.cell(point)][below - 1] += weights.map_or(1.0, |weights| weights[index]);
            }
        }
        whole.tiles = Some(Tiles {
            tiling: *tiling,
            parts: tiling.parts(&cells),
        });
        Ok(whole)
    }

    /// Known counts of each bin, whole numbers or expectations.
    ///
    /// # Errors
    ///
    /// [`ProfilesError`]: counts that are negative, not finite, not one per bin, or all zero; an invalid area or
    /// invalid edges.
    // A count of profiles is far below 2^53 and not negative.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    pub fn from_counts(counts: &[f64], edges: &[f64], area: f64) -> Result<Self, ProfilesError> {
        check_edges(edges)?;
        check_area(area)?;
        let bad = counts.iter().any(|count| !(count.is_finite() && *count >= 0.0));
        if bad || counts.len() + 1 != edges.len() {
            return Err(ProfilesError::Counts {
                counts: counts.len(),
                bins: edges.len() - 1,
            });
        }
        let total: f64 = counts.iter().sum();
        if total <= 0.0 {
            return Err(ProfilesError::None);
        }
        Ok(Self {
            edges: edges.to_vec(),
            counts: counts.to_vec(),
            area,
            profiles: total.round() as usize,
            dispersion: 1.0,
            areas: edges
                .windows(2)
                .zip(counts)
                .map(|(bin, count)| count * mean_profile_area(bin))
                .collect(),
            slices: None,
            tiles: None,
            largest: None,
        })
    }

    /// The same bins and area without any profile: for a category that has none.
    ///
    /// ```
    /// use stereology_unfold::ProfileCounts;
    /// let counts = ProfileCounts::from_sizes(&[0.2, 0.9], None, &[0.0, 0.5, 1.0], 5.0)?;
    /// assert_eq!(counts.without_profiles().counts(), [0.0, 0.0]);
    /// # Ok::<(), stereology_unfold::ProfilesError>(())
    /// ```
    #[must_use]
    pub fn without_profiles(&self) -> Self {
        let none = vec![0.0; self.counts.len()];
        Self {
            counts: none.clone(),
            areas: none,
            profiles: 0,
            slices: None,
            tiles: None,
            ..self.clone()
        }
    }

    /// The edges of the bins, one more than there are bins.
    #[must_use]
    pub fn edges(&self) -> &[f64] {
        &self.edges
    }

    /// Sum of weights in each bin; without weights, the number of profiles.
    #[must_use]
    pub fn counts(&self) -> &[f64] {
        &self.counts
    }

    /// Profiles per unit area in each bin, N_A.
    #[must_use]
    pub fn per_area(&self) -> Vec<f64> {
        self.counts.iter().map(|count| count / self.area).collect()
    }

    /// Fraction of the area inside the profiles of each bin; their sum is A_A. Computed from sizes; for known counts,
    /// sizes are assumed to be uniformly distributed over each bin.
    #[must_use]
    pub fn area_fractions(&self) -> Vec<f64> {
        self.areas.iter().map(|area| area / self.area).collect()
    }

    /// Number of slices, if the slice of each profile is known.
    #[must_use]
    pub fn slices(&self) -> Option<usize> {
        self.slices.as_ref().map(Vec::len)
    }

    /// Increases the number of slices to at least this many; the additional slices have no profiles. For a subset of
    /// the profiles that has none on the last slices.
    ///
    /// ```
    /// use stereology_unfold::ProfileCounts;
    /// let counts = ProfileCounts::from_slices(&[0.2, 0.9], None, &[0, 2], &[0.0, 0.5, 1.0], 5.0)?.with_slices(5);
    /// assert_eq!(counts.slices(), Some(5));
    /// # Ok::<(), stereology_unfold::ProfilesError>(())
    /// ```
    #[must_use]
    pub fn with_slices(mut self, slices: usize) -> Self {
        let bins = self.counts.len();
        if let Some(by_slice) = &mut self.slices
            && by_slice.len() < slices
            && slices <= MOST_SLICES
        {
            by_slice.resize(slices, vec![0.0; bins]);
        }
        self
    }

    pub(crate) fn tiles(&self) -> Option<&Tiles> {
        self.tiles.as_ref()
    }

    /// Size of the largest profile, if it is known.
    pub(crate) fn largest(&self) -> Option<f64> {
        self.largest
    }

    /// Counts of each slice.
    pub(crate) fn by_slice(&self) -> Option<&[Vec<f64>]> {
        self.slices.as_deref()
    }

    /// The examined area.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Number of profiles counted, independent of their weights.
    #[must_use]
    pub fn profiles(&self) -> usize {
        self.profiles
    }

    /// Variance of a weighted count divided by its mean, Σ w² / Σ w; 1 without weights.
    #[must_use]
    pub fn dispersion(&self) -> f64 {
        self.dispersion
    }
}

/// Mean area of profiles with sizes uniformly distributed over a bin.
pub(crate) fn mean_profile_area(bin: &[f64]) -> f64 {
    let (a, b) = (bin[0], bin[1]);
    std::f64::consts::PI / 12.0 * (a * a + a * b + b * b)
}

fn check_area(area: f64) -> Result<(), ProfilesError> {
    if area.is_finite() && area > 0.0 {
        Ok(())
    } else {
        Err(ProfilesError::Area(area))
    }
}

#[cfg(test)]
mod tests {
    use super::{ProfileCounts, ProfilesError};

    const EDGES: [f64; 3] = [0.0, 0.5, 1.0];

    #[test]
    fn bins_are_closed_above() {
        let counts = ProfileCounts::from_sizes(&[0.5, 0.500_000_1, 1.0], None, &EDGES, 1.0).unwrap();
        assert_eq!(counts.counts(), [1.0, 2.0]);
    }

    #[test]
    fn weights_multiply_counts_and_spread_them() {
        let counts = ProfileCounts::from_sizes(&[0.1, 0.2, 0.9], Some(&[2.0, 0.0, 1.0]), &EDGES, 1.0).unwrap();
        assert_eq!(counts.counts(), [2.0, 1.0]);
        assert_eq!((counts.profiles(), counts.dispersion()), (2, 5.0 / 3.0));
    }

    #[test]
    fn each_bad_profile_has_its_own_error() {
        let count = |sizes: &[f64], area: f64| ProfileCounts::from_sizes(sizes, None, &EDGES, area).unwrap_err();
        assert_eq!(count(&[], 1.0), ProfilesError::None);
        assert!(matches!(
            count(&[0.1, f64::NAN], 1.0),
            ProfilesError::Size { index: 1, .. }
        ));
        assert_eq!(count(&[0.1, -0.1], 1.0), ProfilesError::Size { index: 1, size: -0.1 });
        assert_eq!(count(&[0.0], 1.0), ProfilesError::Size { index: 0, size: 0.0 });
        assert_eq!(
            count(&[0.1, 1.5, 2.5], 1.0),
            ProfilesError::TooLarge {
                count: 2,
                largest: 1.0,
                size: 2.5,
                index: 2
            }
        );
        for area in [0.0, -3.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(count(&[0.1], area), ProfilesError::Area(_)));
        }
        assert!(matches!(
            ProfileCounts::from_sizes(&[0.1], Some(&[-1.0]), &EDGES, 1.0),
            Err(ProfilesError::Weight { index: 0, .. })
        ));
        assert!(ProfileCounts::from_sizes(&[0.1], Some(&[]), &EDGES, 1.0).is_err());
        assert!(ProfileCounts::from_sizes(&[0.1], None, &[0.0], 1.0).is_err());
        assert!(ProfileCounts::from_counts(&[1.0], &EDGES, 1.0).is_err());
        assert_eq!(
            ProfileCounts::from_counts(&[0.0, 0.0], &EDGES, 1.0),
            Err(ProfilesError::None)
        );
    }
}
