//! Which texels of its exemplar a solid uses, and how long its exact copies are.

use ndarray::ArrayView2;

/// Use of the texels of an exemplar by images whose every pixel was copied from one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Copying {
    /// Fraction of the texels that are used at all.
    pub coverage: f64,
    /// Exponential of the entropy of their use, over their number n: 1 if all are used equally often, 1/n if only one
    /// is used.
    pub perplexity: f64,
    /// Longest run of pixels along a row or a column that is an exact copy of the exemplar, pixels.
    pub longest_copy: usize,
}

/// Coverage and copying of images, given the source of each pixel: row × `width` + column in an exemplar of `height` ×
/// `width` texels. Larger numbers do not count.
///
/// # Examples
///
/// An image that equals its exemplar uses every texel once and copies whole rows:
///
/// ```
/// use ndarray::Array2;
/// use stereology_metrics::copying;
///
/// let itself = Array2::from_shape_fn((4, 6), |(y, x)| (6 * y + x) as u32);
/// let found = copying(&[itself.view()], 4, 6);
/// assert_eq!((found.coverage, found.longest_copy), (1.0, 6));
/// assert!((found.perplexity - 1.0).abs() < 1e-12);
/// ```
#[must_use]
pub fn copying(images: &[ArrayView2<'_, u32>], height: usize, width: usize) -> Copying {
    let texels = height * width;
    let mut counts = vec![0_u64; texels];
    let mut longest = 0;
    for image in images {
        for &source in *image {
            if let Some(count) = counts.get_mut(source as usize) {
                *count += 1;
            }
        }
        for line in image.rows() {
            longest = longest.max(longest_run(line.iter().copied(), texels, |a, b| {
                b == a + 1 && b % width != 0
            }));
        }
        for line in image.columns() {
            longest = longest.max(longest_run(line.iter().copied(), texels, |a, b| b == a + width));
        }
    }
    let total = counts.iter().sum::<u64>() as f64;
    if total == 0.0 {
        return Copying::default();
    }
    let used = counts.iter().filter(|&&n| n > 0);
    let entropy: f64 = used.clone().map(|&n| n as f64 / total).map(|p| -p * p.ln()).sum();
    Copying {
        coverage: used.count() as f64 / texels as f64,
        perplexity: entropy.exp() / texels as f64,
        longest_copy: longest,
    }
}

fn longest_run(sources: impl Iterator<Item = u32>, texels: usize, follows: impl Fn(usize, usize) -> bool) -> usize {
    let (mut longest, mut run, mut last) = (0, 0, None);
    for source in sources.map(|source| source as usize) {
        let known = source < texels;
        run = match last {
            Some(last) if known && follows(last, source) => run + 1,
            _ => usize::from(known),
        };
        last = known.then_some(source);
        longest = longest.max(run);
    }
    longest
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, clippy::float_cmp, reason = "values of a test")]
mod tests {
    use super::copying;
    use ndarray::Array2;

    /// A copy ends at the exemplar's right border, although the next number follows there; a single texel has
    /// perplexity 1/n.
    #[test]
    fn rows_end_at_the_border() {
        let over = Array2::from_shape_fn((1, 6), |(_, x)| [0, 1, 2, 3, 4, 5][x]);
        assert_eq!(copying(&[over.view()], 4, 3).longest_copy, 3);
        let one = Array2::from_elem((5, 5), 7);
        let found = copying(&[one.view()], 4, 3);
        assert!((found.perplexity - 1.0 / 12.0).abs() < 1e-12 && found.longest_copy == 1);
        assert_eq!(
            copying(&[Array2::from_elem((2, 2), u32::MAX).view()], 2, 2).coverage,
            0.0
        );
    }
}
