//! How the bands of an image at neighbouring scales depend on each other: what edges and lines have and noise of the
//! same spectrum does not.

use ndarray::Array2;

use super::monogenic::MonogenicBand;

/// Octave bands that are compared with the next coarser one.
pub(crate) const PAIRS: usize = 2;

/// Smallest side in pixels of an image in which the coarsest band, of wavelengths about 16 pixels, is measured.
pub(crate) const LEAST_SIDE: usize = 32;

/// Sums over pixels for one pair of neighbouring scales.
#[derive(Clone, Copy, Debug, Default)]
struct Pair {
    pixels: f64,
    /// Sums of both amplitudes, of their squares, of their product.
    amplitudes: [f64; 2],
    squares: [f64; 2],
    product: f64,
    /// Sum of the fine band times the conjugate of the coarse one with its phase doubled.
    phases: [f64; 2],
}

/// Dependence of neighbouring scales, from finest to coarsest pair: correlation of their amplitudes, and correlation of
/// their phases.
///
/// # Formula
///
/// ```text
/// magnitudes  correlation of A_l and A_{l+1} over pixels
/// phases      Σ z conj(w²/|w|) / √(Σ A_l² Σ A_{l+1}²)     w = b_{l+1} + i |R_{l+1}|,  n = R_{l+1} / |R_{l+1}|
///                                                         z = b_l + i R_l·n
/// ```
///
/// Along an edge or a line, phases at one scale follow from those at the next: doubling the phase of the coarse band
/// makes both turn equally fast. The real part of the sum is positive for bright lines and negative for dark ones, the
/// imaginary part is negative for edges. A Gaussian texture has magnitudes of .1 to .2 and an imaginary part of -.2 to
/// -.3, since neighbouring bands overlap.
///
/// # References
///
/// Portilla & Simoncelli 2000, section 2.2; here for monogenic bands, so that the measure does not depend on
/// orientation.
#[derive(Clone, Debug, Default)]
pub(crate) struct CrossScale {
    pairs: [Pair; PAIRS],
}

impl CrossScale {
    /// Sums over an image with these bands, at least three.
    pub(crate) fn of(bands: &[MonogenicBand], amplitudes: &[Array2<f32>]) -> Self {
        let mut pairs = [Pair::default(); PAIRS];
        for (l, pair) in pairs.iter_mut().enumerate() {
            let (fine, coarse) = (&bands[l], &bands[l + 1]);
            pair.pixels = fine.even.len() as f64;
            let fields = fine.even.iter().zip(&fine.odd).zip(coarse.even.iter().zip(&coarse.odd));
            for ((a, c), ((even, odd), (coarse_even, coarse_odd))) in
                amplitudes[l].iter().zip(&amplitudes[l + 1]).zip(fields)
            {
                let (a, c) = (f64::from(*a), f64::from(*c));
                pair.amplitudes = [pair.amplitudes[0] + a, pair.amplitudes[1] + c];
                pair.squares = [pair.squares[0] + a * a, pair.squares[1] + c * c];
                pair.product += a * c;
                let [ox, oy] = coarse_odd.map(f64::from);
                let length = ox.hypot(oy);
                if length == 0.0 || c == 0.0 {
                    continue;
                }
                let across = (f64::from(odd[0]) * ox + f64::from(odd[1]) * oy) / length;
                let (even, coarse_even) = (f64::from(*even), f64::from(*coarse_even));
                // w² / |w|
                let doubled = [
                    (coarse_even * coarse_even - length * length) / c,
                    2.0 * coarse_even * length / c,
                ];
                pair.phases[0] += even * doubled[0] + across * doubled[1];
                pair.phases[1] += across * doubled[0] - even * doubled[1];
            }
        }
        Self { pairs }
    }

    /// Adds the sums over another image.
    pub(crate) fn add(&mut self, other: &Self) {
        for (to, from) in self.pairs.iter_mut().zip(&other.pairs) {
            to.pixels += from.pixels;
            to.product += from.product;
            for k in 0..2 {
                to.amplitudes[k] += from.amplitudes[k];
                to.squares[k] += from.squares[k];
                to.phases[k] += from.phases[k];
            }
        }
    }

    /// Correlation of the amplitudes of each pair of scales; 0 without variation.
    pub(crate) fn magnitudes(&self) -> [f64; PAIRS] {
        self.pairs.map(|pair| {
            let n = pair.pixels.max(1.0);
            let variance = |k: usize| (pair.squares[k] / n - (pair.amplitudes[k] / n).powi(2)).max(0.0);
            let covariance = pair.product / n - pair.amplitudes[0] / n * pair.amplitudes[1] / n;
            ratio(covariance, (variance(0) * variance(1)).sqrt())
        })
    }

    /// Correlation of the phases of each pair of scales: real and imaginary part.
    pub(crate) fn phases(&self) -> [[f64; 2]; PAIRS] {
        self.pairs.map(|pair| {
            pair.phases
                .map(|part| ratio(part, (pair.squares[0] * pair.squares[1]).sqrt()))
        })
    }
}

fn ratio(part: f64, whole: f64) -> f64 {
    if whole > f64::MIN_POSITIVE { part / whole } else { 0.0 }
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, reason = "values of a test")]
mod tests {
    use super::{CrossScale, PAIRS};
    use crate::texture::monogenic::{MonogenicBand, monogenic_bands};
    use ndarray::Array2;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn of(image: &Array2<f32>) -> CrossScale {
        let bands = monogenic_bands(image, PAIRS + 1);
        let amplitudes: Vec<_> = bands.iter().map(MonogenicBand::amplitude).collect();
        CrossScale::of(&bands, &amplitudes)
    }

    /// Steps of all directions: scales agree in place and phase. The phase is that of an edge, and reversing the
    /// contrast leaves it as it is; lines have the sign of their contrast.
    #[test]
    fn edges_and_lines_have_phases() {
        let disc = |y: usize, x: usize, radius: f64| (y as f64 - 64.2).hypot(x as f64 - 63.7) - radius;
        let edge = Array2::from_shape_fn((128, 128), |(y, x)| (0.5 - disc(y, x, 40.0)).clamp(0.0, 1.0) as f32);
        let line = Array2::from_shape_fn((128, 128), |(y, x)| (-disc(y, x, 40.0).powi(2)).exp() as f32);
        let (edge, dark_edge) = (of(&edge), of(&edge.mapv(|v| 1.0 - v)));
        let (line, dark_line) = (of(&line), of(&line.mapv(|v| 1.0 - v)));
        for l in 0..PAIRS {
            assert!(edge.magnitudes()[l] > 0.8, "{:?}", edge.magnitudes());
            let ([re, im], [dark_re, dark_im]) = (edge.phases()[l], dark_edge.phases()[l]);
            assert!(im < -0.35 && re.abs() < 0.1, "{re} {im}");
            assert!((re + dark_re).abs() < 0.02 && (im - dark_im).abs() < 0.02);
            assert!(
                line.phases()[l][0] > 0.3 && dark_line.phases()[l][0] < -0.3,
                "{:?}",
                line.phases()
            );
        }
    }

    /// White noise has no lines, and its scales are almost independent.
    #[test]
    fn noise_has_little_coherence() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let noise = Array2::from_shape_fn((256, 256), |_| rng.random::<f32>());
        let found = of(&noise);
        for l in 0..PAIRS {
            // Amplitudes of about 65,536 / 16 independent places; 5 standard errors.
            assert!(found.magnitudes()[l] < 0.25, "{:?}", found.magnitudes());
            assert!(found.phases()[l][0].abs() < 0.08, "{:?}", found.phases());
        }
    }
}
