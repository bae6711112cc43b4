//! Features of a block of an image: contrast, shape of the grey levels, power and tails of three octave bands, their
//! coupling, and directions.

use ndarray::{Array2, ArrayView, ArrayView2, ArrayView3, Axis, Dimension};
use std::ops::Range;

use crate::texture::{MonogenicBand, grey, monogenic_bands};

/// Names of the features, in order.
pub(super) const NAMES: [&str; 17] = [
    "contrast",
    "skewness",
    "kurtosis",
    "fine_power",
    "middle_power",
    "coarse_power",
    "fine_kurtosis",
    "middle_kurtosis",
    "coarse_kurtosis",
    "fine_coupling",
    "coarse_coupling",
    "coherence",
    "anisotropy",
    "direction_along",
    "direction_diagonal",
    "flatness",
    "gradient_kurtosis",
];

/// Differences of a feature below this are irrelevant: 10 % of a contrast, .1 of a correlation or fraction.
pub(super) const RESOLUTION: f64 = 0.1;

/// Pixels around a block that its filters may use.
const MARGIN: usize = 16;
const BANDS: usize = 3;
/// Square of two grey levels of 8 bits. It is added to all variances, so that what is hardly visible is no feature.
const INVISIBLE: f64 = 4.0 / (255.0 * 255.0);
/// Half the side of the square over which the structure tensor is averaged.
const REACH: usize = 3;

/// Features of the block of `side` pixels at (y, x) of an image with values 0 to 1 (row, column, channel), from its
/// grey levels.
pub(super) fn features(image: ArrayView3<'_, f32>, [y, x]: [usize; 2], side: usize) -> [f64; NAMES.len()] {
    let (height, width, _) = image.dim();
    let span = |at: usize, n: usize| (at.saturating_sub(MARGIN), (at + side + MARGIN).min(n));
    let ((top, bottom), (left, right)) = (span(y, height), span(x, width));
    let around = grey(part(image, top..bottom, left..right));
    let block = Block {
        y: y - top,
        x: x - left,
        side,
    };
    let of_grey = Tails::of(block.of(&around).iter().map(|v| f64::from(*v)));
    let bands = monogenic_bands(&around, BANDS);
    let tails: Vec<Tails> = bands
        .iter()
        .map(|band| Tails::of(block.of(&band.even).iter().map(|v| f64::from(*v))))
        .collect();
    let amplitudes: Vec<Array2<f32>> = bands.iter().map(MonogenicBand::amplitude).collect();
    let coupling = |l: usize| correlation(block.of(&amplitudes[l]), block.of(&amplitudes[l + 1]));
    let of_gradient = Gradients::of(&around, &block);
    [
        0.5 * (of_grey.variance + INVISIBLE).ln(),
        of_grey.skewness,
        (1.0 + of_grey.kurtosis).ln(),
        0.5 * (tails[0].square + INVISIBLE).ln(),
        0.5 * (tails[1].square + INVISIBLE).ln(),
        0.5 * (tails[2].square + INVISIBLE).ln(),
        (1.0 + tails[0].kurtosis).ln(),
        (1.0 + tails[1].kurtosis).ln(),
        (1.0 + tails[2].kurtosis).ln(),
        coupling(0),
        coupling(1),
        of_gradient.coherence,
        of_gradient.direction[0].hypot(of_gradient.direction[1]),
        of_gradient.direction[0],
        of_gradient.direction[1],
        of_gradient.flat,
        (1.0 + of_gradient.kurtosis).ln(),
    ]
}

/// A block inside an image.
struct Block {
    y: usize,
    x: usize,
    side: usize,
}

impl Block {
    fn of<'a, T>(&self, field: &'a Array2<T>) -> ArrayView2<'a, T> {
        part(field.view(), self.y..self.y + self.side, self.x..self.x + self.side)
    }
}

/// The rows and columns of a range, of all channels.
pub(super) fn part<T, D: Dimension>(
    field: ArrayView<'_, T, D>,
    rows: Range<usize>,
    columns: Range<usize>,
) -> ArrayView<'_, T, D> {
    field
        .slice_axis_move(Axis(0), rows.into())
        .slice_axis_move(Axis(1), columns.into())
}

/// Moments of values, with variances raised by what is not visible.
struct Tails {
    variance: f64,
    square: f64,
    skewness: f64,
    kurtosis: f64,
}

impl Tails {
    fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let n = values.clone().count().max(1) as f64;
        let mean = values.clone().sum::<f64>() / n;
        let (mut variance, mut third, mut fourth) = (0.0, 0.0, 0.0);
        for value in values {
            let d = value - mean;
            variance += d * d / n;
            third += d * d * d / n;
            fourth += d * d * d * d / n;
        }
        let raised = variance + INVISIBLE;
        Self {
            variance,
            square: variance + mean * mean,
            skewness: third / raised.powf(1.5),
            kurtosis: fourth / (raised * raised),
        }
    }
}

fn correlation(a: ArrayView2<'_, f32>, b: ArrayView2<'_, f32>) -> f64 {
    let n = a.len().max(1) as f64;
    let mean = |of: &ArrayView2<'_, f32>| of.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
    let (mean_a, mean_b) = (mean(&a), mean(&b));
    let (mut ab, mut aa, mut bb) = (0.0, INVISIBLE, INVISIBLE);
    for (a, b) in a.iter().zip(&b) {
        let (a, b) = (f64::from(*a) - mean_a, f64::from(*b) - mean_b);
        ab += a * b / n;
        aa += a * a / n;
        bb += b * b / n;
    }
    ab / (aa * bb).sqrt()
}

/// Features of the gradients in a block.
struct Gradients {
    /// Mean coherence of the structure tensor.
    coherence: f64,
    /// Mean of the gradient's square times cosine and sine of twice its angle, over its mean square.
    direction: [f64; 2],
    /// Fraction of the pixels with less than a quarter of the root mean square gradient.
    flat: f64,
    /// Mean fourth power over the square of the mean square.
    kurtosis: f64,
}

impl Gradients {
    fn of(image: &Array2<f32>, block: &Block) -> Self {
        let (height, width) = image.dim();
        let at = |y: usize, x: usize, dy: isize, dx: isize| {
            let place = |p: usize, d: isize, n: usize| p.saturating_add_signed(d).min(n - 1);
            f64::from(image[[place(y, dy, height), place(x, dx, width)]])
        };
        let gradient = Array2::from_shape_fn((height, width), |(y, x)| {
            [at(y, x, 0, 1) - at(y, x, 0, -1), at(y, x, 1, 0) - at(y, x, -1, 0)].map(|d| d / 2.0)
        });
        let products = gradient.map(|[gx, gy]| [gx * gx - gy * gy, 2.0 * gx * gy, gx * gx + gy * gy]);
        let own = block.of(&products);
        let n = own.len().max(1) as f64;
        let mean = |k: usize| own.iter().map(|p| p[k]).sum::<f64>() / n;
        let square = mean(2) + INVISIBLE;
        let fourth = own.iter().map(|p| p[2] * p[2]).sum::<f64>() / n;
        let coherence = (0..block.side * block.side).map(|i| {
            let (y, x) = (block.y + i / block.side, block.x + i % block.side);
            let (top, left) = (y.saturating_sub(REACH), x.saturating_sub(REACH));
            let around = part(
                products.view(),
                top..(y + REACH + 1).min(height),
                left..(x + REACH + 1).min(width),
            );
            let sum = around
                .iter()
                .fold([0.0; 3], |sum, p| [sum[0] + p[0], sum[1] + p[1], sum[2] + p[2]]);
            sum[0].hypot(sum[1]) / (sum[2] + INVISIBLE * around.len() as f64)
        });
        Self {
            coherence: coherence.sum::<f64>() / n,
            direction: [mean(0) / square, mean(1) / square],
            flat: own.iter().filter(|p| p[2] < square / 16.0).count() as f64 / n,
            kurtosis: fourth / (square * square),
        }
    }
}
