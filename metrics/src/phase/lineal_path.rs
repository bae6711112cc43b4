//! Straight lines through a phase: lineal path and chord lengths.

use ndarray::{ArrayView2, Axis};

/// Probability that a segment of `z` pixels' length, at a random place along an axis, lies wholly in the phase: entry
/// z, 0 to `reach`; entry 0 is the phase's fraction.
///
/// A segment of length z covers the centres of z + 1 pixels. Entries longer than the image are 0.
///
/// # Formula
///
/// ```text
/// L(z) = P(segment of length z in the phase)
/// outside overlapping discs of radius R, λ per area: L(z) = exp(−λ (π R² + 2 R z))
/// ```
///
/// # References
///
/// Lu & Torquato 1992.
///
/// ```
/// use ndarray::{Axis, array};
/// use stereology_metrics::lineal_path;
///
/// let phase = array![[true, true, true, false], [false, true, true, false]];
/// assert_eq!(lineal_path(phase.view(), Axis(1), 2), [5.0 / 8.0, 3.0 / 6.0, 1.0 / 4.0]);
/// ```
#[must_use]
pub fn lineal_path(phase: ArrayView2<'_, bool>, along: Axis, reach: usize) -> Vec<f64> {
    let n = phase.len_of(along);
    let lines = phase.lanes(along).into_iter().count();
    let mut counts = vec![0_u64; reach + 1];
    for (length, _) in runs(phase, along) {
        for (z, count) in counts.iter_mut().enumerate().take(length) {
            *count += (length - z) as u64;
        }
    }
    let placed = |z: usize| (n.saturating_sub(z) * lines).max(1) as f64;
    counts
        .iter()
        .enumerate()
        .map(|(z, &count)| count as f64 / placed(z))
        .collect()
}

/// Lengths in pixels of the chords that lines along an axis cut from the phase. Chords that reach the image's border
/// are left out, since their length is unknown.
///
/// Outside overlapping discs (Poisson) chord lengths are exponential with mean 1 / (2 R λ). Long chords reach the
/// border more often, so the lengths found are biased towards short ones.
///
/// ```
/// use ndarray::{Axis, array};
/// use stereology_metrics::chord_lengths;
///
/// let phase = array![[true, false, true, true, false, true, true]];
/// assert_eq!(chord_lengths(phase.view(), Axis(1)), [2]);
/// ```
#[must_use]
pub fn chord_lengths(phase: ArrayView2<'_, bool>, along: Axis) -> Vec<usize> {
    runs(phase, along)
        .into_iter()
        .filter_map(|(length, inside)| inside.then_some(length))
        .collect()
}

/// Number, mean and spread of chords.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chords {
    /// Number of chords.
    pub count: usize,
    /// Mean length, pixels.
    pub mean: f64,
    /// Standard deviation over mean: 1 for exponential lengths.
    pub variation: f64,
}

impl Chords {
    /// Of these lengths; `None` if there are none.
    ///
    /// ```
    /// use stereology_metrics::Chords;
    ///
    /// let found = Chords::of(&[1, 3]).unwrap();
    /// assert_eq!((found.mean, found.variation), (2.0, 0.5));
    /// ```
    #[must_use]
    pub fn of(lengths: &[usize]) -> Option<Self> {
        let n = lengths.len() as f64;
        let mean = lengths.iter().map(|&length| length as f64).sum::<f64>() / n;
        let square = lengths
            .iter()
            .map(|&length| (length as f64 - mean).powi(2))
            .sum::<f64>()
            / n;
        (!lengths.is_empty()).then(|| Self {
            count: lengths.len(),
            mean,
            variation: square.sqrt() / mean,
        })
    }
}

/// Runs of the phase, and whether both their ends lie inside.
fn runs(phase: ArrayView2<'_, bool>, along: Axis) -> Vec<(usize, bool)> {
    let mut found = Vec::new();
    for line in phase.lanes(along) {
        let mut start = None;
        for (at, &here) in line.iter().enumerate() {
            match (here, start) {
                (true, None) => start = Some(at),
                (false, Some(from)) => {
                    found.push((at - from, from > 0));
                    start = None;
                }
                _ => {}
            }
        }
        if let Some(from) = start {
            found.push((line.len() - from, false));
        }
    }
    found
}
