//! Contact distributions in closed form.

use std::f64::consts::PI;
use std::str::FromStr;

use crate::contact::{ContactDistribution, MOST_BINS};
use crate::error::MicrogeometryError;

/// The law of the distances in one region, by its cumulative distribution F(r).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// Uniform up to a distance: stripes of twice that width. F = r/R.
    Uniform(f64),
    /// Inside discs of a radius. F = 1 − (1 − r/R)².
    Disc(f64),
    /// F = 1 − exp(−r/s).
    Exponential(f64),
    /// F = 1 − exp(−r²/2s²): between the points of a Poisson process of intensity λ = 1/(2π s²).
    Rayleigh(f64),
    /// Between discs of a radius placed at random, with an intensity per unit of area (Boolean model). F = 1 − exp(−π λ
    /// (2Rr + r²)).
    Boolean {
        /// Radius R.
        radius: f64,
        /// Intensity λ.
        intensity: f64,
    },
    /// Bell-shaped about a distance: most points at that distance from the interface. F of a logistic law (close to a
    /// normal one) truncated at 0.
    Bell {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        deviation: f64,
    },
}

impl Law {
    /// F(r): the probability that a point of the region lies nearer to the interface than r.
    ///
    /// ```
    /// use stereology_microgeometry::Law;
    /// assert_eq!(Law::Disc(2.0).cumulated(1.0), 0.75);
    /// ```
    #[must_use]
    pub fn cumulated(&self, r: f64) -> f64 {
        let r = r.max(0.0);
        match *self {
            Self::Uniform(most) => (r / most).min(1.0),
            Self::Disc(radius) => 1.0 - (1.0 - (r / radius).min(1.0)).powi(2),
            Self::Exponential(scale) => -(-r / scale).exp_m1(),
            Self::Rayleigh(scale) => -(-0.5 * (r / scale).powi(2)).exp_m1(),
            Self::Boolean { radius, intensity } => -(-PI * intensity * (2.0 * radius * r + r * r)).exp_m1(),
            Self::Bell { mean, deviation } => {
                let logistic = |x: f64| 1.0 / (1.0 + (-1.702 * (x - mean) / deviation).exp());
                let below = logistic(0.0);
                (logistic(r) - below) / (1.0 - below)
            }
        }
    }

    fn is_valid(&self) -> bool {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        match *self {
            Self::Uniform(x) | Self::Disc(x) | Self::Exponential(x) | Self::Rayleigh(x) => positive(x),
            Self::Boolean { radius, intensity } => radius.is_finite() && radius >= 0.0 && positive(intensity),
            Self::Bell { mean, deviation } => mean.is_finite() && mean >= 0.0 && positive(deviation),
        }
    }
}

impl FromStr for Law {
    type Err = MicrogeometryError;

    /// `uniform:R`, `disc:R`, `exponential:S`, `rayleigh:S`, `boolean:R,LAMBDA`, `bell:MEAN,DEVIATION`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = || {
            MicrogeometryError::Parameter(format!(
                "{text:?} is not a law; laws are uniform:R, disc:R, exponential:S, rayleigh:S, boolean:R,LAMBDA, bell:MEAN,DEVIATION"
            ))
        };
        let (name, values) = text.split_once(':').ok_or_else(wrong)?;
        let values: Vec<f64> = values
            .split(',')
            .map(|value| value.trim().parse())
            .collect::<Result<_, _>>()
            .map_err(|_| wrong())?;
        let law = match (name, values.as_slice()) {
            ("uniform", &[x]) => Self::Uniform(x),
            ("disc", &[x]) => Self::Disc(x),
            ("exponential", &[x]) => Self::Exponential(x),
            ("rayleigh", &[x]) => Self::Rayleigh(x),
            ("boolean", &[radius, intensity]) => Self::Boolean { radius, intensity },
            ("bell", &[mean, deviation]) => Self::Bell { mean, deviation },
            _ => return Err(wrong()),
        };
        if law.is_valid() { Ok(law) } else { Err(wrong()) }
    }
}

impl ContactDistribution {
    /// From the laws of both regions and the fraction of the positive one; truncated where less than 10⁻⁶ of a region
    /// lies beyond.
    ///
    /// # Errors
    ///
    /// [`MicrogeometryError`] if the fraction is not in 0..1, a law's parameters are out of range, or bins are too
    /// narrow for it.
    ///
    /// ```
    /// use stereology_microgeometry::{ContactDistribution, Law};
    ///
    /// let cells = ContactDistribution::from_laws(1.0, Law::Rayleigh(4.0), Law::Disc(5.0), 0.4)?;
    /// assert!((cells.positive_share() - 0.4).abs() < 1e-12);
    /// assert!((cells.positive_contact()[0] - 0.36).abs() < 1e-12);
    /// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
    /// ```
    pub fn from_laws(bin_width: f64, negative: Law, positive: Law, share: f64) -> Result<Self, MicrogeometryError> {
        if !(0.0..=1.0).contains(&share) {
            return Err(MicrogeometryError::Parameter(format!(
                "the fraction of the positive region must be between 0 and 1, not {share}"
            )));
        }
        let of = |law: Law, share: f64| -> Result<Vec<f64>, MicrogeometryError> {
            if !law.is_valid() {
                return Err(MicrogeometryError::Parameter(format!(
                    "{law:?} is not a law of distances"
                )));
            }
            let mut shares = Vec::new();
            let mut before = 0.0;
            while before < 1.0 - 1e-6 {
                if shares.len() >= MOST_BINS {
                    return Err(MicrogeometryError::TooManyBins {
                        bins: shares.len() + 1,
                        most: MOST_BINS,
                    });
                }
                let next = law.cumulated((shares.len() + 1) as f64 * bin_width);
                shares.push(share * (next - before));
                before = next;
            }
            Ok(shares.into_iter().map(|part| part / before).collect())
        };
        if !(bin_width.is_finite() && bin_width > 0.0) {
            return Err(MicrogeometryError::BinWidth(bin_width));
        }
        Self::new(bin_width, of(negative, 1.0 - share)?, of(positive, share)?)
    }
}
