//! Random designs from the parameter space (section 5.1 of the paper).

use std::f64::consts::PI;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::contact::ContactDistribution;
use crate::design::Design;
use crate::displacement::{Direction, Offset, Profile};
use crate::error::MicrogeometryError;
use crate::families::Law;

/// Most pairs of laws drawn to find one whose fraction of the positive region is in its range.
const TRIES: usize = 64;

/// The ranges from which designs are drawn. What is `Some` is the same in all.
#[derive(Clone, Debug, PartialEq)]
pub struct Exploration {
    /// The contact distribution; `None`: drawn too, a blend of two laws in each region. Only laws that a surface can
    /// have are drawn: at the interface both regions have the same density of distances, given by its length, and it
    /// cannot increase away from the interface in both.
    pub contact: Option<ContactDistribution>,
    /// Scale units, log-uniform; table 1 has 27 to 82.
    pub units: [f64; 2],
    /// Typical distances of the laws, in bins, log-uniform.
    pub lengths: [f64; 2],
    /// Fraction of the positive region.
    pub shares: [f64; 2],
    /// k, log-uniform, for the profile √x; a third of it for x, which rises higher.
    pub scales: [f64; 2],
    /// Displacement of the negative region.
    pub negative: Option<Offset>,
    /// Displacement of the positive region.
    pub positive: Option<Offset>,
}

impl Default for Exploration {
    /// Units 25 to 85, distances 0.7 to 6 bins, fractions 0.15 to 0.85, k 0.008 to 0.05.
    fn default() -> Self {
        Self {
            contact: None,
            units: [25.0, 85.0],
            lengths: [0.7, 6.0],
            shares: [0.15, 0.85],
            scales: [0.008, 0.05],
            negative: None,
            positive: None,
        }
    }
}

impl Exploration {
    /// Checks the ranges.
    ///
    /// # Errors
    ///
    /// [`MicrogeometryError::Parameter`] naming a range that is not two positive finite numbers in order, or fractions
    /// outside 0..1.
    pub fn check(&self) -> Result<(), MicrogeometryError> {
        for (name, [low, high]) in [
            ("units", self.units),
            ("lengths", self.lengths),
            ("shares", self.shares),
            ("scales", self.scales),
        ] {
            let most = if name == "shares" { 1.0 } else { 1e6 };
            if !(low > 0.0 && low <= high && high <= most) {
                return Err(MicrogeometryError::Parameter(format!(
                    "the range of {name} must be two numbers above zero, the lower first, at most {most}: not {low},{high}"
                )));
            }
        }
        Ok(())
    }

    /// The design of this number; the same for the same seed, whatever other designs are drawn.
    ///
    /// # Errors
    ///
    /// Those of [`Exploration::check`].
    ///
    /// ```
    /// use stereology_microgeometry::Exploration;
    /// let designs = Exploration::default();
    /// assert_eq!(designs.design(1, 7)?, designs.design(1, 7)?);
    /// assert_ne!(designs.design(1, 7)?, designs.design(1, 8)?);
    /// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
    /// ```
    pub fn design(&self, seed: u64, number: u64) -> Result<Design, MicrogeometryError> {
        self.check()?;
        let mut random = stream(seed, number);
        let units = log_even(&mut random, self.units);
        let contact = match &self.contact {
            Some(contact) => contact.clone(),
            None => self.contact(&mut random)?,
        };
        let offsets = [self.offset(&mut random), self.offset(&mut random)];
        let [mut negative, mut positive] = offsets;
        if negative.direction == Direction::Still && positive.direction == Direction::Still {
            positive.direction = Direction::Out;
        }
        if let Some(fixed) = &self.negative {
            negative = fixed.clone();
        }
        if let Some(fixed) = &self.positive {
            positive = fixed.clone();
        }
        let mut design = Design::new(contact, units, negative, positive);
        design.seed = own_seed(seed, number);
        Ok(design)
    }

    /// A design near another (a tighter search, section 5.1): units, scales and every bin multiplied by factors
    /// exp(±`spread`), directions and profiles as they are.
    ///
    /// # Errors
    ///
    /// [`MicrogeometryError::Parameter`] if the spread is not a positive number.
    pub fn near(&self, of: &Design, spread: f64, seed: u64, number: u64) -> Result<Design, MicrogeometryError> {
        if !(spread.is_finite() && spread > 0.0 && spread <= 3.0) {
            return Err(MicrogeometryError::Parameter(format!(
                "the spread of a nearby search must be above 0 and at most 3, not {spread}"
            )));
        }
        let mut random = stream(seed, number);
        let mut factor = || (spread * (2.0 * random.random::<f64>() - 1.0)).exp();
        let mut design = of.clone();
        design.units *= factor();
        design.negative.scale *= factor();
        design.positive.scale *= factor();
        if self.contact.is_none() {
            let tilt = [factor(), factor()];
            let mut vary = |shares: &[f64], tilt: f64| shares.iter().map(|share| share * tilt * factor()).collect();
            let (negative, positive) = (
                vary(of.contact.negative(), tilt[0]),
                vary(of.contact.positive(), tilt[1]),
            );
            design.contact = ContactDistribution::new(of.contact.bin_width(), negative, positive)?;
        }
        if let Some(fixed) = &self.negative {
            design.negative = fixed.clone();
        }
        if let Some(fixed) = &self.positive {
            design.positive = fixed.clone();
        }
        design.seed = own_seed(seed, number);
        Ok(design)
    }

    fn contact(&self, random: &mut ChaCha8Rng) -> Result<ContactDistribution, MicrogeometryError> {
        let (first, second) = (self.pair(random)?, self.pair(random)?);
        first.blended(&second, random.random())
    }

    /// Laws of both regions that a surface can have: at the interface both have the same density, which determines the
    /// fraction of each.
    fn pair(&self, random: &mut ChaCha8Rng) -> Result<ContactDistribution, MicrogeometryError> {
        let [low, high] = self.shares;
        let (mut best, mut off) = ((Law::Uniform(1.0), Law::Uniform(1.0), 0.5), f64::INFINITY);
        for _ in 0..TRIES {
            let [negative, positive] = [self.law(random), self.law(random)];
            let beside = [negative.cumulated(1.0), positive.cumulated(1.0)];
            let share = beside[0] / (beside[0] + beside[1]);
            let within = share.clamp(low, high);
            if (share - within).abs() < off {
                off = (share - within).abs();
                best = (negative, positive, within);
            }
            if off <= 0.0 {
                break;
            }
        }
        let (negative, positive, share) = best;
        ContactDistribution::from_laws(1.0, negative, positive, share)
    }

    /// A law whose density decreases away from the interface.
    fn law(&self, random: &mut ChaCha8Rng) -> Law {
        let length = log_even(random, self.lengths);
        match random.random_range(0..4) {
            0 => Law::Uniform(2.0 * length),
            1 => Law::Disc(3.0 * length),
            2 => Law::Exponential(length),
            // Between discs so dense that the density of distances does not increase: 2 π λ R² = 1.5.
            _ => {
                let radius = 1.5 * length;
                let intensity = 0.75 / (PI * radius * radius);
                Law::Boolean { radius, intensity }
            }
        }
    }

    fn offset(&self, random: &mut ChaCha8Rng) -> Offset {
        let direction = [
            Direction::Out,
            Direction::Out,
            Direction::In,
            Direction::In,
            Direction::Still,
        ][random.random_range(0..5)];
        let scale = log_even(random, self.scales);
        let (profile, scale) = if random.random::<f64>() < 0.6 {
            (Profile::Root, scale)
        } else {
            (Profile::Linear, scale / 3.0)
        };
        Offset {
            direction,
            // Five decimals are precise enough and easy to read.
            scale: (scale * 1e5).round() / 1e5,
            profile,
        }
    }
}

fn stream(seed: u64, number: u64) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(number);
    random
}

/// The seed of a candidate's own reconstruction, never 0.
fn own_seed(seed: u64, number: u64) -> u64 {
    seed.wrapping_mul(1_000_003).wrapping_add(number).wrapping_add(1) & ((1 << 53) - 1)
}

fn log_even(random: &mut ChaCha8Rng, [low, high]: [f64; 2]) -> f64 {
    low * (high / low).powf(random.random())
}
