//! Texture atlas layout: charts of one or two triangles, and their positions in a square of texels.

use nalgebra::{Matrix2, Matrix3x2, Point2, Point3, Vector2, Vector3};
use rayon::prelude::*;
use std::ops::Range;
use stereology_shape::TriangleMesh;

/// A triangle of a chart.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub(crate) triangle: usize,
    /// The triangle's corners in the chart, in lengths of the solid.
    pub(crate) corners: [Point2<f64>; 3],
    /// The position on the mesh of the chart's corner, and the steps from there per unit along the chart and down it.
    origin: Point3<f64>,
    steps: [Vector3<f64>; 2],
}

/// One or two triangles laid flat without distortion, in their smallest bounding rectangle, wider than high.
#[derive(Clone, Debug)]
pub(crate) struct Chart {
    pub(crate) pieces: Vec<Piece>,
    /// The edge that two triangles share, the first on its positive side.
    fold: [Point2<f64>; 2],
    width: f64,
    height: f64,
}

/// Triangles lower than this fraction of their longest edge count as lines.
const LINE: f64 = 1e-9;

/// A triangle laid flat without distortion: first corner at the origin, second along x, third below.
fn laid(corners: [Point3<f64>; 3]) -> [Point2<f64>; 3] {
    let [a, b, c] = corners;
    let length = (b - a).norm();
    let along = (b - a).try_normalize(0.0).unwrap_or_default();
    let x = (c - a).dot(&along);
    let y = (c - a - x * along).norm();
    [Point2::origin(), Point2::new(length, 0.0), Point2::new(x, y)]
}

/// Corners in cyclic order from this one on.
fn turned_to<T: Copy>(k: usize, corners: [T; 3]) -> [T; 3] {
    [0, 1, 2].map(|i| corners[(k + i) % 3])
}

fn longest(corners: &[Point2<f64>; 3]) -> usize {
    let length = |k: usize| (corners[(k + 1) % 3] - corners[k]).norm();
    (0..3).fold(0, |best, k| if length(k) > length(best) { k } else { best })
}

/// The smallest rectangle about these points with a side along two of them: its width, height, and the points in it.
fn boxed(points: &[Point2<f64>]) -> (f64, f64, Vec<Point2<f64>>) {
    let mut best: Option<(f64, f64, Vec<Point2<f64>>)> = None;
    for (i, p) in points.iter().enumerate() {
        for q in &points[i + 1..] {
            let Some(e) = (q - p).try_normalize(0.0) else { continue };
            let turned: Vec<Vector2<f64>> = points
                .iter()
                .map(|r| Vector2::new(e.dot(&r.coords), e.perp(&r.coords)))
                .collect();
            let low = turned.iter().fold(turned[0], |low, r| low.inf(r));
            let size = turned.iter().fold(turned[0], |high, r| high.sup(r)) - low;
            if best.as_ref().is_some_and(|(w, h, _)| w * h <= size.x * size.y) {
                continue;
            }
            let upright = size.y > size.x;
            let inside = turned.iter().map(|r| {
                let r = r - low;
                Point2::from(if upright { Vector2::new(size.y - r.y, r.x) } else { r })
            });
            best = Some((size.x.max(size.y), size.x.min(size.y), inside.collect()));
        }
    }
    best.unwrap_or_else(|| (0.0, 0.0, vec![Point2::origin(); points.len()]))
}

impl Piece {
    /// Corners from the triangle's corner `first` on.
    fn new((triangle, first): (usize, usize), on_mesh: [Point3<f64>; 3], corners: [Point2<f64>; 3]) -> Self {
        let [p, q, r] = corners;
        let [a, b, c] = on_mesh;
        let flat = Matrix2::from_columns(&[q - p, r - p]);
        let long = (q - p).norm().max((r - p).norm()).max((r - q).norm());
        let steep = flat.determinant().abs() > LINE * long * long;
        let steps = flat.try_inverse().filter(|_| steep).map_or_else(
            || {
                // A line: no step across it.
                let k = longest(&corners);
                let ([from, to, _], [start, end, _]) = (turned_to(k, corners), turned_to(k, on_mesh));
                let along = to - from;
                let square = along.norm_squared();
                let step = |x: f64| {
                    if square > 0.0 {
                        (end - start) * (x / square)
                    } else {
                        Vector3::zeros()
                    }
                };
                [step(along.x), step(along.y)]
            },
            |inverse| {
                let steps = Matrix3x2::from_columns(&[b - a, c - a]) * inverse;
                [steps.column(0).into_owned(), steps.column(1).into_owned()]
            },
        );
        Self {
            triangle,
            corners: turned_to(3 - first, corners),
            origin: a - p.x * steps[0] - p.y * steps[1],
            steps,
        }
    }
}

impl Chart {
    fn one(triangle: (usize, usize), on_mesh: [Point3<f64>; 3], in_solid: [Point3<f64>; 3]) -> Self {
        let (width, height, points) = boxed(&laid(in_solid));
        Self {
            pieces: vec![Piece::new(triangle, on_mesh, [points[0], points[1], points[2]])],
            fold: [Point2::origin(); 2],
            width,
            height,
        }
    }

    /// Two triangles that share the edge from the first corner to the second.
    fn two(
        triangles: [(usize, usize); 2],
        on_mesh: [[Point3<f64>; 3]; 2],
        in_solid: [[Point3<f64>; 3]; 2],
        same_way: bool,
    ) -> Self {
        let [a, b, c] = laid(in_solid[0]);
        let d = laid(in_solid[1])[2];
        let d = Point2::new(if same_way { d.x } else { b.x - d.x }, -d.y);
        let (width, height, points) = boxed(&[a, b, c, d]);
        let [a, b, c, d] = [points[0], points[1], points[2], points[3]];
        let second = if same_way { [a, b, d] } else { [b, a, d] };
        Self {
            pieces: vec![
                Piece::new(triangles[0], on_mesh[0], [a, b, c]),
                Piece::new(triangles[1], on_mesh[1], second),
            ],
            fold: if (b - a).perp(&(c - a)) < 0.0 { [b, a] } else { [a, b] },
            width,
            height,
        }
    }

    /// The point of the mesh at a position of the chart; beyond the chart's edges, the point on the plane of the
    /// triangle on this side of the fold.
    pub(crate) fn point(&self, place: Point2<f64>) -> Point3<f64> {
        let piece = match &self.pieces[..] {
            [first, second] => {
                let [a, b] = self.fold;
                if (b - a).perp(&(place - a)) < 0.0 {
                    second
                } else {
                    first
                }
            }
            pieces => &pieces[0],
        };
        piece.origin + place.x * piece.steps[0] + place.y * piece.steps[1]
    }

    fn area(&self) -> f64 {
        self.width * self.height
    }
}

/// An edge by its vertices, the lower first, with a triangle and the number of its side (`.2`).
type Side = ([u32; 2], usize, usize);

/// Every triangle in a chart; two triangles share one where that saves most area.
pub(crate) fn charts(mesh: &TriangleMesh, placed: &[Point3<f64>]) -> Vec<Chart> {
    let corners = |of: &[Point3<f64>], triangle: usize| mesh.triangles[triangle].map(|i| of[i as usize]);
    let alone: Vec<Chart> = (0..mesh.triangles.len())
        .into_par_iter()
        .map(|triangle| {
            Chart::one(
                (triangle, 0),
                corners(&mesh.vertices, triangle),
                corners(placed, triangle),
            )
        })
        .collect();
    let mut sides: Vec<Side> = mesh
        .triangles
        .iter()
        .enumerate()
        .flat_map(|(triangle, &t)| {
            (0..3).map(move |k| {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                ([a.min(b), a.max(b)], triangle, k)
            })
        })
        .collect();
    sides.par_sort_unstable();
    let shared: Vec<[Side; 2]> = sides
        .chunk_by(|a, b| a.0 == b.0)
        .filter_map(|sides| match sides {
            &[a, b] if a.1 != b.1 && a.0[0] != a.0[1] => Some([a, b]),
            _ => None,
        })
        .collect();
    let join = |sides: &[Side; 2]| {
        let from_edge = |of: &[Point3<f64>]| sides.map(|(_, triangle, k)| turned_to(k, corners(of, triangle)));
        let starts = sides.map(|(_, triangle, k)| mesh.triangles[triangle][k]);
        Chart::two(
            sides.map(|(_, triangle, k)| (triangle, k)),
            from_edge(&mesh.vertices),
            from_edge(placed),
            starts[0] == starts[1],
        )
    };
    let mut savings: Vec<(f64, usize)> = shared
        .par_iter()
        .enumerate()
        .filter_map(|(i, sides)| {
            let apart = alone[sides[0].1].area() + alone[sides[1].1].area();
            Some((apart - join(sides).area(), i)).filter(|(saved, _)| *saved > 0.0)
        })
        .collect();
    savings.par_sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut taken = vec![false; mesh.triangles.len()];
    let mut charts = Vec::new();
    for (_, i) in savings {
        let [(_, first, _), (_, second, _)] = shared[i];
        if !taken[first] && !taken[second] {
            (taken[first], taken[second]) = (true, true);
            charts.push(join(&shared[i]));
        }
    }
    charts.extend(
        alone
            .into_iter()
            .zip(taken)
            .filter(|(_, taken)| !taken)
            .map(|(chart, _)| chart),
    );
    charts
}

/// Margin of texels around each chart.
pub(crate) const MARGIN: u32 = 1;
/// Texels of the smallest chart along each axis.
const LEAST: u32 = 1 + 2 * MARGIN;

/// Side of the smallest square that can contain this many charts.
pub(crate) fn least_side(charts: usize) -> u64 {
    let mut columns = charts.isqrt() as u64;
    if columns * columns < charts as u64 {
        columns += 1;
    }
    columns * u64::from(LEAST)
}

/// Rectangle of a chart, including its margin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rectangle {
    pub(crate) chart: usize,
    pub(crate) left: u32,
    pub(crate) top: u32,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

/// Charts in rows (shelves), the highest first.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// Texels per unit of length of the solid.
    pub(crate) scale: f64,
    pub(crate) rectangles: Vec<Rectangle>,
    shelves: Vec<(u32, Range<usize>)>,
}

impl Layout {
    /// The layout with the smallest texels that fits into a square of `side` texels; `None` if none fits.
    pub(crate) fn new(charts: &[Chart], side: u32) -> Option<Self> {
        let widest = charts.iter().map(|chart| chart.width).fold(0.0, f64::max);
        if u64::from(side) < least_side(charts.len()) {
            return None;
        }
        let mut order: Vec<usize> = (0..charts.len()).collect();
        let higher = |&i: &usize, &j: &usize| {
            let (a, b) = (&charts[i], &charts[j]);
            b.height
                .total_cmp(&a.height)
                .then(b.width.total_cmp(&a.width))
                .then(i.cmp(&j))
        };
        order.par_sort_unstable_by(higher);
        let at = |scale: f64| Self::at_scale(charts, &order, side, scale);
        // Charts of one texel always fit; charts wider than the square never do.
        let (mut fits, mut fails) = (1.0 / widest, f64::from(side - 2 * MARGIN) / widest);
        let mut best = at(fits)?;
        if let Some(layout) = at(fails) {
            return Some(layout);
        }
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (fits + fails);
            match at(middle) {
                Some(layout) => (fits, best) = (middle, layout),
                None => fails = middle,
            }
        }
        Some(best)
    }

    fn at_scale(charts: &[Chart], order: &[usize], side: u32, scale: f64) -> Option<Self> {
        #[allow(
            clippy::cast_possible_truncation,
            reason = "at most the side; larger values saturate and are refused"
        )]
        let texels = |length: f64| ((length * scale - ROUNDING).ceil().max(1.0) as u32).saturating_add(2 * MARGIN);
        let mut rectangles = Vec::with_capacity(order.len());
        let mut shelves = Vec::new();
        let (mut left, mut top, mut next_top) = (0, 0, 0);
        for &chart in order {
            let (width, height) = (texels(charts[chart].width), texels(charts[chart].height));
            if rectangles.is_empty() || width > side - left {
                (left, top) = (0, next_top);
                if width > side || height > side - top {
                    return None;
                }
                next_top = top + height;
                shelves.push((top, rectangles.len()..rectangles.len()));
            }
            rectangles.push(Rectangle {
                chart,
                left,
                top,
                width,
                height,
            });
            left += width;
            if let Some((_, shelf)) = shelves.last_mut() {
                shelf.end = rectangles.len();
            }
        }
        Some(Self {
            scale,
            rectangles,
            shelves,
        })
    }

    /// The rectangles that a row of texels cuts, from the left.
    pub(crate) fn in_row(&self, row: u32) -> impl Iterator<Item = &Rectangle> {
        let shelf = self.shelves.partition_point(|(top, _)| *top <= row);
        let shelf = shelf.checked_sub(1).map_or(0..0, |i| self.shelves[i].1.clone());
        self.rectangles[shelf].iter().filter(move |r| row < r.top + r.height)
    }
}

/// The scale is found to one part in 2³⁰.
const BISECTIONS: u32 = 30;
/// Fraction of a texel by which a chart may exceed its rectangle without its margin.
const ROUNDING: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::{Layout, MARGIN, charts};
    use proptest::prelude::*;
    use stereology_shape::{Body, TriangleMesh};

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Every texel belongs to one chart or none, every triangle to one chart; charts with their margins stay in the
        /// square.
        #[test]
        fn charts_do_not_overlap(seed in 0_u64..1000, side in 120_u32..500) {
            let rock = Body::rock(seed).mesh().unwrap().as_triangle_mesh().clone();
            for mesh in [rock, TriangleMesh::icosphere(2.0, 2), TriangleMesh::cuboid([1.0, 2.0, 7.0])] {
                let charts = charts(&mesh, &mesh.vertices);
                let layout = Layout::new(&charts, side).unwrap();
                let mut owner = vec![usize::MAX; (side * side) as usize];
                for r in &layout.rectangles {
                    for y in r.top..r.top + r.height {
                        prop_assert!(layout.in_row(y).any(|other| other.chart == r.chart));
                        for x in r.left..r.left + r.width {
                            prop_assert!(x < side && y < side);
                            let owner = &mut owner[(y * side + x) as usize];
                            prop_assert_eq!(*owner, usize::MAX);
                            *owner = r.chart;
                        }
                    }
                    for p in charts[r.chart].pieces.iter().flat_map(|piece| piece.corners) {
                        prop_assert!(p.x >= -1e-9 && p.x * layout.scale <= f64::from(r.width - 2 * MARGIN) + 1e-5);
                        prop_assert!(p.y >= -1e-9 && p.y * layout.scale <= f64::from(r.height - 2 * MARGIN) + 1e-5);
                    }
                }
                let mut triangles: Vec<usize> = charts.iter().flat_map(|c| &c.pieces).map(|p| p.triangle).collect();
                triangles.sort_unstable();
                prop_assert_eq!(triangles, (0..mesh.triangles.len()).collect::<Vec<_>>());
            }
        }

        /// Flat triangles keep their edge lengths, and a chart maps back to their corners.
        #[test]
        fn charts_are_flat_but_true(seed in 0_u64..1000) {
            let mesh = Body::rock(seed).mesh().unwrap().as_triangle_mesh().clone();
            for chart in charts(&mesh, &mesh.vertices) {
                for piece in &chart.pieces {
                    let corners = mesh.triangles[piece.triangle].map(|i| mesh.vertices[i as usize]);
                    for k in 0..3 {
                        let flat = (piece.corners[k] - piece.corners[(k + 1) % 3]).norm();
                        prop_assert!((flat - (corners[k] - corners[(k + 1) % 3]).norm()).abs() < 1e-9);
                        prop_assert!((chart.point(piece.corners[k]) - corners[k]).norm() < 1e-6);
                    }
                }
            }
        }
    }
}
