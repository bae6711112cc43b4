//! All statistics of one set of pictures, under settings shared by all sets that are compared.

use super::comparison::MeasureError;
use super::{
    BandPass, Fringes, Moments, Patches, chord_lengths, fringes, grey, histogram, lineal_path, local_porosity,
    mean_gradient, moments, orientation_field, two_point,
};
use ndarray::{Array2, ArrayView2, ArrayView3, Axis};
use rayon::prelude::*;

/// What must be the same for all pictures that are compared.
#[derive(Clone, Copy, Debug)]
pub(super) struct Settings {
    pub threshold: f32,
    pub band: BandPass,
    /// Longest lag and path, pixels.
    pub reach: usize,
    /// Side of the squares of local porosity.
    pub cell: usize,
    /// Height and width in which fringes are followed.
    pub window: [usize; 2],
    pub patches: usize,
}

pub(super) const GREY_BINS: usize = 64;
pub(super) const ORIENTATION_BINS: usize = 36;
pub(super) const POROSITY_BINS: usize = 20;

/// Statistics of a set of pictures.
#[derive(Debug)]
pub(super) struct Portrait {
    pub grey: Vec<f64>,
    pub moments: Vec<Moments>,
    pub orientation: Vec<f64>,
    pub coherence: f64,
    pub gradient: f64,
    pub fringes: Fringes,
    pub two_point: Array2<f64>,
    /// Along rows, along columns.
    pub lineal_path: [Vec<f64>; 2],
    pub chords: Vec<usize>,
    /// Sorted.
    pub porosities: Vec<f32>,
    pub patches: [Patches; 2],
}

/// Statistics of one picture.
struct Page {
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
    chords: Vec<usize>,
    porosities: Vec<f32>,
}

impl Portrait {
    /// Pictures as drawn; `seed` chooses the patches.
    pub(super) fn of(pictures: &[ArrayView3<'_, f32>], settings: &Settings, seed: u64) -> Result<Self, MeasureError> {
        let pages: Vec<Page> = pictures
            .par_iter()
            .map(|picture| page(picture, settings))
            .collect::<Result<_, MeasureError>>()?;
        let mean = |value: &dyn Fn(&Page) -> f64| pages.iter().map(value).sum::<f64>() / pages.len() as f64;
        let weighted = |of: &dyn Fn(&Page) -> &Vec<f64>, weight: &dyn Fn(&Page) -> f64| {
            let mut sum = vec![0.0; of(&pages[0]).len()];
            for page in &pages {
                sum.iter_mut().zip(of(page)).for_each(|(s, v)| *s += v * weight(page));
            }
            let total: f64 = pages.iter().map(weight).sum();
            sum.iter_mut().for_each(|s| *s /= total.max(f64::MIN_POSITIVE));
            sum
        };
        let mut fringes = Fringes::default();
        let mut two_point = Array2::zeros(pages[0].two_point.dim());
        for page in &pages {
            fringes.extend(page.fringes.clone());
            two_point += &page.two_point;
        }
        two_point /= pages.len() as f64;
        let oriented: f64 = pages.iter().map(|p| p.oriented).sum();
        let coherence = pages.iter().map(|p| p.coherence * p.oriented).sum::<f64>() / oriented.max(1.0);
        let mut porosities: Vec<f32> = pages.iter().flat_map(|p| p.porosities.iter().copied()).collect();
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
            chords: pages.iter().flat_map(|p| p.chords.iter().copied()).collect(),
            porosities,
            patches: [7, 16].map(|side| Patches::draw(pictures, side, settings.patches, seed)),
            moments: pages.into_iter().map(|p| p.moments).collect(),
        })
    }

    pub(super) fn deviation(&self) -> f64 {
        self.moments.iter().map(|m| m.deviation).sum::<f64>() / self.moments.len() as f64
    }

    pub(super) fn skewness(&self) -> f64 {
        self.moments.iter().map(|m| m.skewness).sum::<f64>() / self.moments.len() as f64
    }

    pub(super) fn mean_chord(&self) -> Option<f64> {
        let n = self.chords.len();
        (n > 0).then(|| self.chords.iter().map(|&c| c as f64).sum::<f64>() / n as f64)
    }
}

#[allow(clippy::cast_possible_truncation, reason = "porosities in single precision suffice")]
fn page(picture: &ArrayView3<'_, f32>, settings: &Settings) -> Result<Page, MeasureError> {
    let grey = grey(*picture);
    let field = orientation_field(&grey);
    let phase = grey.mapv(|v| v > settings.threshold);
    let indicator = phase.mapv(|here| f64::from(u8::from(here)));
    let mut found = Fringes::default();
    for window in windows(grey.view(), settings.window) {
        let filtered = settings.band.filter(&window.mapv(f64::from))?;
        found.extend(fringes(&filtered, settings.band.period));
    }
    let path = |axis| lineal_path(phase.view(), Axis(axis), settings.reach);
    Ok(Page {
        grey: histogram(grey.iter().copied(), GREY_BINS),
        pixels: grey.len() as f64,
        moments: moments(&grey),
        oriented: field.angle.iter().filter(|a| !a.is_nan()).count() as f64,
        orientation: field.histogram(ORIENTATION_BINS),
        coherence: field.mean_coherence(),
        gradient: mean_gradient(&grey),
        fringes: found,
        two_point: two_point(indicator.view(), settings.reach)?,
        lineal_path: [path(1), path(0)],
        chords: [1, 0]
            .into_iter()
            .flat_map(|axis| chord_lengths(phase.view(), Axis(axis)))
            .collect(),
        porosities: local_porosity(phase.view(), settings.cell)
            .iter()
            .map(|&share| share as f32)
            .collect(),
    })
}

/// Windows of one size that together cover a picture, overlapping where they must.
fn windows(picture: ArrayView2<'_, f32>, [height, width]: [usize; 2]) -> Vec<ArrayView2<'_, f32>> {
    let starts = |n: usize, side: usize| {
        let number = n.div_ceil(side);
        (0..number).map(move |i| if number == 1 { 0 } else { i * (n - side) / (number - 1) })
    };
    let (h, w) = picture.dim();
    let (height, width) = (height.min(h), width.min(w));
    starts(h, height)
        .flat_map(|y| starts(w, width).map(move |x| (y, x)))
        .map(|(y, x)| {
            picture
                .slice_axis_move(Axis(0), (y..y + height).into())
                .slice_axis_move(Axis(1), (x..x + width).into())
        })
        .collect()
}
