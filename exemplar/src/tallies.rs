//! Histograms of the solid's colours and of its use of the exemplars, which the synthesis keeps close to those of the
//! exemplars.

use crate::level::{Atlas, Level, NONE};
use crate::numbers::{number, single};

/// Bins of a colour channel.
const BINS: usize = 16;
/// Smallest expected number of voxels in a bin of positions; pixels are pooled in squares until it is reached.
const FEWEST: f64 = 2.0;

/// Use of each pixel of the exemplars, or of each of their neighbourhoods.
#[derive(Clone)]
pub(crate) struct Usage {
    /// Bin of each place.
    bins: Vec<u32>,
    /// Uses by bin.
    pub(crate) counts: Vec<i64>,
    /// Expected uses by bin.
    pub(crate) targets: Vec<f64>,
}

impl Usage {
    /// Usage of `members` (places, by exemplar); `uses[e]` uses are expected of those of exemplar e together.
    pub(crate) fn new(level: &Level, atlas: &Atlas, members: &[Vec<u32>], uses: &[f64]) -> Self {
        let mut bins = vec![NONE; level.pixel.len()];
        let mut targets = Vec::new();
        for (members, &uses) in members.iter().zip(uses) {
            if members.is_empty() {
                continue;
            }
            let each = uses / members.len() as f64;
            let mut square = 1;
            while each * ((square * square) as f64) < FEWEST && square < 64 {
                square *= 2;
            }
            let first = targets.len();
            let across = 4096_usize.div_ceil(square) + 1;
            let mut keys: Vec<(usize, u32)> = members
                .iter()
                .map(|&place| {
                    let (_, row, column) = atlas.locate(level.pixel[place as usize] as usize);
                    (row / square * across + column / square, place)
                })
                .collect();
            keys.sort_unstable();
            let mut last = None;
            for (key, place) in keys {
                if last != Some(key) {
                    targets.push(0.0);
                    last = Some(key);
                }
                let bin = targets.len() - 1;
                targets[bin] += each;
                bins[place as usize] = number(bin);
            }
            debug_assert!(targets.len() > first);
        }
        Self {
            bins,
            counts: vec![0; targets.len()],
            targets,
        }
    }

    #[inline]
    pub(crate) fn add(&mut self, place: u32, times: i64) {
        let bin = self.bins[place as usize];
        if bin != NONE {
            self.counts[bin as usize] += times;
        }
    }

    /// A number for each place from the number of uses and the target of its bin.
    pub(crate) fn each(&self, of: impl Fn(f64, f64) -> f32, elsewhere: f32) -> Vec<f32> {
        let bins: Vec<f32> = self
            .counts
            .iter()
            .zip(&self.targets)
            .map(|(&count, &target)| of(count as f64, target))
            .collect();
        self.bins
            .iter()
            .map(|&bin| if bin == NONE { elsewhere } else { bins[bin as usize] })
            .collect()
    }

    /// Uses and target of a place's bin.
    #[inline]
    pub(crate) fn of(&self, place: u32) -> Option<(f64, f64)> {
        let bin = self.bins[place as usize];
        (bin != NONE).then(|| (self.counts[bin as usize] as f64, self.targets[bin as usize]))
    }

    /// Raises the prices of bins that are used too often by up to two steps and lowers those of others by up to one.
    pub(crate) fn charge(&self, prices: &mut [f32], step: f32) {
        for ((price, &count), &target) in prices.iter_mut().zip(&self.counts).zip(&self.targets) {
            *price += step * single((count as f64 / target - 1.0).clamp(-1.0, 2.0));
        }
    }

    /// Bin of each place, or [`NONE`].
    pub(crate) fn bins(&self) -> &[u32] {
        &self.bins
    }
}

/// Histograms of the colour channels.
#[derive(Clone)]
pub(crate) struct Colours {
    ranges: Vec<(f32, f32)>,
    pub(crate) counts: Vec<i64>,
    /// Fraction of the exemplars' pixels in each bin.
    fractions: Vec<f64>,
}

impl Colours {
    /// The expected histograms: those of the exemplars' pixels at this level, with equal weights of the exemplars.
    pub(crate) fn new(level: &Level, colours: usize) -> Self {
        let all = || level.places.iter().flatten().map(|&place| place as usize);
        let mut made = Self {
            ranges: Vec::new(),
            counts: vec![0; colours * BINS],
            fractions: vec![0.0; colours * BINS],
        };
        for channel in 0..colours {
            let value = |place: usize| level.values[channel * level.stride + place];
            let low = all().map(value).fold(f32::INFINITY, f32::min);
            let high = all().map(value).fold(f32::NEG_INFINITY, f32::max);
            made.ranges
                .push((low, BINS as f32 / (high - low).max(f32::MIN_POSITIVE)));
            for places in &level.places {
                for &place in places {
                    let bin = made.bin(channel, value(place as usize));
                    made.fractions[bin] += 1.0 / (places.len() * level.places.len()) as f64;
                }
            }
        }
        made
    }

    /// Bin of a value, among those of all channels.
    #[inline]
    #[allow(clippy::cast_possible_truncation, reason = "clamped to the bins")]
    pub(crate) fn bin(&self, channel: usize, value: f32) -> usize {
        let (low, scale) = self.ranges[channel];
        channel * BINS + (((value - low) * scale).max(0.0) as usize).min(BINS - 1)
    }

    #[inline]
    pub(crate) fn add(&mut self, channel: usize, value: f32, times: i64) {
        let bin = self.bin(channel, value);
        self.counts[bin] += times;
    }

    /// (expected / found)^strength of each bin, within 1/16 and 16.
    pub(crate) fn lack(&self, voxels: f64, strength: f32) -> Vec<f32> {
        (0..self.counts.len())
            .map(|bin| self.lack_of(bin, voxels, strength))
            .collect()
    }

    /// The factor of one bin.
    pub(crate) fn lack_of(&self, bin: usize, voxels: f64, strength: f32) -> f32 {
        let ratio = (self.fractions[bin] * voxels + 1.0) / (self.counts[bin] as f64 + 1.0);
        single(ratio).powf(strength).clamp(1.0 / 16.0, 16.0)
    }
}
