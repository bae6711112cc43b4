//! Results of a comparison: figures with their floors, and the curves behind them.

/// One measure of a solid and its exemplar.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figure {
    /// Value of the solid's slices; `None` if it cannot be measured (no fringe inside a slice, slices smaller than the
    /// patches).
    pub value: Option<f64>,
    /// Value of a perfect solid: 0 for a distance, 1 for a ratio, else the exemplar's own value.
    pub ideal: Option<f64>,
    /// Distance from the ideal of one half of the exemplar compared with the other, mean over left and right halves and
    /// upper and lower ones. A solid at that distance cannot be distinguished from the exemplar.
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
    /// The curves from which the figures are computed.
    pub curves: Curves,
}

impl Comparison {
    /// The figures by name, in order.
    #[must_use]
    pub fn figures(&self) -> [(&'static str, Figure); 15] {
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
        ]
    }

    /// The figures in the order of [`Comparison::figures`].
    pub(super) fn figures_mut(&mut self) -> [&mut Figure; 15] {
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
