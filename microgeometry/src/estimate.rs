//! Contact distributions measured on images and volumes (section 5.3 and figure 8 of the paper).

use ndarray::{ArrayView2, ArrayView3, Axis};
use stereology_imaging::distance_to_other_region;

use crate::contact::{ContactDistribution, MOST_BINS};
use crate::conversions::whole_part;
use crate::error::MicrogeometryError;

/// How distances are measured and counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Counting {
    /// From the interface, which runs half way between pixels of different regions: a pixel whose nearest opposite one
    /// is d away counts uniformly over [d − 1, d]. Distances longer than that to the border are censored, and the
    /// distribution is estimated by the Kaplan-Meier product (Baddeley & Gill 1997).
    #[default]
    Interface,
    /// As [`Counting::Interface`] without correction for the border: for images of the whole structure.
    InterfaceSeen,
    /// As in the paper: the distance d to the nearest pixel of the other region, in the bin of its whole part (so the
    /// first bin is empty), divided by all pixels; the border is ignored.
    Paper,
}

/// How a contact distribution is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimateOptions {
    /// How distances are counted.
    pub counting: Counting,
    /// Length of a pixel's side, in distribution units.
    pub pixel_size: f64,
    /// Bins of the region with the largest distance; `None`: bins as wide as a pixel.
    pub bins: Option<usize>,
}

impl Default for EstimateOptions {
    /// From the interface, in pixels.
    fn default() -> Self {
        Self {
            counting: Counting::Interface,
            pixel_size: 1.0,
            bins: None,
        }
    }
}

/// The contact distribution of an image with two regions, (row, column).
///
/// # Errors
///
/// [`MicrogeometryError::OneRegion`] if there is one region only; [`MicrogeometryError::Parameter`] for options out of
/// range.
///
/// # Examples
///
/// Stripes 10 pixels wide: distances are uniform between 0 and 5.
///
/// ```
/// use ndarray::Array2;
/// use stereology_microgeometry::{EstimateOptions, contact_of_image};
///
/// let stripes = Array2::from_shape_fn((40, 200), |(_, x)| x / 10 % 2 == 0);
/// let of = contact_of_image(stripes.view(), &EstimateOptions::default())?;
/// assert!(of.positive()[..5].iter().all(|share| (share - 0.1).abs() < 0.01));
/// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
/// ```
pub fn contact_of_image(
    positive: ArrayView2<'_, bool>,
    options: &EstimateOptions,
) -> Result<ContactDistribution, MicrogeometryError> {
    estimate(positive.insert_axis(Axis(0)), options, "the image")
}

/// The contact distribution of a volume with two regions, (z, y, x): pores and material of figure 8.
///
/// # Errors
///
/// As [`contact_of_image`].
///
/// ```
/// use ndarray::Array3;
/// use stereology_microgeometry::{Counting, EstimateOptions, contact_of_volume};
///
/// let ball = Array3::from_shape_fn((24, 24, 24), |(z, y, x)| {
///     [z, y, x].iter().map(|&i| (i as f64 - 11.5).powi(2)).sum::<f64>() < 100.0
/// });
/// let options = EstimateOptions { counting: Counting::InterfaceSeen, ..EstimateOptions::default() };
/// let of = contact_of_volume(ball.view(), &options)?;
/// let expected = 1.0 - 0.8_f64.powi(3); // nearer to the surface than a fifth of the radius
/// assert!((of.positive_contact()[1] - expected).abs() < 0.05);
/// # Ok::<(), stereology_microgeometry::MicrogeometryError>(())
/// ```
pub fn contact_of_volume(
    positive: ArrayView3<'_, bool>,
    options: &EstimateOptions,
) -> Result<ContactDistribution, MicrogeometryError> {
    estimate(positive, options, "the volume")
}

fn estimate(
    positive: ArrayView3<'_, bool>,
    options: &EstimateOptions,
    what: &'static str,
) -> Result<ContactDistribution, MicrogeometryError> {
    let EstimateOptions {
        counting,
        pixel_size,
        bins,
    } = *options;
    if !(pixel_size.is_finite() && pixel_size > 0.0) {
        return Err(MicrogeometryError::Parameter(format!(
            "the size of a pixel must be a positive finite length, not {pixel_size}"
        )));
    }
    if bins.is_some_and(|bins| bins == 0 || bins > MOST_BINS) {
        return Err(MicrogeometryError::Parameter(format!(
            "a region has 1 to {MOST_BINS} bins"
        )));
    }
    let distances = distance_to_other_region(positive);
    let largest = distances.fold(0.0_f64, |most, d| most.max(*d));
    if !largest.is_finite() || distances.is_empty() {
        return Err(MicrogeometryError::OneRegion(what));
    }
    // In pixels until the last line.
    let width = bins.map_or(1.0, |bins| largest * (1.0 + 1e-12) / bins as f64);
    let shape = [0, 1, 2].map(|axis| positive.len_of(Axis(axis)));
    let mut lives = [LifeTable::new(width, largest), LifeTable::new(width, largest)];
    for ((place, d), side) in distances.indexed_iter().zip(&positive) {
        let of = &mut lives[usize::from(*side)];
        let border = match counting {
            Counting::Interface => border_distance(place, shape),
            _ => f64::INFINITY,
        };
        match counting {
            Counting::Paper => of.see([*d, *d]),
            _ if d - 0.5 <= border => of.see([d - 1.0, *d]),
            _ => of.lose(border),
        }
    }
    let [negative, positive] = lives.map(LifeTable::shares);
    ContactDistribution::new(width * pixel_size, negative, positive)
}

/// Distance of a pixel's centre from the border of the image, in pixels.
fn border_distance((z, y, x): (usize, usize, usize), shape: [usize; 3]) -> f64 {
    [z, y, x]
        .into_iter()
        .zip(shape)
        // An image is one layer thick and has no border along that axis.
        .filter(|&(_, n)| n > 1)
        .map(|(i, n)| i.min(n - 1 - i) as f64 + 0.5)
        .fold(f64::INFINITY, f64::min)
}

/// Observed and censored distances of one region, by bins.
struct LifeTable {
    width: f64,
    seen: Vec<f64>,
    lost: Vec<f64>,
}

impl LifeTable {
    fn new(width: f64, largest: f64) -> Self {
        let bins = whole_part((largest / width).ceil()) + 1;
        Self {
            width,
            seen: vec![0.0; bins],
            lost: vec![0.0; bins],
        }
    }

    fn bin(&self, distance: f64) -> usize {
        whole_part(distance / self.width).min(self.seen.len() - 1)
    }

    /// Adds a distance somewhere in an interval.
    fn see(&mut self, [low, high]: [f64; 2]) {
        let (first, last) = (self.bin(low), self.bin(high));
        if first == last {
            self.seen[first] += 1.0;
            return;
        }
        for bin in first..=last {
            let (from, to) = (bin as f64 * self.width, (bin + 1) as f64 * self.width);
            self.seen[bin] += (high.min(to) - low.max(from)).max(0.0) / (high - low);
        }
    }

    /// Adds a distance known only to be longer than this.
    fn lose(&mut self, distance: f64) {
        let bin = self.bin(distance);
        self.lost[bin] += 1.0;
    }

    /// Fractions of the bins times the number of points, by Π (1 − observed / at risk), where those censored in a bin
    /// are at risk for half of it.
    fn shares(self) -> Vec<f64> {
        let total: f64 = self.seen.iter().chain(&self.lost).sum();
        let (mut at_risk, mut surviving) = (total, total);
        let mut shares = Vec::with_capacity(self.seen.len());
        for (seen, lost) in self.seen.iter().zip(&self.lost) {
            let exposed = at_risk - 0.5 * lost;
            let hazard = if exposed > 0.0 { (seen / exposed).min(1.0) } else { 0.0 };
            shares.push(surviving * hazard);
            surviving *= 1.0 - hazard;
            at_risk -= seen + lost;
        }
        // The remaining distances are all censored: they count as the longest observed one.
        if let Some(last) = shares.iter().rposition(|share| *share > 0.0) {
            shares[last] += surviving.max(0.0);
        }
        shares
    }
}

#[cfg(test)]
mod tests {
    use super::{Counting, EstimateOptions, contact_of_image};
    use ndarray::Array2;

    /// A disc's points lie nearer to its rim than r with probability 1 − (1 − r/R)².
    #[test]
    fn discs_have_the_closed_form() {
        let disc = Array2::from_shape_fn((101, 101), |(y, x)| (y as f64 - 50.0).hypot(x as f64 - 50.0) < 40.0);
        let options = EstimateOptions {
            counting: Counting::InterfaceSeen,
            ..EstimateOptions::default()
        };
        let of = contact_of_image(disc.view(), &options).unwrap();
        for (k, share) in of.positive_contact().iter().enumerate().take(39) {
            let expected = 1.0 - (1.0 - (k as f64 + 1.0) / 40.0_f64).powi(2);
            assert!((share - expected).abs() < 0.012, "{k}: {share} {expected}");
        }
    }

    /// A window that shows little of each stripe: observed distances are too short, the estimate is not.
    #[test]
    fn the_border_is_corrected() {
        // Stripes of 30 pixels cut by a window 100 wide: the true fractions are uniform over 15 bins.
        let mut seen = (0.0, 0.0);
        for shift in 0..60 {
            let stripes = Array2::from_shape_fn((100, 100), |(_, x)| (x + shift) / 30 % 2 == 0);
            let far = |counting| {
                let options = EstimateOptions {
                    counting,
                    ..EstimateOptions::default()
                };
                let of = contact_of_image(stripes.view(), &options).unwrap();
                1.0 - of.positive_contact().get(9).unwrap()
            };
            seen.0 += far(Counting::Interface) / 60.0;
            seen.1 += far(Counting::InterfaceSeen) / 60.0;
        }
        assert!((seen.0 - 1.0 / 3.0).abs() < 0.03, "{seen:?}");
        assert!((seen.1 - 1.0 / 3.0).abs() > (seen.0 - 1.0 / 3.0).abs(), "{seen:?}");
    }

    /// The paper's counts: whole distances, nothing in the first bin, divided by all pixels.
    #[test]
    fn the_paper_counts_whole_distances() {
        let half = Array2::from_shape_fn((4, 6), |(_, x)| x < 3);
        let options = EstimateOptions {
            counting: Counting::Paper,
            ..EstimateOptions::default()
        };
        let of = contact_of_image(half.view(), &options).unwrap();
        for (k, share) in of.positive().iter().enumerate() {
            let expected = if k == 0 { 0.0 } else { 1.0 / 6.0 };
            assert!((share - expected).abs() < 1e-12);
        }
    }
}
