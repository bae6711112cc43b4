//! Bins of particle sizes, (a, b], and how large the particles in them are.

use stereology_metrics::{EdgesError, check_edges};

/// Reported bins that are not made of whole bins.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReportedEdgesError {
    /// The edges bound no bins.
    #[error(transparent)]
    Edges(#[from] EdgesError),
    /// A reported edge that is not among the edges of the bins.
    #[error("the reported edge {value} is not an edge of the bins: every reported bin must consist of whole bins")]
    NotAnEdge {
        /// The edge.
        value: f64,
    },
}

/// Edges of `bins` equal bins of (0, `largest`], the paper's.
///
/// ```
/// assert_eq!(stereology_unfold::equal_edges(2.0, 4), [0.0, 0.5, 1.0, 1.5, 2.0]);
/// ```
#[must_use]
pub fn equal_edges(largest: f64, bins: usize) -> Vec<f64> {
    (0..=bins).map(|k| largest * (k as f64 / bins as f64)).collect()
}

/// Edges of `bins` bins of (`smallest`, `largest`] that grow by a constant ratio, after a first bin (0, `smallest`].
///
/// ```
/// assert_eq!(stereology_unfold::geometric_edges(1.0, 16.0, 2), [0.0, 1.0, 4.0, 16.0]);
/// ```
#[must_use]
pub fn geometric_edges(smallest: f64, largest: f64, bins: usize) -> Vec<f64> {
    let step = |k: usize| match k {
        0 => smallest,
        _ if k == bins => largest,
        _ => smallest * (largest / smallest).powf(k as f64 / bins as f64),
    };
    std::iter::once(0.0).chain((0..=bins).map(step)).collect()
}

/// Edges that grow by half a φ: sizes 2^(k/2) times the unit, Krumbein's scale (φ = −log₂ of the size in millimetres),
/// after a first bin (0, a].
///
/// The edges are those of the scale itself, whatever the sizes; the last is the first at or above `largest`, the first
/// at or below `smallest`.
///
/// ```
/// let edges = stereology_unfold::phi_edges(0.3, 1.0, 1.0);
/// assert_eq!(edges, [0.0, 0.25, 0.5, 1.0]);
/// ```
#[must_use]
pub fn phi_edges(smallest: f64, largest: f64, step: f64) -> Vec<f64> {
    let lengths = smallest > 0.0 && smallest.is_finite() && largest > 0.0 && largest.is_finite();
    if !(lengths && step > 0.0 && (largest / smallest).log2().abs() < 1000.0 * step) {
        return vec![0.0, largest];
    }
    let from = (smallest.log2() / step + 1e-9).floor();
    let to = (largest.max(smallest).log2() / step - 1e-9).ceil().max(from + 1.0);
    let classes = (0..).map(|k| from + f64::from(k)).take_while(|k| *k <= to);
    std::iter::once(0.0).chain(classes.map(|k| (k * step).exp2())).collect()
}

/// How many equal bins of (0, `largest`] so many profiles bear: the most, up to `most`, such that every bin that has
/// profiles has five or more and that there are no more than 2 ∛n (Rice's rule).
///
/// ```
/// let sizes: Vec<f64> = (1..=1000).map(|k| f64::from(k) / 1000.0).collect();
/// assert_eq!(stereology_unfold::automatic_bins(&sizes, 1.0, 50), 20);
/// assert_eq!(stereology_unfold::automatic_bins(&[0.5, 0.7], 1.0, 50), 1);
/// ```
#[must_use]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A small count, not negative.
pub fn automatic_bins(sizes: &[f64], largest: f64, most: usize) -> usize {
    let rice = (2.0 * (sizes.len() as f64).cbrt() + 1e-9) as usize;
    let few = |bins: usize| {
        let mut counts = vec![0_usize; bins];
        for size in sizes {
            let bin = ((size / largest * bins as f64).ceil() as usize).clamp(1, bins);
            counts[bin - 1] += 1;
        }
        counts.iter().any(|&count| (1..5).contains(&count))
    };
    (1..=rice.min(most)).rev().find(|&bins| !few(bins)).unwrap_or(1)
}

/// Edges that divide each bin evenly so that there are at least `bins` in all, with an edge at `threshold` if it falls
/// inside.
///
/// ```
/// assert_eq!(stereology_unfold::divided_edges(&[0.0, 1.0, 2.0], 4, 0.25), [0.0, 0.25, 0.5, 1.0, 1.5, 2.0]);
/// ```
#[must_use]
pub fn divided_edges(edges: &[f64], bins: usize, threshold: f64) -> Vec<f64> {
    let parts = bins.div_ceil(edges.len().saturating_sub(1).max(1)).max(1);
    let mut divided: Vec<f64> = edges.first().copied().into_iter().collect();
    for bin in edges.windows(2) {
        divided.extend((1..parts).map(|k| bin[0] + (bin[1] - bin[0]) * (k as f64 / parts as f64)));
        divided.push(bin[1]);
    }
    let (first, last) = (divided[0], divided[divided.len() - 1]);
    if threshold > first && threshold < last {
        divided.push(threshold);
        divided.sort_by(f64::total_cmp);
        divided.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * last);
    }
    divided
}

/// Bins of particle sizes, how the sizes lie in them, and the bins results are reported in.
///
/// The sizes must be those the kernel was made for: [`SizeBins::upper_edge`] with an upper-edge kernel,
/// [`SizeBins::integrated`] with a bin-integrated one. A smooth estimate wants finer bins than are reported:
/// [`SizeBins::reported_in`].
///
/// ```
/// use stereology_unfold::{SizeBins, divided_edges, equal_edges};
/// let edges = equal_edges(1.0, 10);
/// let bins = SizeBins::integrated(&divided_edges(&edges, 40, 0.0))?.reported_in(&edges)?;
/// assert_eq!((bins.len(), bins.reported_edges().len()), (40, 11));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SizeBins {
    edges: Vec<f64>,
    reported: Vec<f64>,
    spread: bool,
    mean: Vec<f64>,
    mean_cube: Vec<f64>,
}

impl SizeBins {
    /// All particles of a bin (a, b] have size b, as in the paper.
    ///
    /// # Errors
    ///
    /// [`EdgesError`] if edges do not increase, are negative or not finite, or are fewer than two.
    pub fn upper_edge(edges: &[f64]) -> Result<Self, EdgesError> {
        check_edges(edges)?;
        let upper = &edges[1..];
        Ok(Self {
            edges: edges.to_vec(),
            reported: edges.to_vec(),
            spread: false,
            mean: upper.to_vec(),
            mean_cube: upper.iter().map(|b| b.powi(3)).collect(),
        })
    }

    /// The particles of a bin (a, b] have sizes spread evenly over it: ⟨D⟩ = (a + b) / 2, ⟨D³⟩ = (a + b)(a² + b²) / 4.
    ///
    /// # Errors
    ///
    /// As [`upper_edge`](Self::upper_edge).
    pub fn integrated(edges: &[f64]) -> Result<Self, EdgesError> {
        check_edges(edges)?;
        let bins = || edges.windows(2).map(|bin| (bin[0], bin[1]));
        Ok(Self {
            edges: edges.to_vec(),
            reported: edges.to_vec(),
            spread: true,
            mean: bins().map(|(a, b)| 0.5 * (a + b)).collect(),
            mean_cube: bins().map(|(a, b)| 0.25 * (a + b) * (a * a + b * b)).collect(),
        })
    }

    /// The same bins, several of them summed to each bin that is reported. Bins above the last reported edge belong to
    /// the last reported bin: the largest particles may be larger than the largest profile.
    ///
    /// # Errors
    ///
    /// [`ReportedEdgesError`] if the edges bound no bins or are not among these, or the first is not the first of
    /// these.
    pub fn reported_in(mut self, reported: &[f64]) -> Result<Self, ReportedEdgesError> {
        check_edges(reported)?;
        let known = |value: f64| {
            self.edges
                .iter()
                .any(|edge| (edge - value).abs() <= 1e-9 * self.largest())
        };
        if let Some(&value) = reported.iter().find(|value| !known(**value)) {
            return Err(ReportedEdgesError::NotAnEdge { value });
        }
        if (reported[0] - self.edges[0]).abs() > 1e-9 * self.largest() {
            return Err(ReportedEdgesError::NotAnEdge { value: self.edges[0] });
        }
        self.reported = reported.to_vec();
        Ok(self)
    }

    fn largest(&self) -> f64 {
        self.edges[self.edges.len() - 1]
    }

    /// Edges of the bins that are reported.
    #[must_use]
    pub fn reported_edges(&self) -> &[f64] {
        &self.reported
    }

    /// Which reported bin each bin belongs to.
    pub(crate) fn groups(&self) -> Vec<usize> {
        let middle = |bin: &[f64]| 0.5 * (bin[0] + bin[1]);
        self.edges
            .windows(2)
            .map(|bin| self.reported.partition_point(|&edge| edge < middle(bin)) - 1)
            .map(|group| group.min(self.reported.len() - 2))
            .collect()
    }

    /// Whether sizes are spread over each bin, not all at its upper edge.
    #[must_use]
    pub fn is_spread(&self) -> bool {
        self.spread
    }

    /// The edges, one more than bins.
    #[must_use]
    pub fn edges(&self) -> &[f64] {
        &self.edges
    }

    /// Mean size of the particles of each bin.
    #[must_use]
    pub fn mean_sizes(&self) -> &[f64] {
        &self.mean
    }

    /// Mean cubed size of the particles of each bin: times the volume of the body at size 1, the mean volume.
    #[must_use]
    pub fn mean_cubes(&self) -> &[f64] {
        &self.mean_cube
    }

    /// Number of bins.
    #[must_use]
    pub fn len(&self) -> usize {
        self.mean.len()
    }

    /// Never: there is at least one bin.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.mean.is_empty()
    }
}
