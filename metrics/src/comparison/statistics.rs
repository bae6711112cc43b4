//! All statistics of one set of images, with settings that all compared sets share.

use ndarray::{Array2, ArrayView2, ArrayView3, Axis};
use rayon::prelude::*;

use super::error::MeasureError;
use super::options::FringeBand;
use crate::phase::{Chords, chord_lengths, lineal_path, local_porosity, planar_functionals, two_point};
use crate::texture::{
    CrossScale, Fringes, LEAST_SIDE, Moments, MonogenicBand, PAIRS, Patches, fringes, grey, histogram, mean_gradient,
    moments, monogenic_bands, orientation_field,
};

/// Settings that must be the same for all images that are compared.
#[derive(Clone, Copy, Debug)]
pub(super) struct Settings<'a> {
    pub threshold: f32,
    pub band: Option<FringeBand<'a>>,
    /// Longest lag and path, pixels.
    pub reach: usize,
    /// Side of the squares of local porosity.
    pub cell: usize,
    /// Height and width of the windows in which fringes are followed.
    pub window: [usize; 2],
    pub patches: usize,
}

pub(super) const GREY_BINS: usize = 64;
pub(super) const ORIENTATION_BINS: usize = 36;
pub(super) const POROSITY_BINS: usize = 20;
/// Sides of the patches of the sliced Wasserstein distance, pixels.
const PATCHES: [usize; 3] = [7, 16, 31];
/// Largest side of the patches of which all are drawn; of larger ones fewer, so that they have as many samples.
const WHOLE_DRAW: usize = 16;
/// Images of which scales are compared at most: neighbouring slices are almost equal.
const SCALE_IMAGES: usize = 32;
/// Largest part in pixels of an image of which scales are compared.
const SCALE_SIDE: usize = 512;

/// Statistics of a set of images.
#[derive(Debug)]
pub(super) struct Statistics {
    pub grey: Vec<f64>,
    pub moments: Vec<Moments>,
    pub orientation: Vec<f64>,
    pub coherence: f64,
    pub gradient: f64,
    pub fringes: Fringes,
    pub two_point: Array2<f64>,
    /// Along rows, along columns.
    pub lineal_path: [Vec<f64>; 2],
    /// Of the bright and the dark phase.
    pub chords: [Vec<usize>; 2],
    /// Length of the boundary per area, mean Euler number of both connectivities per area.
    pub boundary: f64,
    pub euler: f64,
    /// Sorted.
    pub porosities: Vec<f32>,
    pub patches: [Patches; 3],
    /// `None` if all images are too small.
    pub scales: Option<CrossScale>,
}

/// Statistics of one image.
struct ImageStatistics {
    grey: Vec<f64>,
    pixels: f64,
    moments: Moments,
    /// Pixels that have an orientation.
    oriented: f64,
    orientation: Vec<f64>,
    coherence: f64,
    gradient: f64,
    fringes: Fringes,
    two_point: Array2<f64>,
    lineal_path: [Vec<f64>; 2],
    chords: [Vec<usize>; 2],
    boundary: f64,
    euler: f64,
    porosities: Vec<f32>,
}

impl Statistics {
    /// Statistics of images; `seed` chooses the patches.
    pub(super) fn of(images: &[ArrayView3<'_, f32>], settings: &Settings<'_>, seed: u64) -> Result<Self, MeasureError> {
        let each: Vec<ImageStatistics> = images
            .par_iter()
            .map(|image| image_statistics(image, settings))
            .collect::<Result<_, MeasureError>>()?;
        let mean = |value: &dyn Fn(&ImageStatistics) -> f64| each.iter().map(value).sum::<f64>() / each.len() as f64;
        let weighted = |of: &dyn Fn(&ImageStatistics) -> &Vec<f64>, weight: &dyn Fn(&ImageStatistics) -> f64| {
            let mut sum = vec![0.0; of(&each[0]).len()];
            for one in &each {
                sum.iter_mut().zip(of(one)).for_each(|(s, v)| *s += v * weight(one));
            }
            let total: f64 = each.iter().map(weight).sum();
            sum.iter_mut().for_each(|s| *s /= total.max(f64::MIN_POSITIVE));
            sum
        };
        let mut fringes = Fringes::default();
        let mut two_point = Array2::zeros(each[0].two_point.dim());
        for one in &each {
            fringes.extend(one.fringes.clone());
            two_point += &one.two_point;
        }
        two_point /= each.len() as f64;
        let oriented: f64 = each.iter().map(|p| p.oriented).sum();
        let coherence = each.iter().map(|p| p.coherence * p.oriented).sum::<f64>() / oriented.max(1.0);
        let mut porosities: Vec<f32> = each.iter().flat_map(|p| p.porosities.iter().copied()).collect();
        porosities.sort_unstable_by(f32::total_cmp);
        Ok(Self {
            grey: weighted(&|p| &p.grey, &|p| p.pixels),
            orientation: weighted(&|p| &p.orientation, &|p| p.oriented),
            coherence,
            gradient: mean(&|p| p.gradient),
            fringes,
            two_point,
            lineal_path: [
                weighted(&|p| &p.lineal_path[0], &|p| p.pixels),
                weighted(&|p| &p.lineal_path[1], &|p| p.pixels),
            ],
            chords: [0, 1].map(|k| each.iter().flat_map(|p| p.chords[k].iter().copied()).collect()),
            boundary: mean(&|p| p.boundary),
            euler: mean(&|p| p.euler),
            porosities,
            patches: PATCHES.map(|side| {
                let count = settings.patches * WHOLE_DRAW.pow(2) / side.max(WHOLE_DRAW).pow(2);
                Patches::draw(images, side, count, seed)
            }),
            scales: scales(images),
            moments: each.into_iter().map(|p| p.moments).collect(),
        })
    }

    pub(super) fn deviation(&self) -> f64 {
        self.moments.iter().map(|m| m.deviation).sum::<f64>() / self.moments.len() as f64
    }

    pub(super) fn skewness(&self) -> f64 {
        self.moments.iter().map(|m| m.skewness).sum::<f64>() / self.moments.len() as f64
    }

    /// Chords of the bright (0) or the dark phase (1).
    pub(super) fn chords(&self, phase: usize) -> Option<Chords> {
        Chords::of(&self.chords[phase])
    }
}

/// Dependence of neighbouring scales in the middle of evenly spaced images.
fn scales(images: &[ArrayView3<'_, f32>]) -> Option<CrossScale> {
    let count = images.len().min(SCALE_IMAGES);
    let each: Vec<Option<CrossScale>> = (0..count)
        .into_par_iter()
        .map(|i| {
            let image = images[(2 * i + 1) * images.len() / (2 * count)];
            let middle = [Axis(0), Axis(1)].into_iter().fold(image, |image, axis| {
                let (n, side) = (image.len_of(axis), image.len_of(axis).min(SCALE_SIDE));
                let from = (n - side) / 2;
                image.slice_axis_move(axis, (from..from + side).into())
            });
            if middle.dim().0.min(middle.dim().1) < LEAST_SIDE {
                return None;
            }
            let bands = monogenic_bands(&grey(middle), PAIRS + 1);
            let amplitudes: Vec<Array2<f32>> = bands.iter().map(MonogenicBand::amplitude).collect();
            Some(CrossScale::of(&bands, &amplitudes))
        })
        .collect();
    // In order, so that the sum does not depend on the number of threads.
    each.into_iter().flatten().reduce(|mut sum, one| {
        sum.add(&one);
        sum
    })
}

#[allow(clippy::cast_possible_truncation, reason = "porosities in single precision suffice")]
fn image_statistics(image: &ArrayView3<'_, f32>, settings: &Settings<'_>) -> Result<ImageStatistics, MeasureError> {
    let grey = grey(*image);
    let field = orientation_field(&grey);
    let phase = grey.mapv(|v| v > settings.threshold);
    let mut found = Fringes::default();
    if let Some(band) = settings.band {
        for window in windows(grey.view(), settings.window) {
            let filtered = (band.filter)(window).map_err(MeasureError::Filter)?;
            found.extend(fringes(&filtered, band.period));
        }
    }
    let functionals = planar_functionals(phase.view());
    let dark = phase.map(|bright| !bright);
    let chords = |phase: &Array2<bool>| {
        [1, 0]
            .into_iter()
            .flat_map(|axis| chord_lengths(phase.view(), Axis(axis)))
            .collect()
    };
    let path = |axis| lineal_path(phase.view(), Axis(axis), settings.reach);
    Ok(ImageStatistics {
        grey: histogram(grey.iter().copied(), GREY_BINS),
        pixels: grey.len() as f64,
        moments: moments(&grey),
        oriented: field.angle.iter().filter(|a| !a.is_nan()).count() as f64,
        orientation: field.histogram(ORIENTATION_BINS),
        coherence: field.mean_coherence(),
        gradient: mean_gradient(&grey),
        fringes: found,
        two_point: two_point(phase.view(), settings.reach),
        lineal_path: [path(1), path(0)],
        chords: [chords(&phase), chords(&dark)],
        boundary: functionals.boundary_length,
        euler: (functionals.euler_8 + functionals.euler_4) / 2.0,
        porosities: local_porosity(phase.view(), settings.cell)
            .iter()
            .map(|&fraction| fraction as f32)
            .collect(),
    })
}

/// Windows of one size that together cover an image, overlapping where necessary.
fn windows(image: ArrayView2<'_, f32>, [height, width]: [usize; 2]) -> Vec<ArrayView2<'_, f32>> {
    let starts = |n: usize, side: usize| {
        let number = n.div_ceil(side);
        (0..number).map(move |i| if number == 1 { 0 } else { i * (n - side) / (number - 1) })
    };
    let (h, w) = image.dim();
    let (height, width) = (height.min(h), width.min(w));
    starts(h, height)
        .flat_map(|y| starts(w, width).map(move |x| (y, x)))
        .map(|(y, x)| {
            image
                .slice_axis_move(Axis(0), (y..y + height).into())
                .slice_axis_move(Axis(1), (x..x + width).into())
        })
        .collect()
}
