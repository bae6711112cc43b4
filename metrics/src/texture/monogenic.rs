//! The monogenic signal: amplitude, phase and orientation of an image in octave bands.

use ndarray::{Array2, Zip};
use rustfft::num_complex::Complex;
use rustfft::{FftDirection, FftPlanner};

/// One octave band of an image with its Riesz transform: at each pixel the even part b and the odd part (x, y).
///
/// # Formula
///
/// ```text
/// band l     B̂ = f̂ cos(π/2 · log₂(4 · 2^l · ν))   for frequencies ν from 1/2 to 2 times 1/4 / 2^l cycles per pixel, else 0
/// odd part   R̂ = −i (νx, νy) / ν · B̂
/// amplitude  A = √(b² + |R|²);  phase 0 on a bright line, π on a dark one, π/2 on an edge
/// ```
///
/// The squares of the responses of all bands sum to 1.
///
/// # References
///
/// Felsberg & Sommer 2001.
#[derive(Clone, Debug)]
pub(crate) struct MonogenicBand {
    /// The band.
    pub(crate) even: Array2<f32>,
    /// Its Riesz transform along x and y.
    pub(crate) odd: Array2<[f32; 2]>,
}

impl MonogenicBand {
    /// Amplitude at each pixel.
    pub(crate) fn amplitude(&self) -> Array2<f32> {
        Zip::from(&self.even)
            .and(&self.odd)
            .map_collect(|even, [x, y]| (even * even + x * x + y * y).sqrt())
    }
}

/// The finest `levels` octave bands of an image, finest first. The image is mirrored at its borders, so that they are
/// no edges. Cost: N log N for each band.
#[allow(clippy::cast_possible_truncation, reason = "single precision suffices")]
pub(crate) fn monogenic_bands(image: &Array2<f32>, levels: usize) -> Vec<MonogenicBand> {
    let (height, width) = image.dim();
    let mirrored = |at: usize, n: usize| if at < n { at } else { 2 * n - 1 - at };
    let mean = image.mean().unwrap_or_default();
    let mut spectrum = Array2::from_shape_fn((2 * height, 2 * width), |(y, x)| {
        Complex::new(image[[mirrored(y, height), mirrored(x, width)]] - mean, 0.0)
    });
    transform(&mut spectrum, FftDirection::Forward);
    let scale = 1.0 / spectrum.len() as f32;
    let frequency =
        |at: usize, n: usize| (if at < n { at as f64 } else { at as f64 - 2.0 * n as f64 }) / (2 * n) as f64;
    (0..levels)
        .map(|level| {
            // The even part is real and the parts of x and y are one complex transform, so two inverse ones suffice.
            let (mut even, mut odd) = (spectrum.clone(), spectrum.clone());
            for (((y, x), even), odd) in even.indexed_iter_mut().zip(odd.iter_mut()) {
                let (fy, fx) = (frequency(y, height), frequency(x, width));
                let radius = fy.hypot(fx);
                let octaves = (4.0 * radius).log2() + level as f64;
                let response = if octaves.abs() < 1.0 {
                    (std::f64::consts::FRAC_PI_2 * octaves).cos()
                } else {
                    0.0
                };
                *even *= response as f32 * scale;
                // −i (νx + i νy) / ν, whose transform has x in its real part and y in its imaginary part.
                let direction = if response > 0.0 { response / radius } else { 0.0 };
                *odd *= Complex::new((fy * direction) as f32, (-fx * direction) as f32) * scale;
            }
            transform(&mut even, FftDirection::Inverse);
            transform(&mut odd, FftDirection::Inverse);
            MonogenicBand {
                even: Array2::from_shape_fn((height, width), |at| even[at].re),
                odd: Array2::from_shape_fn((height, width), |at| [odd[at].re, odd[at].im]),
            }
        })
        .collect()
}

/// Fourier transform along both axes, without a factor.
fn transform(field: &mut Array2<Complex<f32>>, direction: FftDirection) {
    let (height, width) = field.dim();
    let mut planner = FftPlanner::new();
    let rows = planner.plan_fft(width, direction);
    let columns = planner.plan_fft(height, direction);
    for mut row in field.rows_mut() {
        if let Some(row) = row.as_slice_mut() {
            rows.process(row);
        }
    }
    let mut column = vec![Complex::default(); height];
    for mut lane in field.columns_mut() {
        column.iter_mut().zip(&lane).for_each(|(to, from)| *to = *from);
        columns.process(&mut column);
        lane.iter_mut().zip(&column).for_each(|(to, from)| *to = *from);
    }
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, reason = "values of a test")]
mod tests {
    use super::monogenic_bands;
    use ndarray::Array2;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20))]

        /// A plane wave in the middle of a band has constant amplitude away from the borders, whatever its direction,
        /// and its odd part points across its fronts.
        #[test]
        fn a_wave_has_constant_amplitude(degrees in 0.0_f64..180.0, phase in 0.0_f64..6.0) {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let wave = Array2::from_shape_fn((96, 96), |(y, x)| {
                (std::f64::consts::TAU / 8.0 * (x as f64 * cos + y as f64 * sin) + phase).cos() as f32
            });
            let band = &monogenic_bands(&wave, 2)[1];
            let amplitude = band.amplitude();
            for y in 40..56 {
                for x in 40..56 {
                    prop_assert!((amplitude[[y, x]] - 1.0).abs() < 0.05, "{}", amplitude[[y, x]]);
                    let [ox, oy] = band.odd[[y, x]].map(f64::from);
                    prop_assert!((ox * sin - oy * cos).abs() < 0.05);
                }
            }
        }
    }

    /// Bands of all scales keep the power of white noise between their outermost frequencies: the sum of squares of
    /// neighbouring responses is 1.
    #[test]
    fn responses_sum_to_one() {
        let mut dot = Array2::zeros((64, 64));
        dot[[31, 31]] = 1.0_f32;
        let power: f32 = monogenic_bands(&dot, 5)
            .iter()
            .flat_map(|band| band.even.iter().map(|v| v * v))
            .sum();
        // The mirror images repeat the dot four times at half the frequency step; the bands hold the frequencies up to
        // 1/4 completely and half of the octave above it, of the unit square's power.
        let expected = (0..256_i32 * 256)
            .map(|i| {
                let [fy, fx] = [i / 256, i % 256].map(|k| f64::from(if k < 128 { k } else { k - 256 }) / 256.0);
                let octaves = (4.0 * fy.hypot(fx)).log2();
                if octaves <= 0.0 {
                    1.0
                } else if octaves < 1.0 {
                    (std::f64::consts::FRAC_PI_2 * octaves).cos().powi(2)
                } else {
                    0.0
                }
            })
            .sum::<f64>()
            / (256.0 * 256.0);
        assert!((f64::from(power) - expected).abs() < 0.01, "{power} {expected}");
    }
}
