//! Edges of size bins.

/// Edges of bins must be finite, not negative and increasing, two or more.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EdgesError {
    /// Fewer than two edges.
    #[error("bins need at least two edges, {0} given")]
    TooFew(usize),
    /// An edge that is not a length.
    #[error("edge {index} is {value}: edges must be finite and not negative")]
    NotALength {
        /// Index of the edge, from 0.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// An edge that is not above the one before.
    #[error("edge {index} is not larger than the one before it: edges must increase")]
    NotIncreasing {
        /// Index of the edge, from 0.
        index: usize,
    },
}

/// Checks that `edges` bound size bins: at least two lengths, each larger than the one before.
///
/// # Errors
///
/// [`EdgesError`] names the first edge that breaks the rule.
pub fn check_edges(edges: &[f64]) -> Result<(), EdgesError> {
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

#[cfg(test)]
mod tests {
    use super::{EdgesError, check_edges};

    /// Each rule has its own error, and the first edge that breaks one is named.
    #[test]
    fn the_first_offending_edge_is_named() {
        assert_eq!(check_edges(&[]), Err(EdgesError::TooFew(0)));
        assert_eq!(check_edges(&[1.0]), Err(EdgesError::TooFew(1)));
        assert_eq!(
            check_edges(&[0.0, -1.0]),
            Err(EdgesError::NotALength { index: 1, value: -1.0 })
        );
        assert!(matches!(
            check_edges(&[0.0, f64::NAN]),
            Err(EdgesError::NotALength { index: 1, .. })
        ));
        assert_eq!(
            check_edges(&[0.0, 2.0, 1.0, 0.5]),
            Err(EdgesError::NotIncreasing { index: 2 })
        );
    }
}
