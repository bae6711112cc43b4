//! What kind of ground a photo has, and how far every pixel differs from it.

use std::f32::consts::TAU;

use ndarray::Array2;
use stereology_imaging::{connected_components, gaussian_filter_rgb};

use crate::conversions::single;
use crate::error::SegmentError;
use crate::ground::binder::{BinderModel, length};
use crate::ground::faint::faint_regions;
use crate::ground::rims::{hidden_by_blur, without_rims};
use crate::ground::tones::{TONE_DISTANCE, TwoTones, densest, main_colours, mean_depth};
use crate::labels::split::{contrast_depth, shape_depth};
use crate::options::{BinderChoice, Holes, SegmentOptions};
use crate::outlines::half_contrast::{SHARP, half_contrast};
use crate::outlines::regions::{fill_holes, hysteresis, open};

/// Least fraction of the photo that a binder covers.
pub(crate) const LEAST_COVERED: f64 = 0.2;
/// Factor of the thresholds where no binder forms a mode of its own.
const NEAR: f32 = 0.5;
/// Factor of the thresholds of faint regions: hardly any mean of the binder over many pixels is farther than three and
/// a half standard deviations.
const FAINT: f32 = 0.7;
/// Least scatter, sRGB / 255, while outlines are drawn: four levels.
const HUE_SCATTER: f64 = 4.0 / 255.0;
/// A pixel of at least this multiple of the high threshold is no part of a faint particle: it is a particle too small
/// for its outline.
const CLEARLY: f32 = 2.0;
/// Fraction of the distance of two tones at which touching particles are apart.
const CLEAR: f32 = 0.7;
/// Iterations of refining outlines: the third moves them by less than a tenth of a pixel.
const ITERATIONS: usize = 3;
/// Holes of less than a twentieth of their region's area are filled before it is split.
const HOLE_PART: usize = 20;
/// Distance of two tones over the sum of their scatters from which they are two: 1.48 occurs in gravel, 1.62 to 1.85 in
/// tomograms and thin sections.
const TWO_TONES: f64 = 1.55;
/// Slope of the borders between two tones from which they are edges, as a fraction of that of a step with the photo's
/// point spread: 0.4 to 0.5 occurs in shaded pebbles, 0.8 to 0.95 in tomograms and thin sections.
const TONE_EDGE: f32 = 0.6;
/// Variance, pixels², of the blur that differences over two pixels beside a border amount to; slopes of steps blurred
/// by 0.5 to 1.5 pixels are correct within 1 % with it.
const DIFFERENCES: f32 = 0.62;

/// What lies between the particles, by which each later step has its own parameters.
#[derive(Clone, Debug)]
pub(crate) enum Ground {
    /// A binder whose colour forms a mode of its own, or was given.
    Binder(Box<BinderModel>),
    /// The tone of a photo of two tones that forms the thinner structures.
    TwoTones,
    /// The most frequent colour of a photo without such a mode: its colours overlap with those of particles.
    Densest,
}

/// A photo as differences from its ground.
#[derive(Clone, Debug)]
pub(crate) struct Seen {
    pub(crate) ground: Ground,
    /// Distance z of every pixel to the ground, in standard deviations.
    pub(crate) distance: Array2<f32>,
    /// Difference of every pixel from the ground, scaled by the scatter with which outlines are drawn.
    pub(crate) deviation: Array2<[f32; 3]>,
    /// Low and high hysteresis threshold of the distance.
    pub(crate) thresholds: [f32; 2],
    /// Fraction of the photo's pixels that are ground.
    pub(crate) covered: f64,
    /// Whether the rest is clearly separated from the ground.
    pub(crate) is_clear: bool,
}

/// The binder as the options choose it: found in the smoothed photo, or fitted near a given colour.
pub(crate) fn chosen_binder(colours: &Array2<[f32; 3]>, options: &SegmentOptions) -> Result<BinderModel, SegmentError> {
    match options.binder {
        BinderChoice::Found => Ok(BinderModel::fit(colours, options.seed)),
        BinderChoice::Colour(colour) => Ok(BinderModel::fit_near(colours, colour.map(single))),
        BinderChoice::MainColour(number) => {
            let main = main_colours(colours, options.seed);
            let (colour, _) = main.get(number).ok_or(SegmentError::Option {
                option: "binder",
                value: number as f64,
                requirement: "a main colour of the photo is numbered from 0, and there are at most eight",
            })?;
            Ok(BinderModel::fit_near(colours, *colour))
        }
    }
}

impl Seen {
    /// Chooses the ground: the binder if it is given or clearly separated from the rest; else two tones with sharp
    /// borders; else the most frequent colour, if enough differs from it clearly; else the binder after all.
    pub(crate) fn new(
        image: &Array2<[f32; 3]>,
        colours: &Array2<[f32; 3]>,
        binder: BinderModel,
        spread: f32,
        options: &SegmentOptions,
    ) -> Self {
        let given = options.binder != BinderChoice::Found;
        let seen = Self::by_binder(colours, binder, given, spread, options);
        if seen.is_clear || given {
            return seen;
        }
        let Ground::Binder(binder) = &seen.ground else {
            return seen;
        };
        Self::by_two_tones(image, binder, spread, options)
            .or_else(|| Self::by_densest(colours, options))
            .unwrap_or(seen)
    }

    fn by_binder(
        colours: &Array2<[f32; 3]>,
        binder: BinderModel,
        given: bool,
        spread: f32,
        options: &SegmentOptions,
    ) -> Self {
        let binder = with_compression(binder, options);
        let distance = binder.distance(colours);
        let [low, high] = options.thresholds;
        let is_connected = given || surrounds(&distance.mapv(|z| z < low));
        let hue = options.compression.map_or(0.0, |c| c.hue_spread());
        let distance = without_rims(&distance, options.smoothing.hypot(spread).hypot(hue));
        Self {
            is_clear: is_connected && stands_out(&distance, options.thresholds),
            deviation: binder.blunted(HUE_SCATTER).deviation(colours),
            distance,
            thresholds: [low, high],
            covered: binder.covered(),
            ground: Ground::Binder(Box::new(binder)),
        }
    }

    /// `None` if the photo, its light evened by that of a binder and smoothed half as much, has not two tones with
    /// sharp borders.
    fn by_two_tones(
        image: &Array2<[f32; 3]>,
        light: &BinderModel,
        spread: f32,
        options: &SegmentOptions,
    ) -> Option<Self> {
        let smoothing = 0.5 * options.smoothing;
        let smoothed = gaussian_filter_rgb(image.view(), smoothing);
        let even = light.even_light(&smoothed);
        let tones = TwoTones::find(&even, options.seed).filter(|t| t.separation() > TWO_TONES)?;
        let binder = tones.binder(&even);
        let deviation = binder.deviation(&even);
        let mut distance = deviation.mapv(length);
        if edge_slope(&distance) <= TONE_EDGE * step_slope(spread.hypot(smoothing)) {
            return None;
        }
        tones.lower_beyond(&binder, &even, &mut distance);
        let [low, _] = options.thresholds;
        Some(Self {
            ground: Ground::TwoTones,
            distance,
            deviation,
            thresholds: [low, 1.2 * low],
            covered: binder.covered(),
            is_clear: true,
        })
    }

    /// `None` if the most frequent colour covers little, or little differs from it clearly.
    fn by_densest(colours: &Array2<[f32; 3]>, options: &SegmentOptions) -> Option<Self> {
        let binder = with_compression(BinderModel::fit_near(colours, densest(colours)), options);
        let distance = binder.distance(colours);
        let thresholds = options.thresholds.map(|z| NEAR * z);
        let is_clear = binder.covered() > LEAST_COVERED
            && surrounds(&distance.mapv(|z| z < thresholds[0]))
            && stands_out(&distance, thresholds);
        is_clear.then(|| Self {
            ground: Ground::Densest,
            deviation: binder.blunted(HUE_SCATTER).deviation(colours),
            distance,
            thresholds,
            covered: binder.covered(),
            is_clear,
        })
    }

    /// Regions that reach the high threshold, as far as the low one.
    pub(crate) fn regions(&self) -> Array2<bool> {
        let [low, high] = self.thresholds;
        hysteresis(&self.distance, low, high)
    }

    /// The regions with their outlines at half contrast and, beside a binder, faint regions added; their distances
    /// become those seen over many pixels.
    pub(crate) fn outlined(
        &mut self,
        mut mask: Array2<bool>,
        colours: &Array2<[f32; 3]>,
        spread: f32,
        options: &SegmentOptions,
    ) -> Array2<bool> {
        self.clean(&mut mask, options);
        // The first outline follows the threshold, so that its cores hold blurred rims; later iterations have cleaner
        // ones.
        let blur = options.smoothing.hypot(spread.max(SHARP));
        for _ in 0..self.iterations() {
            mask = half_contrast(&self.deviation, &mask, blur);
        }
        if let Ground::Binder(binder) = &self.ground {
            let hidden = hidden_by_blur(&self.distance, &mask, CLEARLY * self.thresholds[1], blur);
            let thresholds = self.thresholds.map(|z| FAINT * z);
            let faint = faint_regions(colours, binder, &hidden, thresholds, options.compression);
            mask.zip_mut_with(&faint, |m, z| *m |= *z > 0.0);
            self.distance.zip_mut_with(&faint, |d, z| *d = d.max(*z));
        }
        self.clean(&mut mask, options);
        mask
    }

    /// Fills small holes and removes what is thinner than three pixels. Larger holes may be binder between particles
    /// that touch, and any hole between two tones may be: those are left until labels are known.
    fn clean(&self, mask: &mut Array2<bool>, options: &SegmentOptions) {
        if options.holes == Holes::Fill && !matches!(self.ground, Ground::TwoTones) {
            fill_holes(mask, |hole, around| hole <= options.min_area.max(around / HOLE_PART));
        }
        open(mask);
    }

    fn iterations(&self) -> usize {
        match self.ground {
            Ground::Binder(_) | Ground::Densest => ITERATIONS,
            Ground::TwoTones => 1,
        }
    }

    /// Depth of parts by which touching particles are split.
    pub(crate) fn depth(&self, parts: &Array2<u32>) -> Array2<f32> {
        match self.ground {
            Ground::TwoTones => contrast_depth(&self.distance, parts, CLEAR * TONE_DISTANCE),
            Ground::Binder(_) | Ground::Densest => shape_depth(parts),
        }
    }
}

/// A binder with the errors of the photo's compression added to its scatter.
fn with_compression(binder: BinderModel, options: &SegmentOptions) -> BinderModel {
    match options.compression {
        Some(compression) => binder.with_errors(&compression.covariance(f64::from(options.smoothing))),
        None => binder,
    }
}

/// Slope at a step of height 1 blurred by a Gaussian of `sigma` pixels, as [`edge_slope`] measures it.
fn step_slope(sigma: f32) -> f32 {
    1.0 / (TAU * (sigma * sigma + DIFFERENCES)).sqrt()
}

/// Median slope, across the border between two tones at half their distance, of the distance to one of them, in tone
/// distances per pixel. 0 if there is no border.
fn edge_slope(distance: &Array2<f32>) -> f32 {
    let (height, width) = distance.dim();
    let half = 0.5 * TONE_DISTANCE;
    let mut slopes = Vec::new();
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let beyond = distance[[y, x]] >= half;
            if beyond != (distance[[y, x + 1]] >= half) || beyond != (distance[[y + 1, x]] >= half) {
                let across = |j: usize| distance[[j, x + 1]] - distance[[j, x - 1]];
                let down = |i: usize| distance[[y + 1, i]] - distance[[y - 1, i]];
                // Sobel's means of three rows and columns.
                let dx = across(y - 1) + 2.0 * across(y) + across(y + 1);
                let dy = down(x - 1) + 2.0 * down(x) + down(x + 1);
                slopes.push(dx.hypot(dy) / (8.0 * TONE_DISTANCE));
            }
        }
    }
    let middle = slopes.len() / 2;
    if slopes.is_empty() {
        return 0.0;
    }
    *slopes.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// Whether a mask can be the binder: its largest connected component holds at least a third of it; and where most of
/// the rest is connected too, the mask forms the thinner structures.
fn surrounds(mask: &Array2<bool>) -> bool {
    let rest = mask.mapv(|m| !m);
    let fraction = rest.iter().filter(|m| **m).count() as f64 / rest.len() as f64;
    let is_tangled = fraction > 0.35 && fraction_in_largest(&rest) > 0.5;
    fraction_in_largest(mask) > 1.0 / 3.0 && !(is_tangled && mean_depth(mask) > mean_depth(&rest))
}

/// Fraction of a mask in its largest connected component.
fn fraction_in_largest(mask: &Array2<bool>) -> f64 {
    let (components, count) = connected_components(mask.view(), |m| m);
    let mut areas = vec![0_usize; count as usize + 1];
    components.iter().for_each(|&c| areas[c as usize] += 1);
    let all: usize = areas[1..].iter().sum();
    areas[1..]
        .iter()
        .max()
        .map_or(0.0, |largest| *largest as f64 / all as f64)
}

/// Whether the distances to the binder have two modes: there are at least 0.6 times as many pixels beyond the high
/// threshold as between the two.
fn stands_out(distance: &Array2<f32>, [low, high]: [f32; 2]) -> bool {
    let beyond = distance.iter().filter(|z| **z >= high).count();
    let between = distance.iter().filter(|z| **z >= low && **z < high).count();
    beyond as f64 > 0.6 * between as f64
}
