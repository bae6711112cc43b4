//! Fringes of a laminar texture: their lengths and tortuosities.

use super::level_curves::{LevelCurve, distance, level_curves};
use ndarray::Array2;

/// Lengths and tortuosities of the fringes of a filtered image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fringes {
    /// Lengths of the fringes that lie wholly inside the image, pixels.
    pub lengths: Vec<f64>,
    /// Their tortuosities: length over the distance from end to end, at least 1.
    pub tortuosities: Vec<f64>,
    /// Total length of all fringes, including those that leave the image.
    pub total_length: f64,
    /// Number of ends of fringes inside the image.
    pub ends: usize,
}

/// The fringes of an image that was filtered to a band about one `period` (pixels): its level curves at 0, cut where
/// they turn back.
///
/// A level curve runs along one flank of a fringe, turns around its end and returns along the other flank. It is cut at
/// the turn, which is where the ends of a piece as long as the period are less than .7 periods from each other. Curves
/// that close without a turn, pieces shorter than a period, and pieces that reach the image's border do not count among
/// `lengths`. Long fringes reach the border more often, so `lengths` is biased towards short ones and images are
/// compared in windows of one size. [`Fringes::mean_length_by_ends`] does not have this bias.
///
/// # References
///
/// Urs et al. 2012, section 3.2 and figure 10, after Da Costa et al. and Raynal et al.
///
/// # Examples
///
/// ```
/// use ndarray::Array2;
/// use stereology_metrics::fringes;
///
/// // Fringes with a period of 10 pixels that fade out to the left and right.
/// let field = Array2::from_shape_fn((60, 120), |(y, x)| {
///     let (u, v) = (x as f64 - 60.0, y as f64);
///     (v * std::f64::consts::TAU / 10.0).sin() - (u / 30.0).powi(8)
/// });
/// let found = fringes(&field, 10.0);
/// assert!(found.lengths.len() >= 8);
/// assert!(found.tortuosities.iter().all(|t| *t < 1.05));
/// ```
#[must_use]
pub fn fringes(filtered: &Array2<f64>, period: f64) -> Fringes {
    let mut found = Fringes::default();
    for curve in level_curves(filtered, 0.0) {
        for (piece, inner_ends) in pieces(&curve, period) {
            let length = piece.length();
            if length < period {
                continue;
            }
            found.total_length += length;
            found.ends += inner_ends;
            if let (2, Some(tortuosity)) = (inner_ends, piece.tortuosity()) {
                found.lengths.push(length);
                found.tortuosities.push(tortuosity);
            }
        }
    }
    found
}

impl Fringes {
    /// Mean length of the fringes that lie wholly inside; `None` if there are none.
    #[must_use]
    pub fn mean_length(&self) -> Option<f64> {
        mean(&self.lengths)
    }

    /// Mean tortuosity of the fringes that lie wholly inside; `None` if there are none.
    #[must_use]
    pub fn mean_tortuosity(&self) -> Option<f64> {
        mean(&self.tortuosities)
    }

    /// Mean length without the bias of the window: every fringe has two ends, so the mean is twice the total length
    /// over the number of ends. `None` without ends.
    ///
    /// ```
    /// use stereology_metrics::Fringes;
    ///
    /// let seen = Fringes { total_length: 300.0, ends: 10, ..Fringes::default() };
    /// assert_eq!(seen.mean_length_by_ends(), Some(60.0));
    /// ```
    #[must_use]
    pub fn mean_length_by_ends(&self) -> Option<f64> {
        (self.ends > 0).then(|| 2.0 * self.total_length / self.ends as f64)
    }

    /// Adds the fringes of another image.
    pub fn extend(&mut self, other: Self) {
        self.lengths.extend(other.lengths);
        self.tortuosities.extend(other.tortuosities);
        self.total_length += other.total_length;
        self.ends += other.ends;
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The pieces of a curve between its turns, and how many ends of each lie inside the image. A closed curve without a
/// turn is not a fringe.
fn pieces(curve: &LevelCurve, period: f64) -> Vec<(LevelCurve, usize)> {
    let points = &curve.points;
    let n = points.len();
    let turns: Vec<bool> = (0..n).map(|at| turns_back(curve, at, period)).collect();
    let mut order: Vec<usize> = (0..n).collect();
    if curve.closed {
        // Begin at a turn, so that no piece continues past the end of the list.
        match turns.iter().position(|&turn| turn) {
            None => return Vec::new(),
            Some(first) => order.rotate_left(first),
        }
    }
    let mut found = Vec::new();
    let runs = order.chunk_by(|&a, &b| turns[a] == turns[b]);
    for run in runs.filter(|run| !turns[run[0]]) {
        let at_border = |end: Option<&usize>, border: usize| !curve.closed && end == Some(&border);
        let outside = usize::from(at_border(run.first(), 0)) + usize::from(at_border(run.last(), n - 1));
        let piece = LevelCurve {
            points: run.iter().map(|&i| points[i]).collect(),
            closed: false,
        };
        found.push((piece, 2 - outside));
    }
    found
}

/// Whether the points half a period of arc before and after are less than .7 periods apart.
fn turns_back(curve: &LevelCurve, at: usize, period: f64) -> bool {
    let points = &curve.points;
    let n = points.len();
    let walk = |step: usize| {
        let (mut here, mut left) = (at, period / 2.0);
        for _ in 0..n {
            let next = (here + step) % n;
            let leaves = if step == 1 { next == 0 } else { here == 0 };
            if leaves && !curve.closed {
                return None;
            }
            let length = distance(points[here], points[next]);
            if length >= left {
                let t = if length > 0.0 { left / length } else { 0.0 };
                return Some([0, 1].map(|k| points[here][k] + t * (points[next][k] - points[here][k])));
            }
            left -= length;
            here = next;
        }
        None
    };
    // Near the border the curve is too short to decide.
    match (walk(n - 1), walk(1)) {
        (Some(before), Some(after)) => distance(before, after) < 0.7 * period,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::fringes;
    use ndarray::Array2;
    use std::f64::consts::TAU;

    /// Straight fringes from border to border have no ends, so none lies inside.
    #[test]
    fn fringes_from_border_to_border_are_not_counted() {
        let waves = Array2::from_shape_fn((64, 64), |(y, _)| (y as f64 * TAU / 8.0 + 0.3).sin());
        let found = fringes(&waves, 8.0);
        assert!(found.lengths.is_empty() && found.ends == 0);
        assert!((found.total_length - 15.0 * 63.0).abs() < 1e-6);
    }

    /// The two flanks of a long thin ellipse are fringes, without its turns. Its round neighbour is not a fringe.
    #[test]
    fn a_closed_curve_is_cut_where_it_turns() {
        let blob = |x: f64, y: f64, a: f64, b: f64| 1.0 - (x / a).powi(2) - (y / b).powi(2);
        let field = Array2::from_shape_fn((60, 140), |(y, x)| {
            let (x, y) = (x as f64, y as f64);
            blob(x - 60.0, y - 20.0, 50.0, 2.5).max(blob(x - 125.0, y - 45.0, 12.0, 12.0))
        });
        let found = fringes(&field, 10.0);
        assert_eq!((found.lengths.len(), found.ends), (2, 4));
        assert!(
            found.lengths.iter().all(|l| (80.0..100.0).contains(l)),
            "{:?}",
            found.lengths
        );
        assert!(found.tortuosities.iter().all(|t| (1.0..1.02).contains(t)));
    }
}
