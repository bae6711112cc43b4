//! Bins of particle sizes, (a, b], and how large the particles in them are.

/// Edges of bins must be finite, not negative and increasing, two or more.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EdgesError {
    /// Fewer than two edges.
    #[error("bins need at least two edges, {0} given")]
    TooFew(usize),
    /// An edge that is no length.
    #[error("edge {index} is {value}: edges must be finite and not negative")]
    NotALength {
        /// Which, from 0.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// An edge that is not above the one before.
    #[error("edge {index} is not larger than the one before it: edges must increase")]
    NotIncreasing {
        /// Which, from 0.
        index: usize,
    },
}

pub(crate) fn check_edges(edges: &[f64]) -> Result<(), EdgesError> {
    if edges.len() < 2 {
        return Err(EdgesError::TooFew(edges.len()));
    }
    for (index, &value) in edges.iter().enumerate() {
        if !(value.is_finite() && value >= 0.0) {
            return Err(EdgesError::NotALength { index, value });
        }
        if index > 0 && value <= edges[index - 1] {
            return Err(EdgesError::NotIncreasing { index });
        }
    }
    Ok(())
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

/// Bins of particle sizes with the mean size and mean cubed size of the particles in each.
///
/// The sizes must be those the kernel was made for: [`SizeBins::upper_edge`] with an upper-edge kernel, [`SizeBins::integrated`] with a
/// bin-integrated one.
#[derive(Clone, Debug, PartialEq)]
pub struct SizeBins {
    edges: Vec<f64>,
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
            mean: bins().map(|(a, b)| 0.5 * (a + b)).collect(),
            mean_cube: bins().map(|(a, b)| 0.25 * (a + b) * (a * a + b * b)).collect(),
        })
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
