//! The binder: its colour under uneven light and its scatter, from which every particle differs.

use ndarray::{Array2, Axis};
use rayon::prelude::*;

use crate::conversions::single;
use crate::ground::kmeans::kmeans;
use crate::ground::light::{
    Sample, Surface, TERMS, colour_at, fit_surface, identity, inverse_factor, place, sample, scatter,
};

/// Robust fit of the binder's colour: a quadratic surface of light in each channel of encoded values, and the scatter
/// around it.
///
/// # Formula
///
/// ```text
/// b(x, y) = c₀ + c₁u + c₂v + c₃u² + c₄uv + c₅v²,    u, v in −1..1 across the photo
/// z(p) = √((p − b)ᵀ Σ⁻¹ (p − b))
/// ```
///
/// # References
///
/// Rousseeuw & Leroy 1987 for the trimmed, reweighted covariance. Jagnow, Dorsey & Rushmeier 2004, section 4.2, segment
/// by hand.
#[derive(Clone, Debug, PartialEq)]
pub struct BinderModel {
    surface: Surface,
    /// Lower triangular W with Σ⁻¹ = WᵀW.
    whitening: [[f64; 3]; 3],
    size: (usize, usize),
    fraction: f64,
    spread: f64,
}

/// Colours from which a binder is sought.
pub(crate) const GUESSES: usize = 8;
/// Distance beyond which a pixel does not count as binder while fitting.
const GATE: f64 = 3.0;
/// Scatter that is small for a photo, sRGB / 255: it is added to the scatter in the score of a candidate, so that
/// scatter below it hardly matters.
const WIDE: f64 = 3.0 / 255.0;
/// Initial standard deviation around a starting colour, sRGB / 255.
const FIRST_DEVIATION: f64 = 8.0 / 255.0;

impl BinderModel {
    /// Finds the binder: k-means of the colours gives eight starting colours, a model is fitted robustly from each, and
    /// the one with the most pixels for its scatter is returned.
    ///
    /// # Complexity
    ///
    /// A sample of about 16,000 pixels is used, whatever the size of the photo.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_segment::{BinderModel, encoded_image};
    ///
    /// // A grey binder, lit from the left, with a white square in it.
    /// let photo = image::RgbImage::from_fn(64, 64, |x, y| {
    ///     let level = if (20..30).contains(&x) && (20..30).contains(&y) { 250 } else { 100 + x as u8 / 2 + (x * 7 + y * 5) as u8 % 3 };
    ///     image::Rgb([level; 3])
    /// });
    /// let image = encoded_image(&photo);
    /// let binder = BinderModel::fit(&image, 0);
    /// let distance = binder.distance(&image);
    /// assert!(distance[[25, 25]] > 20.0 && distance[[50, 5]] < 4.0 && distance[[50, 60]] < 4.0);
    /// ```
    #[must_use]
    pub fn fit(image: &Array2<[f32; 3]>, seed: u64) -> Self {
        let samples = sample(image);
        let colours: Vec<[f64; 3]> = samples.iter().map(|s| s.colour).collect();
        let guesses = kmeans(&colours, GUESSES, seed).centres;
        let fits: Vec<(f64, Self)> = guesses
            .par_iter()
            .map(|guess| {
                let model = Self::from_guess(&samples, *guess, image.dim());
                (model.score(), model)
            })
            .collect();
        let mut best = Self {
            surface: [[0.0; TERMS]; 3],
            whitening: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            size: image.dim(),
            fraction: 0.0,
            spread: f64::INFINITY,
        };
        let mut best_score = f64::NEG_INFINITY;
        for (score, model) in fits {
            if score > best_score {
                (best_score, best) = (score, model);
            }
        }
        best
    }

    /// Fits light and scatter to pixels near a given colour, sRGB / 255, only: for a binder whose colour is known, or
    /// whose colours overlap with those of the particles, where [`fit`](Self::fit) would cover both.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_segment::{BinderModel, encoded_image};
    ///
    /// // Grey of every level, but most pixels near 100.
    /// let photo = image::RgbImage::from_fn(100, 100, |x, y| {
    ///     let n = (x * 7919 ^ y * 104_729) % 199;
    ///     image::Rgb([if n < 99 { 96 + (n % 9) as u8 } else { n as u8 }; 3])
    /// });
    /// let binder = BinderModel::fit_near(&encoded_image(&photo), [0.4; 3]);
    /// assert!((binder.light(50, 50)[0] * 255.0 - 100.0).abs() < 5.0 && binder.spread() < 8.0 / 255.0);
    /// ```
    #[must_use]
    pub fn fit_near(image: &Array2<[f32; 3]>, colour: [f32; 3]) -> Self {
        let samples = sample(image);
        let mut model = Self::flat(colour.map(f64::from), FIRST_DEVIATION, image.dim(), 0.0);
        let fixed = model.whitening;
        for terms in [1, 3, 3, TERMS, TERMS, TERMS] {
            model.whitening = fixed;
            // The given colour is near the binder's mean: it may shift with the light, but not to another mode.
            if !model.fit_round(&samples, 2.0, terms) {
                break;
            }
        }
        model
    }

    /// Fits this binder's light and scatter to another image of the same scene, such as one at another scale; pixels
    /// that are not numbers are left out.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_imaging::gaussian_filter_rgb;
    /// use stereology_segment::{BinderModel, encoded_image};
    ///
    /// let photo = image::RgbImage::from_fn(64, 64, |x, y| image::Rgb([90 + ((x * 7919 ^ y * 104_729) % 21) as u8; 3]));
    /// let image = encoded_image(&photo);
    /// let binder = BinderModel::fit(&image, 0);
    /// assert!(binder.refit(&gaussian_filter_rgb(image.view(), 2.0)).spread() < 0.5 * binder.spread());
    /// ```
    #[must_use]
    pub fn refit(&self, image: &Array2<[f32; 3]>) -> Self {
        let mut samples = sample(image);
        samples.retain(|s| s.colour.iter().all(|c| c.is_finite()));
        let mut model = Self {
            size: image.dim(),
            ..self.clone()
        };
        for _ in 0..4 {
            model.fit_round(&samples, GATE, TERMS);
        }
        model
    }

    /// The same binder with a scatter of at least `deviation`, sRGB / 255, in every direction of colour. JPEG stores
    /// hue at half the resolution of lightness, and binders scatter little in hue: outlines drawn with the true scatter
    /// would follow hue alone.
    #[must_use]
    pub fn blunted(&self, deviation: f64) -> Self {
        let variance = deviation * deviation;
        self.with_errors(&[[variance, 0.0, 0.0], [0.0, variance, 0.0], [0.0, 0.0, variance]])
    }

    /// The same binder with the covariance of errors added to that of its colours.
    pub(crate) fn with_errors(&self, errors: &[[f64; 3]; 3]) -> Self {
        let [[a, ..], [b, c, _], [d, e, f]] = self.whitening;
        // Inverse of the lower triangle W, whose product with its transpose is Σ.
        let (l00, l11, l22) = (1.0 / a, 1.0 / c, 1.0 / f);
        let l10 = -b * l00 * l11;
        let l21 = -e * l11 * l22;
        let l20 = -(d * l00 + e * l10) * l22;
        let mut covariance = [
            [l00 * l00, 0.0, 0.0],
            [l10 * l00, l10 * l10 + l11 * l11, 0.0],
            [l20 * l00, l20 * l10 + l21 * l11, l20 * l20 + l21 * l21 + l22 * l22],
        ];
        covariance
            .iter_mut()
            .zip(errors)
            .for_each(|(row, errors)| row.iter_mut().zip(errors).for_each(|(c, e)| *c += e));
        Self {
            whitening: inverse_factor(&covariance, 0.0),
            ..self.clone()
        }
    }

    /// Fits surface and scatter to the samples within `gate` standard deviations, if there are enough.
    pub(crate) fn fit_round(&mut self, samples: &[Sample], gate: f64, terms: usize) -> bool {
        let inside: Vec<&Sample> = samples
            .iter()
            .filter(|s| self.squared(s.place, s.colour) < gate * gate)
            .collect();
        if inside.len() < 50 {
            return false;
        }
        self.surface = fit_surface(&inside, terms);
        self.fraction = inside.len() as f64 / samples.len() as f64;
        (self.whitening, self.spread) = scatter(&self.surface, &inside);
        true
    }

    /// A binder of one colour and the same scatter in each channel.
    pub(crate) fn flat(colour: [f64; 3], deviation: f64, size: (usize, usize), fraction: f64) -> Self {
        let surface = colour.map(|c| [c, 0.0, 0.0, 0.0, 0.0, 0.0]);
        Self {
            surface,
            whitening: identity(1.0 / deviation),
            size,
            fraction,
            spread: deviation,
        }
    }

    fn from_guess(samples: &[Sample], guess: [f64; 3], size: (usize, usize)) -> Self {
        // Starts with a wide gate around the starting colour; each iteration fits the pixels that the previous one
        // accepts.
        let mut model = Self {
            spread: f64::INFINITY,
            ..Self::flat(guess, FIRST_DEVIATION, size, 0.0)
        };
        for (round, terms) in [1, 1, 3, 3, TERMS, TERMS, TERMS, TERMS].into_iter().enumerate() {
            let gate = if round < 2 { 2.0 } else { GATE };
            if !model.fit_round(samples, gate, terms) {
                break;
            }
        }
        model
    }

    /// Colour of the binder at a pixel, light included.
    #[must_use]
    pub fn light(&self, x: usize, y: usize) -> [f32; 3] {
        self.at(self.place(x, y)).map(single)
    }

    /// [`light`](Self::light) along a row: what depends on the row alone is computed once.
    fn light_along(&self, y: usize) -> impl Fn(usize) -> [f32; 3] {
        let [_, v] = self.place(0, y);
        let row = self
            .surface
            .map(|c| [c[0] + v * (c[2] + v * c[5]), c[1] + v * c[4], c[3]].map(single));
        let width = self.size.1 as f32;
        move |x| {
            let u = (2 * x + 1) as f32 / width - 1.0;
            row.map(|c| c[0] + u * (c[1] + u * c[2]))
        }
    }

    /// Fraction of pixels divided by scatter: a wide cloud of colours contains many pixels of any material.
    fn score(&self) -> f64 {
        self.fraction / (self.spread() + WIDE)
    }

    /// The image under even light: the difference between the surface and its mean over the photo is subtracted.
    #[must_use]
    pub fn even_light(&self, image: &Array2<[f32; 3]>) -> Array2<[f32; 3]> {
        // Means of u² and v² over −1..1 are a third, of the other terms zero.
        let mean = self.surface.map(|c| single(c[0] + (c[3] + c[5]) / 3.0));
        let mut out = image.clone();
        out.axis_iter_mut(Axis(0))
            .into_par_iter()
            .enumerate()
            .for_each(|(y, mut row)| {
                let light = self.light_along(y);
                for (x, p) in row.iter_mut().enumerate() {
                    let light = light(x);
                    (0..3).for_each(|c| p[c] -= light[c] - mean[c]);
                }
            });
        out
    }

    /// Fraction of the photo's pixels that are binder.
    #[must_use]
    pub fn covered(&self) -> f64 {
        self.fraction
    }

    /// Standard deviation of the binder's colour around its surface, the root mean square of the three channels, sRGB /
    /// 255.
    #[must_use]
    pub fn spread(&self) -> f64 {
        self.spread
    }

    /// Difference of every pixel from the binder at that place, scaled by the binder's scatter: a vector whose length
    /// is the robust distance z.
    #[must_use]
    pub fn deviation(&self, image: &Array2<[f32; 3]>) -> Array2<[f32; 3]> {
        let mut out = image.clone();
        let w = self.whitening.map(|row| row.map(single));
        out.axis_iter_mut(Axis(0))
            .into_par_iter()
            .enumerate()
            .for_each(|(y, mut row)| {
                let light = self.light_along(y);
                for (x, p) in row.iter_mut().enumerate() {
                    let b = light(x);
                    let d = [p[0] - b[0], p[1] - b[1], p[2] - b[2]];
                    *p = [
                        w[0][0] * d[0],
                        w[1][0] * d[0] + w[1][1] * d[1],
                        w[2][0] * d[0] + w[2][1] * d[1] + w[2][2] * d[2],
                    ];
                }
            });
        out
    }

    /// Robust distance z of every pixel to the binder, in standard deviations.
    ///
    /// # Complexity
    ///
    /// Linear in pixels.
    ///
    /// # Examples
    ///
    /// See [`BinderModel::fit`].
    #[must_use]
    pub fn distance(&self, image: &Array2<[f32; 3]>) -> Array2<f32> {
        self.deviation(image).mapv(length)
    }

    pub(crate) fn place(&self, x: usize, y: usize) -> [f64; 2] {
        place(x, y, self.size)
    }

    fn at(&self, p: [f64; 2]) -> [f64; 3] {
        colour_at(&self.surface, p)
    }

    pub(crate) fn squared(&self, place: [f64; 2], colour: [f64; 3]) -> f64 {
        let b = self.at(place);
        let d = [colour[0] - b[0], colour[1] - b[1], colour[2] - b[2]];
        self.whitening
            .iter()
            .map(|w| (w[0] * d[0] + w[1] * d[1] + w[2] * d[2]).powi(2))
            .sum()
    }
}

/// Euclidean length.
pub(crate) fn length(v: [f32; 3]) -> f32 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}
