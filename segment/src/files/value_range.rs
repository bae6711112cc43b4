//! Which stored number of a picture is black and which is white.

use stereology_metrics::Finding;

/// Whites of cameras and microscopes that store 8 to 16 bits in 16.
const WHITES: [u16; 5] = [255, 1023, 4095, 16_383, 65_535];
/// Floating point pictures from 0 to 1 may overshoot by this, from filters.
const OVERSHOOT: f64 = 1.01;

/// Black, white, and a finding if they were guessed.
#[derive(Debug, PartialEq)]
pub(crate) struct ValueRange {
    pub(crate) black: f64,
    pub(crate) white: f64,
    pub(crate) finding: Option<Finding>,
}

impl ValueRange {
    /// The range of unsigned samples of 16 bits: 65,535 is white, unless they use at most a quarter of it; then the
    /// smallest white of 8, 10, 12 or 14 bits that holds all is guessed.
    pub(crate) fn of_shorts(largest: u16) -> Self {
        let white = WHITES.into_iter().find(|white| *white >= largest).unwrap_or(u16::MAX);
        let finding = (white < u16::MAX).then(|| {
            let bits = u32::from(white).count_ones();
            guessed(&format!(
                "the picture has samples of 16 bits up to {largest} only; they were taken as numbers of {bits} bits, {white} being white"
            ))
        });
        Self {
            black: 0.0,
            white: f64::from(white),
            finding,
        }
    }

    /// The range of other numbers: 0 to 1 if they are floating point and all lie within; else the smallest white of 8,
    /// 10, 12, 14 or 16 bits if none is negative; else from the smallest to the largest.
    pub(crate) fn of_numbers(values: impl Iterator<Item = f64>, float: bool) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.filter(|v| v.is_finite()) {
            (low, high) = (low.min(value), high.max(value));
        }
        let unit = float && low >= 1.0 - OVERSHOOT && high <= OVERSHOOT;
        let (black, white) = if unit || low > high {
            (0.0, 1.0)
        } else if low >= 0.0 && high <= f64::from(u16::MAX) {
            let white = WHITES.into_iter().map(f64::from).find(|white| *white >= high);
            (0.0, white.unwrap_or(high))
        } else if low < high {
            (low, high)
        } else {
            (low, low + 1.0)
        };
        let kind = if float {
            "floating point numbers"
        } else {
            "whole numbers"
        };
        Self {
            black,
            white,
            finding: Some(guessed(&format!(
                "the picture has {kind} from {low} to {high}; {black} was taken as black and {white} as white"
            ))),
        }
    }

    /// A number as a level of 16 bits; black if it is not a number.
    #[allow(clippy::cast_possible_truncation, reason = "clamped to the range of u16")]
    pub(crate) fn level(&self, value: f64) -> u16 {
        let share = (value - self.black) / (self.white - self.black);
        (share.clamp(0.0, 1.0) * f64::from(u16::MAX)).round() as u16
    }
}

fn guessed(what: &str) -> Finding {
    Finding::new(
        "range-guessed",
        format!("{what}; if that is wrong, save the picture with 8 bits"),
    )
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "whole numbers")]
mod tests {
    use super::ValueRange;

    /// Twelve bits in sixteen are found; a picture that uses more than a quarter of its range is left alone.
    #[test]
    fn guessed_whites() {
        for (largest, white) in [(255, 255.0), (256, 1023.0), (4000, 4095.0), (9000, 16_383.0)] {
            let range = ValueRange::of_shorts(largest);
            assert!(range.white == white && range.finding.is_some());
        }
        assert_eq!(ValueRange::of_shorts(20_000).finding, None);
        let range = |values: &[f64]| {
            let found = ValueRange::of_numbers(values.iter().copied(), true);
            [found.black, found.white]
        };
        assert_eq!(range(&[0.0, 0.7]), [0.0, 1.0]);
        assert_eq!(range(&[0.0, 200.5]), [0.0, 255.0]);
        assert_eq!(range(&[-3.0, 5.0, f64::NAN]), [-3.0, 5.0]);
        assert_eq!(range(&[f64::NAN]), [0.0, 1.0]);
    }

    /// Levels are those of the range, and never beyond.
    #[test]
    fn levels() {
        let range = ValueRange::of_shorts(4095);
        assert_eq!(
            [0.0, 4095.0, 9000.0, f64::NAN].map(|v| range.level(v)),
            [0, 65_535, 65_535, 0]
        );
    }
}
