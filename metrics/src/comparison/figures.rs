//! Results of a comparison: figures with their floors and levels, and the curves behind them.

use crate::level::Level;

/// One measure of a solid and its exemplar.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figure {
    /// Value of the solid's slices; `None` if it cannot be measured (no fringe inside a slice, slices smaller than the
    /// patches).
    pub value: Option<f64>,
    /// Value of a perfect solid: 0 for a distance, 1 for a ratio, else the exemplar's own value.
    pub ideal: Option<f64>,
    /// Distance from the ideal of one half of the exemplar compared with the other, mean over left and right halves,
    /// upper and lower ones, and both pairs of opposite quarters. A solid at that distance cannot be distinguished from
    /// the exemplar by this figure.
    pub floor: Option<f64>,
}

impl Figure {
    /// Distance of the value from the ideal, in floors: at most about 1 if the solid cannot be distinguished from the
    /// exemplar.
    ///
    /// ```
    /// use stereology_metrics::Figure;
    ///
    /// let figure = Figure { value: Some(0.9), ideal: Some(1.0), floor: Some(0.05) };
    /// assert!((figure.in_floors().unwrap() - 2.0).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn in_floors(&self) -> Option<f64> {
        Some((self.value? - self.ideal?).abs() / self.floor.filter(|floor| *floor > 0.0)?)
    }
}

/// Floors from the ideal up to which a figure is good, and up to which it needs care. If a figure of a solid of the
/// exemplar's material is normally distributed, with the variance of a half of the exemplar divided by its area, it is
/// beyond 2 floors in 7 % of the cases and beyond 4 in 1.2 %, since the floor is the mean of three differences.
const GOOD: f64 = 2.0;
const CARE: f64 = 4.0;
/// Figures that are bad before the whole comparison is bad. If they were independent, one of 23 figures would be bad by
/// chance in 24 % of the cases, two in 3 %, three in .3 %.
const BAD: usize = 3;

impl Figure {
    /// [`Level::Good`] up to 2 floors from the ideal, [`Level::Care`] up to 4, else [`Level::Bad`]; `None` without a
    /// value or a floor.
    ///
    /// ```
    /// use stereology_metrics::{Figure, Level};
    ///
    /// let figure = Figure { value: Some(0.85), ideal: Some(1.0), floor: Some(0.05) };
    /// assert_eq!(figure.level(), Some(Level::Care));
    /// ```
    #[must_use]
    pub fn level(&self) -> Option<Level> {
        self.in_floors().map(|floors| {
            if floors <= GOOD {
                Level::Good
            } else if floors <= CARE {
                Level::Care
            } else {
                Level::Bad
            }
        })
    }
}

/// All figures of a solid.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Divergence of the grey-level histogram (64 bins), nats.
    pub kl_grey: Figure,
    /// Standard deviation of grey, mean of the slices, over the exemplar's.
    pub std_ratio: Figure,
    /// Skewness of grey, mean of the slices.
    pub skewness: Figure,
    /// Divergence of the histogram of orientations (36 bins), nats.
    pub kl_orientation: Figure,
    /// Mean coherence of the orientations.
    pub coherence: Figure,
    /// Mean length of the fringes that lie inside a window, pixels.
    pub fringe_length: Figure,
    /// Mean length of fringes by their ends, without the window's bias, pixels.
    pub fringe_length_by_ends: Figure,
    /// Mean tortuosity of fringes.
    pub tortuosity: Figure,
    /// Root mean square difference of the two-point correlations S2 of the bright phase over all lags within reach.
    pub s2: Figure,
    /// Largest difference of the lineal paths of the bright phase, along rows and along columns.
    pub lineal_path: Figure,
    /// Mean chord of the bright phase, rows and columns, over the exemplar's.
    pub chord_ratio: Figure,
    /// Wasserstein distance of the local porosities.
    pub local_porosity: Figure,
    /// Sliced Wasserstein distance of 7 × 7 patches.
    pub swd7: Figure,
    /// Sliced Wasserstein distance of 16 × 16 patches.
    pub swd16: Figure,
    /// Mean gradient over the exemplar's; below 1 the solid is blurred.
    pub gradient_ratio: Figure,
    /// Sliced Wasserstein distance of 31 × 31 patches.
    pub swd31: Figure,
    /// Root mean square difference of the correlations of the amplitudes of octave bands at neighbouring scales.
    pub scale_magnitudes: Figure,
    /// Root mean square difference of the correlations of the phases of octave bands at neighbouring scales.
    pub scale_phases: Figure,
    /// Length of the boundary between the phases, over the exemplar's.
    pub boundary_ratio: Figure,
    /// Euler number of the bright phase per 10,000 pixels: components minus holes, mean of both connectivities.
    pub euler: Figure,
    /// Mean chord of the dark phase, rows and columns, over the exemplar's.
    pub dark_chord_ratio: Figure,
    /// Standard deviation of the chords of the bright phase over their mean.
    pub chord_variation: Figure,
    /// Standard deviation of the chords of the dark phase over their mean.
    pub dark_chord_variation: Figure,
    /// The curves from which the figures are computed.
    pub curves: Curves,
}

impl Comparison {
    /// [`Level::Bad`] if at least three figures are, [`Level::Care`] if two are, else [`Level::Good`]; with the name of
    /// the figure that is most floors from its ideal. `None` if no figure has a level.
    #[must_use]
    pub fn verdict(&self) -> Option<(Level, &'static str)> {
        let figures = self.figures();
        let bad = figures
            .iter()
            .filter(|(_, figure)| figure.level() == Some(Level::Bad))
            .count();
        let floors = figures
            .iter()
            .filter_map(|(name, figure)| Some((*name, figure.in_floors()?)));
        let (worst, _) = floors.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let level = match bad {
            0 | 1 => Level::Good,
            2..BAD => Level::Care,
            _ => Level::Bad,
        };
        Some((level, worst))
    }

    /// The figures by name, in order.
    #[must_use]
    pub fn figures(&self) -> [(&'static str, Figure); 23] {
        [
            ("kl_grey", self.kl_grey),
            ("std_ratio", self.std_ratio),
            ("skewness", self.skewness),
            ("kl_orientation", self.kl_orientation),
            ("coherence", self.coherence),
            ("fringe_length", self.fringe_length),
            ("fringe_length_by_ends", self.fringe_length_by_ends),
            ("tortuosity", self.tortuosity),
            ("s2", self.s2),
            ("lineal_path", self.lineal_path),
            ("chord_ratio", self.chord_ratio),
            ("local_porosity", self.local_porosity),
            ("swd7", self.swd7),
            ("swd16", self.swd16),
            ("gradient_ratio", self.gradient_ratio),
            ("swd31", self.swd31),
            ("scale_magnitudes", self.scale_magnitudes),
            ("scale_phases", self.scale_phases),
            ("boundary_ratio", self.boundary_ratio),
            ("euler", self.euler),
            ("dark_chord_ratio", self.dark_chord_ratio),
            ("chord_variation", self.chord_variation),
            ("dark_chord_variation", self.dark_chord_variation),
        ]
    }

    /// The figures in the order of [`Comparison::figures`].
    pub(super) fn figures_mut(&mut self) -> [&mut Figure; 23] {
        [
            &mut self.kl_grey,
            &mut self.std_ratio,
            &mut self.skewness,
            &mut self.kl_orientation,
            &mut self.coherence,
            &mut self.fringe_length,
            &mut self.fringe_length_by_ends,
            &mut self.tortuosity,
            &mut self.s2,
            &mut self.lineal_path,
            &mut self.chord_ratio,
            &mut self.local_porosity,
            &mut self.swd7,
            &mut self.swd16,
            &mut self.gradient_ratio,
            &mut self.swd31,
            &mut self.scale_magnitudes,
            &mut self.scale_phases,
            &mut self.boundary_ratio,
            &mut self.euler,
            &mut self.dark_chord_ratio,
            &mut self.chord_variation,
            &mut self.dark_chord_variation,
        ]
    }
}

/// Curves of exemplar and solid, each pair `[exemplar, solid]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curves {
    /// Fractions of grey levels in equal bins of 0 to 1.
    pub grey: [Vec<f64>; 2],
    /// Fractions of orientations; bin k is centred at 180 k / 36 degrees from the columns' axis.
    pub orientation: [Vec<f64>; 2],
    /// S2 of the bright phase by distance, pixels.
    pub two_point: [Vec<f64>; 2],
    /// S2 at lags along the columns' axis.
    pub two_point_along: [Vec<f64>; 2],
    /// S2 at lags along the rows' axis (downwards).
    pub two_point_across: [Vec<f64>; 2],
    /// Lineal path of the bright phase by length, mean of rows and columns.
    pub lineal_path: [Vec<f64>; 2],
    /// Fractions of chords of 1, 2, ... pixels, rows and columns together.
    pub chords: [Vec<f64>; 2],
    /// The same of the dark phase.
    pub dark_chords: [Vec<f64>; 2],
    /// Correlation of the amplitudes of neighbouring octave bands, finest pair first; empty for images of less than 32
    /// pixels.
    pub scale_magnitudes: [Vec<f64>; 2],
    /// Correlation of their phases, real and imaginary part of each pair: lines and edges.
    pub scale_phases: [Vec<f64>; 2],
    /// Fractions of squares by local porosity, in equal bins of 0 to 1.
    pub local_porosity: [Vec<f64>; 2],
    /// Lengths of fringes inside windows, pixels, sorted.
    pub fringe_lengths: [Vec<f64>; 2],
    /// Their tortuosities, sorted.
    pub tortuosities: [Vec<f64>; 2],
    /// Standard deviation of each slice.
    pub deviations: [Vec<f64>; 2],
    /// Skewness of each slice.
    pub skewnesses: [Vec<f64>; 2],
    /// Grey level above which a pixel belongs to the bright phase.
    pub threshold: f32,
    /// Side of the squares of local porosity, pixels.
    pub cell: usize,
    /// Period of the fringes, pixels; `None` if no band was given.
    pub period: Option<f64>,
    /// Direction of the fringes, degrees from the columns' axis, if they have one.
    pub direction: Option<f64>,
    /// Height and width of the windows in which fringes are followed, pixels.
    pub window: [usize; 2],
}
