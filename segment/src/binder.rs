//! The binder: the colour everything else is told apart from, under light that is not even.

use ndarray::{Array2, Axis};
use rayon::prelude::*;

use crate::{
    distance::distance_transform,
    kmeans::{kmeans, nearest_centre, squared_distance},
};

/// Terms of a quadratic surface.
const TERMS: usize = 6;

/// Robust fit of the binder's colour: a quadratic surface of light in each channel of encoded values, and the scatter around it.
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
/// Jagnow, Dorsey & Rushmeier 2004, section 4.2 segments by hand; the trimmed covariance is that of Rousseeuw's reweighting (1987).
#[derive(Clone, Debug, PartialEq)]
pub struct BinderModel {
    surface: [[f64; TERMS]; 3],
    /// Lower triangular W with Σ⁻¹ = WᵀW.
    whitening: [[f64; 3]; 3],
    size: (usize, usize),
    share: f64,
    spread: f64,
}

/// A pixel of the sample: place in −1..1 and colour.
#[derive(Clone, Copy)]
struct Sample {
    place: [f64; 2],
    colour: [f64; 3],
}

/// Distance z of the tones of [`BinderModel::fit_two_tones`].
pub(crate) const TONE_DISTANCE: f32 = 9.0;
/// Colours that k-means begins with.
const GUESSES: usize = 8;
/// Pixels in the sample, at least, where the photo has as many.
const SAMPLE: usize = 16_000;
/// Distance beyond which a pixel does not count as binder while fitting.
const GATE: f64 = 3.0;
/// Least standard deviation: half a grey level of an 8-bit picture.
const LEAST_DEVIATION: f64 = 0.5 / 255.0;
/// Scatter that is small for a photo: at this, twice the pixels outweigh twice the scatter.
const WIDE: f64 = 3.0 / 255.0;
/// Standard deviation around a guess to start from.
const FIRST_DEVIATION: f64 = 8.0 / 255.0;

impl BinderModel {
    /// Finds the binder: k-means of the colours gives eight guesses, each is fitted robustly, and the one with most pixels for its scatter is taken.
    ///
    /// # Complexity
    ///
    /// A sample of 16,000 pixels is looked at, whatever the size of the photo.
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
    /// let picture = encoded_image(&photo);
    /// let binder = BinderModel::fit(&picture, 0);
    /// let distance = binder.distance(&picture);
    /// assert!(distance[[25, 25]] > 20.0 && distance[[50, 5]] < 4.0 && distance[[50, 60]] < 4.0);
    /// ```
    #[must_use]
    pub fn fit(picture: &Array2<[f32; 3]>, seed: u64) -> Self {
        let samples = sample(picture);
        let colours: Vec<[f64; 3]> = samples.iter().map(|s| s.colour).collect();
        let guesses = kmeans(&colours, GUESSES, seed).centres;
        let fits: Vec<(f64, Self)> = guesses
            .par_iter()
            .map(|guess| {
                let model = Self::from_guess(&samples, *guess, picture.dim());
                (model.score(), model)
            })
            .collect();
        let mut best = Self {
            surface: [[0.0; TERMS]; 3],
            whitening: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            size: picture.dim(),
            share: 0.0,
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

    /// Fits light and scatter to pixels near a given colour, sRGB / 255, and no further: for a binder that is known, or whose colours go over into those of the particles without a gap, where
    /// [`fit`](Self::fit) would spread over both.
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
    pub fn fit_near(picture: &Array2<[f32; 3]>, colour: [f32; 3]) -> Self {
        let samples = sample(picture);
        let mut model = Self::flat(colour.map(f64::from), FIRST_DEVIATION, picture.dim());
        let fixed = model.whitening;
        for terms in [1, 3, 3, TERMS, TERMS, TERMS] {
            model.whitening = fixed;
            // The given colour is near the middle of the photo's: it may shift by what light does, not to another heap.
            if !model.fit_round(&samples, 2.0, terms) {
                break;
            }
        }
        model
    }

    /// For a photo of two tones, such as a tomogram or a thin section, where neither is narrow enough for [`fit`](Self::fit): k-means finds the tones, and the binder is the one in thinner threads. Halfway between
    /// them lies at z = 4.5, half of what separates them. The second value is the distance of the tones over the sum of their scatters; below about 2 they are not two.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_segment::{BinderModel, encoded_image};
    ///
    /// // Pale squares of 20 pixels, 5 apart, both with strong texture.
    /// let photo = image::RgbImage::from_fn(100, 100, |x, y| {
    ///     let level = if x % 25 < 20 && y % 25 < 20 { 160 } else { 60 };
    ///     image::Rgb([level + ((x * 7919 + y * 104_729) % 41) as u8; 3])
    /// });
    /// let picture = encoded_image(&photo);
    /// let (binder, apart) = BinderModel::fit_two_tones(&picture, 0);
    /// assert!(apart > 2.0 && binder.distance(&picture)[[10, 10]] > 6.0);
    /// ```
    #[must_use]
    pub fn fit_two_tones(picture: &Array2<[f32; 3]>, seed: u64) -> (Self, f64) {
        let samples = sample(picture);
        let colours: Vec<[f64; 3]> = samples.iter().map(|s| s.colour).collect();
        let tones = kmeans(&colours, 2, seed);
        let [a, b] = *tones.centres.as_slice() else {
            return (
                Self::flat(tones.centres.first().copied().unwrap_or([0.0; 3]), 1.0, picture.dim()),
                0.0,
            );
        };
        let step = squared_distance(&a, &b).sqrt();
        let is_a = picture.mapv(|p| nearest_centre(&p.map(f64::from), &[a, b]) == 0);
        let (thin, group) = if mean_depth(&is_a) <= mean_depth(&is_a.mapv(|m| !m)) {
            (a, 0)
        } else {
            (b, 1)
        };
        let spread = (tones.inertia / samples.len() as f64).sqrt();
        let mut model = Self::flat(thin, step / f64::from(TONE_DISTANCE), picture.dim());
        model.share = tones.assignment.iter().filter(|g| **g == group).count() as f64 / samples.len() as f64;
        (model, step / (2.0 * spread))
    }

    /// This binder's light and scatter fitted again to a picture of the same scene, such as one at another scale; pixels that are not numbers are left out.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_segment::{BinderModel, encoded_image, smooth};
    ///
    /// let photo = image::RgbImage::from_fn(64, 64, |x, y| image::Rgb([90 + ((x * 7919 ^ y * 104_729) % 21) as u8; 3]));
    /// let picture = encoded_image(&photo);
    /// let binder = BinderModel::fit(&picture, 0);
    /// assert!(binder.refit(&smooth(&picture, 2.0)).spread() < 0.5 * binder.spread());
    /// ```
    #[must_use]
    pub fn refit(&self, picture: &Array2<[f32; 3]>) -> Self {
        let mut samples = sample(picture);
        samples.retain(|s| s.colour.iter().all(|c| c.is_finite()));
        let mut model = Self {
            size: picture.dim(),
            ..self.clone()
        };
        for _ in 0..4 {
            model.fit_round(&samples, GATE, TERMS);
        }
        model
    }

    /// The same binder with at least `deviation`, sRGB / 255, of scatter in every direction of colour. Photos keep hue at half the resolution of lightness, and binders scatter little in hue: outlines drawn with
    /// the true scatter would follow hue alone.
    #[must_use]
    pub fn blunted(&self, deviation: f64) -> Self {
        let [[a, ..], [b, c, _], [d, e, f]] = self.whitening;
        // Inverse of the lower triangle W, whose product with its transpose is Σ.
        let (l00, l11, l22) = (1.0 / a, 1.0 / c, 1.0 / f);
        let l10 = -b * l00 * l11;
        let l21 = -e * l11 * l22;
        let l20 = -(d * l00 + e * l10) * l22;
        let covariance = [
            [l00 * l00, 0.0, 0.0],
            [l10 * l00, l10 * l10 + l11 * l11, 0.0],
            [l20 * l00, l20 * l10 + l21 * l11, l20 * l20 + l21 * l21 + l22 * l22],
        ];
        Self {
            whitening: inverse_factor(&covariance, deviation * deviation),
            ..self.clone()
        }
    }

    /// Fits surface and scatter to the samples within `gate` standard deviations, if there are enough.
    fn fit_round(&mut self, samples: &[Sample], gate: f64, terms: usize) -> bool {
        let inside: Vec<&Sample> = samples
            .iter()
            .filter(|s| self.squared(s.place, s.colour) < gate * gate)
            .collect();
        if inside.len() < 50 {
            return false;
        }
        self.surface = fit_surface(&inside, terms);
        self.share = inside.len() as f64 / samples.len() as f64;
        (self.whitening, self.spread) = scatter(self, &inside);
        true
    }

    /// A binder of one colour and the same scatter in each channel.
    fn flat(colour: [f64; 3], deviation: f64, size: (usize, usize)) -> Self {
        let surface = colour.map(|c| [c, 0.0, 0.0, 0.0, 0.0, 0.0]);
        Self {
            surface,
            whitening: identity(1.0 / deviation),
            size,
            share: 0.0,
            spread: deviation,
        }
    }

    fn from_guess(samples: &[Sample], guess: [f64; 3], size: (usize, usize)) -> Self {
        // Start wide around the guess; each round fits what the last round calls binder.
        let mut model = Self {
            surface: guess.map(|c| [c, 0.0, 0.0, 0.0, 0.0, 0.0]),
            whitening: identity(1.0 / FIRST_DEVIATION),
            size,
            share: 0.0,
            spread: f64::INFINITY,
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
        self.at(self.place(x, y)).map(|c| c as f32)
    }

    /// Pixels for their scatter: a wide cloud holds many pixels of anything.
    fn score(&self) -> f64 {
        self.share / (self.spread() + WIDE)
    }

    /// The picture under even light: what the surface adds to its mean over the photo's width and height is taken away.
    #[must_use]
    pub fn even_light(&self, picture: &Array2<[f32; 3]>) -> Array2<[f32; 3]> {
        // Means of u² and v² over −1..1 are a third, of the other terms zero.
        let mean = self.surface.map(|c| (c[0] + (c[3] + c[5]) / 3.0) as f32);
        let mut out = picture.clone();
        out.axis_iter_mut(Axis(0))
            .into_par_iter()
            .enumerate()
            .for_each(|(y, mut row)| {
                for (x, p) in row.iter_mut().enumerate() {
                    let light = self.light(x, y);
                    (0..3).for_each(|c| p[c] -= light[c] - mean[c]);
                }
            });
        out
    }

    /// Share of the photo's pixels that are binder, 0 to 1.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.share
    }

    /// Standard deviation of the binder's colour around its surface, the root mean square of the three channels, sRGB / 255.
    #[must_use]
    pub fn spread(&self) -> f64 {
        self.spread
    }

    /// Difference of every pixel to the binder there, in units of the binder's scatter: a vector whose length is the robust distance z.
    #[must_use]
    pub fn deviation(&self, picture: &Array2<[f32; 3]>) -> Array2<[f32; 3]> {
        let mut out = picture.clone();
        let w = self.whitening.map(|row| row.map(|v| v as f32));
        out.axis_iter_mut(Axis(0))
            .into_par_iter()
            .enumerate()
            .for_each(|(y, mut row)| {
                for (x, p) in row.iter_mut().enumerate() {
                    let b = self.light(x, y);
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
    pub fn distance(&self, picture: &Array2<[f32; 3]>) -> Array2<f32> {
        self.deviation(picture).mapv(length)
    }

    fn place(&self, x: usize, y: usize) -> [f64; 2] {
        place(x, y, self.size)
    }

    fn at(&self, p: [f64; 2]) -> [f64; 3] {
        let basis = basis(p);
        self.surface.map(|c| c.iter().zip(basis).map(|(c, b)| c * b).sum())
    }

    fn squared(&self, place: [f64; 2], colour: [f64; 3]) -> f64 {
        let b = self.at(place);
        let d = [colour[0] - b[0], colour[1] - b[1], colour[2] - b[2]];
        self.whitening
            .iter()
            .map(|w| (w[0] * d[0] + w[1] * d[1] + w[2] * d[2]).powi(2))
            .sum()
    }
}

/// The photo's eight main colours by k-means, sRGB / 255, and the share of pixels nearest to each, most first: to choose the binder from. Fewer if there are fewer.
///
/// # Examples
///
/// ```
/// use stereology_segment::{encoded_image, main_colours};
///
/// let photo = image::RgbImage::from_fn(40, 40, |x, _| image::Rgb([if x < 30 { 200 } else { 50 }; 3]));
/// let colours = main_colours(&encoded_image(&photo), 0);
/// assert_eq!((colours.len(), colours[0].1), (2, 0.75));
/// ```
#[must_use]
pub fn main_colours(picture: &Array2<[f32; 3]>, seed: u64) -> Vec<([f32; 3], f64)> {
    let colours: Vec<[f64; 3]> = sample(picture).iter().map(|s| s.colour).collect();
    let groups = kmeans(&colours, GUESSES, seed);
    let share = |g: usize| groups.assignment.iter().filter(|a| **a == g).count() as f64 / colours.len() as f64;
    let main = groups.centres.iter().enumerate();
    main.map(|(g, centre)| (centre.map(|c| c as f32), share(g))).collect()
}

/// Colour of the densest spot of a picture's colours: the middle of the fullest cube of eight levels' side.
pub(crate) fn densest(picture: &Array2<[f32; 3]>) -> [f32; 3] {
    let mut counts = vec![0_u32; 32 * 32 * 32];
    let level = |v: f32| ((v * 32.0) as usize).min(31);
    for s in sample(picture) {
        let [r, g, b] = s.colour.map(|c| level(c as f32));
        counts[(r * 32 + g) * 32 + b] += 1;
    }
    let fullest = (0..counts.len())
        .max_by_key(|&i| (counts[i], std::cmp::Reverse(i)))
        .unwrap_or(0);
    [fullest / 1024, fullest / 32 % 32, fullest % 32].map(|l| (l as f32 + 0.5) / 32.0)
}

/// Mean distance of a mask's pixels to its outline: threads are shallow, particles deep.
pub(crate) fn mean_depth(mask: &Array2<bool>) -> f64 {
    let depths = distance_transform(mask);
    let inside = depths.iter().filter(|d| **d > 0.0 && d.is_finite());
    let (sum, count) = inside.fold((0.0, 0.0), |(sum, count), d| (sum + f64::from(*d), count + 1.0));
    sum / f64::max(count, 1.0)
}

/// Euclidean length.
pub(crate) fn length(v: [f32; 3]) -> f32 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

fn identity(scale: f64) -> [[f64; 3]; 3] {
    [[scale, 0.0, 0.0], [0.0, scale, 0.0], [0.0, 0.0, scale]]
}

fn place(x: usize, y: usize, (height, width): (usize, usize)) -> [f64; 2] {
    [
        (2 * x + 1) as f64 / width as f64 - 1.0,
        (2 * y + 1) as f64 / height as f64 - 1.0,
    ]
}

fn basis([u, v]: [f64; 2]) -> [f64; TERMS] {
    [1.0, u, v, u * u, u * v, v * v]
}

/// Pixels on a square lattice.
fn sample(picture: &Array2<[f32; 3]>) -> Vec<Sample> {
    let (height, width) = picture.dim();
    let step = ((height * width / SAMPLE) as f64).sqrt().floor().max(1.0) as usize;
    let at = |n: usize| (step / 2..n).step_by(step);
    at(height)
        .flat_map(|y| at(width).map(move |x| (x, y)))
        .map(|(x, y)| Sample {
            place: place(x, y, (height, width)),
            colour: picture[[y, x]].map(f64::from),
        })
        .collect()
}

/// Least squares with a little shrinkage of slopes and curvatures, so that a binder seen in one corner is not extrapolated wildly.
fn fit_surface(inside: &[&Sample], terms: usize) -> [[f64; TERMS]; 3] {
    let mut normal = [[0.0; TERMS]; TERMS];
    let mut right = [[0.0; TERMS]; 3];
    for s in inside {
        let b = basis(s.place);
        for i in 0..terms {
            for j in 0..=i {
                normal[i][j] += b[i] * b[j];
            }
            for (right, colour) in right.iter_mut().zip(s.colour) {
                right[i] += b[i] * colour;
            }
        }
    }
    let shrinkage = 1e-3 * inside.len() as f64;
    (1..terms).for_each(|i| normal[i][i] += shrinkage);
    // Cholesky: the matrix is positive definite (at least 50 samples, shrinkage).
    for i in 0..terms {
        for j in 0..=i {
            let inner: f64 = (0..j).map(|k| normal[i][k] * normal[j][k]).sum();
            let rest = normal[i][j] - inner;
            normal[i][j] = if i == j {
                rest.max(1e-12).sqrt()
            } else {
                rest / normal[j][j]
            };
        }
    }
    right.map(|mut r| {
        for i in 0..terms {
            let inner: f64 = (0..i).map(|k| normal[i][k] * r[k]).sum();
            r[i] = (r[i] - inner) / normal[i][i];
        }
        for i in (0..terms).rev() {
            let inner: f64 = (i + 1..terms).map(|k| normal[k][i] * r[k]).sum();
            r[i] = (r[i] - inner) / normal[i][i];
        }
        r
    })
}

/// Inverse Cholesky factor of the covariance around the surface, and its standard deviation. The covariance gives the shape, the median distance the scale, so that particles of a colour near the binder's do
/// not widen it; it is kept above the quantisation.
fn scatter(model: &BinderModel, inside: &[&Sample]) -> ([[f64; 3]; 3], f64) {
    let mut cov = [[0.0; 3]; 3];
    for s in inside {
        let b = model.at(s.place);
        let d = [s.colour[0] - b[0], s.colour[1] - b[1], s.colour[2] - b[2]];
        for i in 0..3 {
            for j in 0..=i {
                cov[i][j] += d[i] * d[j];
            }
        }
    }
    cov.iter_mut().flatten().for_each(|v| *v /= inside.len() as f64);
    let floor = LEAST_DEVIATION * LEAST_DEVIATION;
    let w = inverse_factor(&cov, floor);
    // Channels that scatter: 1 for a grey photo, 3 for a coloured one.
    let dimension = (3.0 - w.iter().flatten().map(|v| v * v).sum::<f64>() * floor).clamp(1.0, 3.0);
    let mut squares: Vec<f64> = inside
        .iter()
        .map(|s| {
            let b = model.at(s.place);
            let d = [s.colour[0] - b[0], s.colour[1] - b[1], s.colour[2] - b[2]];
            w.iter()
                .map(|w| (w[0] * d[0] + w[1] * d[1] + w[2] * d[2]).powi(2))
                .sum()
        })
        .collect();
    let middle = squares.len() / 2;
    let (_, median, _) = squares.select_nth_unstable_by(middle, f64::total_cmp);
    // Median of chi squared of one and of three degrees of freedom, cut at the gate.
    let expected = 0.4515 + (dimension - 1.0) * 0.914;
    let scale = *median / expected;
    cov.iter_mut().flatten().for_each(|v| *v *= scale);
    (
        inverse_factor(&cov, floor),
        ((cov[0][0] + cov[1][1] + cov[2][2]) / 3.0 + floor).sqrt(),
    )
}

/// Lower triangular W with WᵀW the inverse of a covariance, given by its lower triangle, plus `floor` on the diagonal.
fn inverse_factor(cov: &[[f64; 3]; 3], floor: f64) -> [[f64; 3]; 3] {
    let mut cov = *cov;
    (0..3).for_each(|i| cov[i][i] += floor);
    let l00 = cov[0][0].sqrt();
    let (l10, l20) = (cov[1][0] / l00, cov[2][0] / l00);
    let l11 = (cov[1][1] - l10 * l10).max(1e-12).sqrt();
    let l21 = (cov[2][1] - l20 * l10) / l11;
    let l22 = (cov[2][2] - l20 * l20 - l21 * l21).max(1e-12).sqrt();
    // Inverse of a lower triangle.
    let (w00, w11, w22) = (1.0 / l00, 1.0 / l11, 1.0 / l22);
    let w10 = -l10 * w00 * w11;
    let w21 = -l21 * w11 * w22;
    let w20 = -(l20 * w00 + l21 * w10) * w22;
    [[w00, 0.0, 0.0], [w10, w11, 0.0], [w20, w21, w22]]
}
