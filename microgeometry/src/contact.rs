//! Contact distributions: a signed histogram of how far the points of two regions lie from the interface between them.

use serde::{Deserialize, Serialize};

use crate::conversions::whole_part;
use crate::error::MicrogeometryError;
use stereology_metrics::wasserstein_of_bins;

/// Most bins a region may have.
pub const MOST_BINS: usize = 4096;

/// Radial contact distributions of two regions, merged (section 4.3 and figure 9 of the paper).
///
/// `positive[k]` is the fraction of all points that lie in the positive region at a distance in [k b, (k+1) b) from the
/// negative one, b the bin width; `negative[k]` likewise in the negative region. All fractions sum to 1. Distances are
/// in *distribution units*: pixels, or the length unit of the pixel size.
///
/// # Examples
///
/// ```
/// use stereology_microgeometry::ContactDistribution;
///
/// let grains = ContactDistribution::new(1.0, vec![3.0, 1.0], vec![2.0, 1.0, 1.0])?;
/// assert_eq!(grains.positive_share(), 0.5);
/// assert_eq!(grains.negative(), [0.375, 0.125]);
/// assert!(ContactDistribution::new(1.0, vec![0.0], vec![-1.0]).is_err());
/// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ContactDistribution {
    bin_width: f64,
    negative: Vec<f64>,
    positive: Vec<f64>,
}

/// The file's structure.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Written {
    #[serde(default)]
    schema: String,
    bin_width: f64,
    negative: Vec<f64>,
    positive: Vec<f64>,
}

/// The file's `schema`.
const SCHEMA: &str = "stereology.contact-distribution/1";

impl ContactDistribution {
    /// Frequencies of any sum, from the interface outwards; empty bins at the ends are dropped.
    ///
    /// # Errors
    ///
    /// [`MicrogeometryError`] if a frequency is negative or not finite, all are zero, there are more than
    /// [`MOST_BINS`], or the width is not a positive length.
    pub fn new(bin_width: f64, mut negative: Vec<f64>, mut positive: Vec<f64>) -> Result<Self, MicrogeometryError> {
        if !(bin_width.is_finite() && bin_width > 0.0) {
            return Err(MicrogeometryError::BinWidth(bin_width));
        }
        for (side, of) in [("negative", &mut negative), ("positive", &mut positive)] {
            if let Some(bin) = of.iter().position(|f| !(f.is_finite() && *f >= 0.0)) {
                let value = of[bin];
                return Err(MicrogeometryError::Frequency { side, bin, value });
            }
            while of.last().is_some_and(|last| *last <= 0.0) {
                of.pop();
            }
            if of.len() > MOST_BINS {
                let (bins, most) = (of.len(), MOST_BINS);
                return Err(MicrogeometryError::TooManyBins { bins, most });
            }
        }
        let largest = negative.iter().chain(&positive).fold(0.0_f64, |most, f| most.max(*f));
        if largest <= 0.0 {
            return Err(MicrogeometryError::EmptyDistribution);
        }
        let mut made = Self {
            bin_width,
            negative,
            positive,
        };
        if !made.total().is_finite() {
            made.scale(largest.recip());
        }
        // Normalised frequencies keep their bits, so files are read as they were written.
        if (made.total() - 1.0).abs() > 1e-12 {
            made.scale(made.total().recip());
        }
        Ok(made)
    }

    fn total(&self) -> f64 {
        self.negative.iter().chain(&self.positive).sum()
    }

    fn scale(&mut self, by: f64) {
        for f in self.negative.iter_mut().chain(&mut self.positive) {
            *f *= by;
        }
    }

    /// From signed distances with weights.
    ///
    /// # Errors
    ///
    /// As [`ContactDistribution::new`]; a distance that is not finite counts as beyond the last bin.
    pub fn from_distances(
        bin_width: f64,
        distances: impl IntoIterator<Item = (f64, f64)>,
    ) -> Result<Self, MicrogeometryError> {
        if !(bin_width.is_finite() && bin_width > 0.0) {
            return Err(MicrogeometryError::BinWidth(bin_width));
        }
        let (mut negative, mut positive) = (Vec::new(), Vec::new());
        for (distance, weight) in distances {
            let bin = (distance.abs() / bin_width).floor();
            if bin.is_nan() || bin >= MOST_BINS as f64 {
                let (bins, most) = (whole_part(bin.min(1e15)), MOST_BINS);
                return Err(MicrogeometryError::TooManyBins { bins, most });
            }
            let side = if distance.is_sign_negative() {
                &mut negative
            } else {
                &mut positive
            };
            let bin = whole_part(bin);
            if side.len() <= bin {
                side.resize(bin + 1, 0.0);
            }
            side[bin] += weight;
        }
        Self::new(bin_width, negative, positive)
    }

    /// Width b of a bin, distribution units.
    #[must_use]
    pub fn bin_width(&self) -> f64 {
        self.bin_width
    }

    /// Fractions of the negative region, from the interface outwards.
    #[must_use]
    pub fn negative(&self) -> &[f64] {
        &self.negative
    }

    /// Fractions of the positive region, from the interface outwards.
    #[must_use]
    pub fn positive(&self) -> &[f64] {
        &self.positive
    }

    /// Area fraction (volume fraction) of the positive region.
    #[must_use]
    pub fn positive_share(&self) -> f64 {
        self.positive.iter().sum()
    }

    /// The positive region's own contact distribution: the probability that a point of it is nearer than r = b, 2 b,
    /// ... to the negative one (eq. 1 of the paper).
    #[must_use]
    pub fn positive_contact(&self) -> Vec<f64> {
        cumulated(&self.positive)
    }

    /// The negative region's own contact distribution, as [`positive_contact`](Self::positive_contact).
    #[must_use]
    pub fn negative_contact(&self) -> Vec<f64> {
        cumulated(&self.negative)
    }

    /// With distances multiplied by `factor`: the material magnified.
    ///
    /// # Errors
    ///
    /// [`MicrogeometryError::BinWidth`] if the resulting width is not positive and finite.
    pub fn magnified(&self, factor: f64) -> Result<Self, MicrogeometryError> {
        Self::new(self.bin_width * factor, self.negative.clone(), self.positive.clone())
    }

    /// The regions exchanged.
    #[must_use]
    pub fn inverted(&self) -> Self {
        Self {
            bin_width: self.bin_width,
            negative: self.positive.clone(),
            positive: self.negative.clone(),
        }
    }

    /// With one bin set to another fraction before all are normalised again (the paper's design tool, section 5.2):
    /// `bin` 0, 1, ... in the positive region, −1, −2, ... in the negative one.
    ///
    /// # Errors
    ///
    /// As [`ContactDistribution::new`].
    ///
    /// ```
    /// # use stereology_microgeometry::ContactDistribution;
    /// let even = ContactDistribution::new(1.0, vec![1.0], vec![1.0])?;
    /// assert_eq!(even.edited(-2, 1.0)?.negative(), [0.25, 0.5]);
    /// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
    /// ```
    pub fn edited(&self, bin: i64, share: f64) -> Result<Self, MicrogeometryError> {
        let (mut negative, mut positive) = (self.negative.clone(), self.positive.clone());
        let (side, bin) = if bin < 0 {
            (&mut negative, -(bin + 1))
        } else {
            (&mut positive, bin)
        };
        let bin = usize::try_from(bin).unwrap_or(usize::MAX);
        if bin >= MOST_BINS {
            let (bins, most) = (bin, MOST_BINS);
            return Err(MicrogeometryError::TooManyBins { bins, most });
        }
        if side.len() <= bin {
            side.resize(bin + 1, 0.0);
        }
        side[bin] = share;
        Self::new(self.bin_width, negative, positive)
    }

    /// Between two distributions of one bin width: (1 − t) of this, t of the other.
    ///
    /// # Errors
    ///
    /// [`MicrogeometryError::BinWidth`] if the widths differ; [`MicrogeometryError::Frequency`] if t is not in 0..1.
    pub fn blended(&self, other: &Self, t: f64) -> Result<Self, MicrogeometryError> {
        if (self.bin_width / other.bin_width - 1.0).abs() > 1e-12 {
            return Err(MicrogeometryError::BinWidth(other.bin_width));
        }
        let mix = |a: &[f64], b: &[f64]| -> Vec<f64> {
            let at = |of: &[f64], k: usize| of.get(k).copied().unwrap_or_default();
            (0..a.len().max(b.len()))
                .map(|k| (1.0 - t) * at(a, k) + t * at(b, k))
                .collect()
        };
        Self::new(
            self.bin_width,
            mix(&self.negative, &other.negative),
            mix(&self.positive, &other.positive),
        )
    }

    /// Earth mover's distance between two distributions, in bins of this one: the least mean distance, in bins, over
    /// which points must move to turn one into the other. Both need the same bin width.
    ///
    /// # Formula
    ///
    /// ```text
    /// EMD = Σ |F(k) − G(k)|      over the signed bins k, F and G the cumulative fractions
    /// ```
    ///
    /// ```
    /// # use stereology_microgeometry::ContactDistribution;
    /// let near = ContactDistribution::new(1.0, vec![1.0], vec![1.0])?;
    /// let far = ContactDistribution::new(1.0, vec![1.0], vec![0.0, 0.0, 1.0])?;
    /// assert_eq!(near.earth_movers_distance(&far), 1.0); // half of all points, by two bins
    /// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
    /// ```
    #[must_use]
    pub fn earth_movers_distance(&self, other: &Self) -> f64 {
        let negative = self.negative.len().max(other.negative.len());
        // Bins from the most negative to the most positive.
        let signed = |of: &Self| {
            let mut bins = vec![0.0; negative];
            bins.iter_mut()
                .zip(&of.negative)
                .for_each(|(bin, fraction)| *bin = *fraction);
            bins.reverse();
            bins.extend(&of.positive);
            bins
        };
        wasserstein_of_bins(signed(self), signed(other))
    }

    /// The file's text.
    #[must_use]
    #[allow(
        clippy::missing_panics_doc,
        reason = "a structure of numbers and strings can always be written"
    )]
    pub fn to_json(&self) -> String {
        let written = Written {
            schema: SCHEMA.to_owned(),
            bin_width: self.bin_width,
            negative: self.negative.clone(),
            positive: self.positive.clone(),
        };
        serde_json::to_string_pretty(&written).expect("numbers and strings can be written") + "\n"
    }

    /// From a file's text: `{"bin_width": 1, "negative": [...], "positive": [...]}`, frequencies of any sum.
    ///
    /// # Errors
    ///
    /// [`MicrogeometryError::File`] if it is something else, and those of [`ContactDistribution::new`].
    ///
    /// ```
    /// # use stereology_microgeometry::ContactDistribution;
    /// let of = ContactDistribution::from_json(r#"{"bin_width": 2, "negative": [1], "positive": [1, 2]}"#)?;
    /// assert_eq!(ContactDistribution::from_json(&of.to_json())?, of);
    /// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
    /// ```
    pub fn from_json(text: &str) -> Result<Self, MicrogeometryError> {
        let written: Written = serde_json::from_str(text).map_err(|error| {
            MicrogeometryError::File(format!(
                "not a contact distribution ({error}): it needs `bin_width`, `negative` and `positive`"
            ))
        })?;
        Self::new(written.bin_width, written.negative, written.positive)
    }
}

fn cumulated(shares: &[f64]) -> Vec<f64> {
    let total: f64 = shares.iter().sum();
    let mut sum = 0.0;
    shares
        .iter()
        .map(|share| {
            sum += share;
            sum / total
        })
        .collect()
}
