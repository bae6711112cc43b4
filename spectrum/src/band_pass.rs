//! A band-pass filter of images for one period and one direction, such as that of lattice fringes.

use ndarray::Array2;
use std::f64::consts::PI;

use crate::error::SpectrumError;
use crate::periodic::periodic_component;
use crate::transform::{RealFft, frequency};

/// A band of frequencies about one period, for all directions or about one direction.
///
/// # Formula
///
/// ```text
/// gain(f, φ) = exp(−ln²(f · period) / (2 width²)) · exp(−Δ² / (2 spread²))      Δ: angle from φ to the normal of the fringes (mod π); gain(0) = 0
/// ```
///
/// # References
///
/// Urs et al. 2012, section 3 (the filtered versions of figure 5), after Da Costa et al.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandPass {
    /// Period: distance between neighbouring fringes, pixels.
    pub period: f64,
    /// Standard deviation of the radial gain, in natural logarithms of frequency.
    pub width: f64,
    /// Direction along the fringes (0 to π from the columns' axis) and the standard deviation about it, radians; `None`
    /// for all directions.
    pub direction: Option<(f64, f64)>,
}

impl BandPass {
    /// All directions, half an octave (.35) wide.
    #[must_use]
    pub fn new(period: f64) -> Self {
        Self {
            period,
            width: 0.35,
            direction: None,
        }
    }

    /// Only fringes along `angle`, with the standard deviation `spread`, radians.
    #[must_use]
    pub fn with_direction(self, angle: f64, spread: f64) -> Self {
        Self {
            direction: Some((angle, spread)),
            ..self
        }
    }

    /// The band in which an image has most power per octave, from 3 pixels to a sixth of its side; with a direction
    /// (standard deviation 20 degrees) if most of that power lies about one direction.
    ///
    /// # Errors
    ///
    /// [`SpectrumError`] for an image with values that are not finite, or without pixels.
    ///
    /// # Examples
    ///
    /// ```
    /// use ndarray::Array2;
    /// use stereology_spectrum::BandPass;
    ///
    /// let fringes = Array2::from_shape_fn((96, 96), |(y, _)| (y as f64 * std::f64::consts::TAU / 8.0).cos());
    /// let band = BandPass::of(&fringes)?;
    /// assert!((band.period - 8.0).abs() < 0.5);
    /// let (angle, _) = band.direction.unwrap();
    /// assert!(angle.sin().abs() < 0.05); // along the rows
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the bins"
    )]
    pub fn of(image: &Array2<f64>) -> Result<Self, SpectrumError> {
        let (height, width) = image.dim();
        let spectrum = RealFft::<f64>::new(&[height, width])?.forward(periodic_component(image.view())?.view())?;
        let longest = (height.min(width) as f64 / 6.0).max(6.0);
        // Bins of a quarter octave: bins of one ratio, so their power is proportional to the power per octave.
        let bin_of = |period: f64| 4.0 * (period / 3.0).log2();
        let bins = bin_of(longest).ceil() as usize + 1;
        let mut sums = vec![[0.0; 4]; bins];
        for ((ky, kx), value) in spectrum.indexed_iter() {
            let (fy, fx) = (frequency(ky, height), frequency(kx, width));
            let f = fy.hypot(fx);
            if f <= 0.0 || !(0.0..bins as f64).contains(&bin_of(f.recip())) {
                continue;
            }
            let power = value.norm_sqr() * if kx == 0 || 2 * kx == width { 1.0 } else { 2.0 };
            let angle = fy.atan2(fx);
            let bin = &mut sums[bin_of(f.recip()) as usize];
            let terms = [
                power,
                power * f.ln(),
                power * (2.0 * angle).cos(),
                power * (2.0 * angle).sin(),
            ];
            bin.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        }
        // Neighbouring bins are added, since a peak may lie on an edge.
        let around =
            |i: usize, k: usize| -> f64 { sums[i.saturating_sub(1)..(i + 2).min(bins)].iter().map(|b| b[k]).sum() };
        let best = (0..bins)
            .max_by(|&a, &b| around(a, 0).total_cmp(&around(b, 0)).then(b.cmp(&a)))
            .unwrap_or(0);
        let power = around(best, 0);
        if power <= 0.0 {
            return Ok(Self::new(longest));
        }
        let band = Self::new((-around(best, 1) / power).exp());
        let (c, s) = (around(best, 2) / power, around(best, 3) / power);
        // The length of the mean vector of doubled directions: 1 for one direction, 0 if all directions are equally
        // strong.
        Ok(if c.hypot(s) > 0.5 {
            let normal = 0.5 * s.atan2(c);
            band.with_direction((normal + PI / 2.0).rem_euclid(PI), 20_f64.to_radians())
        } else {
            band
        })
    }

    /// Gain at a frequency, in cycles per pixel along x (the columns' axis) and y.
    ///
    /// ```
    /// use stereology_spectrum::BandPass;
    ///
    /// let band = BandPass::new(8.0);
    /// assert_eq!((band.gain(0.125, 0.0), band.gain(0.0, 0.0)), (1.0, 0.0));
    /// let flat = band.with_direction(0.0, 0.3);
    /// assert!(flat.gain(0.0, 0.125) > 0.999 && flat.gain(0.125, 0.0) < 1e-5);
    /// ```
    #[must_use]
    pub fn gain(&self, fx: f64, fy: f64) -> f64 {
        let f = fx.hypot(fy);
        if f <= 0.0 {
            return 0.0;
        }
        let bell = |distance: f64, width: f64| (-0.5 * (distance / width).powi(2)).exp();
        let radial = bell((f * self.period).ln(), self.width);
        self.direction.map_or(radial, |(angle, spread)| {
            let normal = angle + PI / 2.0;
            let difference = (fy.atan2(fx) - normal + PI / 2.0).rem_euclid(PI) - PI / 2.0;
            radial * bell(difference, spread)
        })
    }

    /// The image reduced to the band, with values about zero. The image's periodic component is filtered, so that jumps
    /// between opposite borders leave no trace.
    ///
    /// # Errors
    ///
    /// [`SpectrumError`] for an image with values that are not finite, or without pixels.
    ///
    /// ```
    /// use ndarray::Array2;
    /// use stereology_spectrum::BandPass;
    ///
    /// let wave = |period: f64| Array2::from_shape_fn((64, 64), move |(y, _)| (y as f64 * std::f64::consts::TAU / period).sin());
    /// let filtered = BandPass::new(8.0).filter(&(&wave(8.0) + &wave(32.0) + 0.5))?;
    /// let error = (&filtered - &wave(8.0)).mapv(|v| v * v).mean().unwrap().sqrt();
    /// assert!(error < 0.1); // the long wave and the mean are gone
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn filter(&self, image: &Array2<f64>) -> Result<Array2<f64>, SpectrumError> {
        let (height, width) = image.dim();
        let fft = RealFft::<f64>::new(&[height, width])?;
        let mut spectrum = fft.forward(periodic_component(image.view())?.view())?;
        for ((ky, kx), value) in spectrum.indexed_iter_mut() {
            *value = value.scale(self.gain(frequency(kx, width), frequency(ky, height)));
        }
        fft.inverse(spectrum)
    }
}
