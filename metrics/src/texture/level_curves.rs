//! Level curves of a field by marching squares.

use ndarray::Array2;

/// A curve along which a field has one value. Points are (x, y) in pixels; the sample (row, column) lies at (column,
/// row).
#[derive(Clone, Debug, PartialEq)]
pub struct LevelCurve {
    /// Its points in order; the first is not repeated at the end of a closed curve.
    pub points: Vec<[f64; 2]>,
    /// Whether the curve is closed; an open curve begins and ends on the field's border.
    pub closed: bool,
}

/// The curves on which the field has the value `level`, in a fixed order. Where the corners of a square alternate,
/// their mean decides which are joined. Cost: linear.
///
/// # Examples
///
/// The level curve of a cone is a circle:
///
/// ```
/// use ndarray::Array2;
/// use stereology_metrics::level_curves;
///
/// let cone = Array2::from_shape_fn((41, 41), |(y, x)| (y as f64 - 20.0).hypot(x as f64 - 20.0) - 15.0);
/// let curves = level_curves(&cone, 0.0);
/// assert_eq!(curves.len(), 1);
/// assert!(curves[0].closed);
/// assert!((curves[0].length() / (30.0 * std::f64::consts::PI) - 1.0).abs() < 0.002);
/// ```
#[must_use]
pub fn level_curves(field: &Array2<f64>, level: f64) -> Vec<LevelCurve> {
    let (height, width) = field.dim();
    if height < 2 || width < 2 {
        return Vec::new();
    }
    let above = |y: usize, x: usize| field[[y, x]] > level;
    // Edge 2 (y w + x) runs from (y, x) to the right, the next one down.
    let edge = |y: usize, x: usize, down: bool| 2 * (y * width + x) + usize::from(down);
    const NONE: usize = usize::MAX;
    let mut links = vec![[NONE; 2]; 2 * height * width];
    let mut link = |a: usize, b: usize| {
        for (from, to) in [(a, b), (b, a)] {
            let slot = usize::from(links[from][0] != NONE);
            links[from][slot] = to;
        }
    };
    for y in 0..height - 1 {
        for x in 0..width - 1 {
            let corners = [above(y, x), above(y, x + 1), above(y + 1, x + 1), above(y + 1, x)];
            let (top, right, bottom, left) = (
                edge(y, x, false),
                edge(y, x + 1, true),
                edge(y + 1, x, false),
                edge(y, x, true),
            );
            let crossed: Vec<usize> = [top, right, bottom, left]
                .into_iter()
                .enumerate()
                .filter(|(i, _)| corners[*i] != corners[(i + 1) % 4])
                .map(|(_, e)| e)
                .collect();
            match crossed[..] {
                [a, b] => link(a, b),
                [_, _, _, _] => {
                    let mean = (field[[y, x]] + field[[y, x + 1]] + field[[y + 1, x]] + field[[y + 1, x + 1]]) / 4.0;
                    // The middle is connected with the two corners on its side of the level; the curves separate the
                    // other two.
                    if corners[0] == (mean > level) {
                        link(top, right);
                        link(bottom, left);
                    } else {
                        link(top, left);
                        link(right, bottom);
                    }
                }
                _ => {}
            }
        }
    }
    let point = |edge: usize| {
        let (down, at) = (edge % 2, edge / 2);
        let (y, x) = (at / width, at % width);
        let a = field[[y, x]] - level;
        let b = field[[y + down, x + 1 - down]] - level;
        let t = a / (a - b);
        [
            x as f64 + if down == 0 { t } else { 0.0 },
            y as f64 + if down == 1 { t } else { 0.0 },
        ]
    };
    let mut seen = vec![false; links.len()];
    let mut curves = Vec::new();
    // First the open curves, from the border; the remaining ones are closed.
    for open in [true, false] {
        for start in 0..links.len() {
            let ends = links[start].iter().filter(|&&l| l == NONE).count();
            if seen[start] || ends == 2 || (open && ends == 0) {
                continue;
            }
            let (mut at, mut points) = (start, Vec::new());
            loop {
                seen[at] = true;
                points.push(point(at));
                match links[at].iter().find(|&&next| next != NONE && !seen[next]) {
                    Some(&next) => at = next,
                    None => break,
                }
            }
            curves.push(LevelCurve { points, closed: !open });
        }
    }
    curves
}

impl LevelCurve {
    /// Length, pixels; for a closed curve its whole circumference.
    #[must_use]
    pub fn length(&self) -> f64 {
        let along: f64 = self.points.windows(2).map(|pair| distance(pair[0], pair[1])).sum();
        match self.points[..] {
            [first, .., last] if self.closed => along + distance(first, last),
            _ => along,
        }
    }

    /// Length over the distance from end to end: 1 for a straight line, π/2 for a half circle. `None` for closed
    /// curves.
    ///
    /// ```
    /// use std::f64::consts::PI;
    /// use stereology_metrics::LevelCurve;
    ///
    /// let half_circle = (0..=1000).map(|i| (f64::from(i) * PI / 1000.0).sin_cos()).map(|(s, c)| [c, s]);
    /// let curve = LevelCurve { points: half_circle.collect(), closed: false };
    /// assert!((curve.tortuosity().unwrap() - PI / 2.0).abs() < 1e-5);
    /// ```
    #[must_use]
    pub fn tortuosity(&self) -> Option<f64> {
        match self.points[..] {
            [first, .., last] if !self.closed && distance(first, last) > 0.0 => {
                Some(self.length() / distance(first, last))
            }
            _ => None,
        }
    }
}

pub(super) fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::level_curves;
    use ndarray::{Array2, array};

    /// The level curve of a plane is one straight line from border to border, since linear interpolation is exact.
    #[test]
    fn a_plane_gives_a_straight_line() {
        let plane = Array2::from_shape_fn((20, 30), |(y, x)| 0.31 * x as f64 - 0.57 * y as f64 - 1.234);
        let curves = level_curves(&plane, 0.0);
        assert_eq!(curves.len(), 1);
        assert!((curves[0].tortuosity().unwrap() - 1.0).abs() < 1e-12);
        for [x, y] in &curves[0].points {
            assert!((0.31 * x - 0.57 * y - 1.234).abs() < 1e-9);
        }
    }

    /// At a saddle the mean decides which corners are joined, and the two curves do not cross.
    #[test]
    fn the_mean_decides_a_saddle() {
        for (low, ends) in [(0.9, [0.0, 1.0]), (3.0, [0.0, 1.0])] {
            let curves = level_curves(&array![[1.0, -low], [-low, 1.0]], 0.0);
            assert_eq!((curves.len(), ends), (2, [0.0, 1.0]));
            // A high mean separates the low corners, a low mean the high ones.
            let corner = if low < 1.0 { [1.0, 0.0] } else { [0.0, 0.0] };
            let near = curves
                .iter()
                .any(|c| c.points.iter().all(|p| super::distance(*p, corner) < 1.0));
            assert!(near, "{curves:?}");
        }
    }
}
