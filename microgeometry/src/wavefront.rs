//! A bucket queue of triangles by decreasing value.

use crate::conversions::whole_part;

/// Number of buckets from the current one on; entries beyond them wait in a list.
const BUCKETS: usize = 1024;

/// Values with their triangles, removed from the highest bucket to the lowest; within a bucket in any order.
///
/// A search over a graph with such a queue has the same result as with an exact one: a triangle whose value is raised
/// again while its bucket is emptied is inserted again. No bucket is left before it is empty, so this is rare with
/// buckets narrower than an edge. Insertion and removal take constant time.
pub(crate) struct Wavefront {
    /// Buckets per unit of value.
    per_unit: f64,
    /// Highest value of the first bucket.
    top: f64,
    buckets: Vec<Vec<(f64, u32)>>,
    /// The bucket that is being emptied.
    at: usize,
    /// All buckets after this one are empty.
    last: usize,
    beyond: Vec<(f64, u32)>,
}

impl Wavefront {
    /// With buckets of this width, or of 1 if it is not positive and finite.
    pub(crate) fn new(width: f64) -> Self {
        let per_unit = width.recip();
        Self {
            per_unit: if per_unit.is_finite() && per_unit > 0.0 {
                per_unit
            } else {
                1.0
            },
            top: 0.0,
            buckets: vec![Vec::new(); BUCKETS],
            at: 0,
            last: 0,
            beyond: Vec::new(),
        }
    }

    /// Clears the queue for values from `top` downwards.
    pub(crate) fn restart(&mut self, top: f64) {
        for bucket in &mut self.buckets[self.at..=self.last] {
            bucket.clear();
        }
        self.beyond.clear();
        (self.top, self.at, self.last) = (top, 0, 0);
    }

    pub(crate) fn push(&mut self, value: f64, triangle: u32) {
        // Values above the current bucket go into it and come out next.
        let place = whole_part((self.top - value) * self.per_unit).max(self.at);
        if place < BUCKETS {
            self.buckets[place].push((value, triangle));
            self.last = self.last.max(place);
        } else {
            self.beyond.push((value, triangle));
        }
    }

    pub(crate) fn pop(&mut self) -> Option<(f64, u32)> {
        loop {
            if let Some(next) = self.buckets[self.at].pop() {
                return Some(next);
            }
            if self.at < self.last {
                self.at += 1;
                continue;
            }
            if self.beyond.is_empty() {
                return None;
            }
            let waiting = std::mem::take(&mut self.beyond);
            self.top = waiting.iter().fold(f64::NEG_INFINITY, |most, next| most.max(next.0));
            (self.at, self.last) = (0, 0);
            for (value, triangle) in waiting {
                self.push(value, triangle);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Wavefront;
    use proptest::prelude::*;

    proptest! {
        /// All entries come out, from high to low within the width of a bucket, however large the gaps.
        #[test]
        fn values_fall(values in prop::collection::vec(-1e4..0.0_f64, 1..200), width in 1e-3..10.0_f64) {
            let mut front = Wavefront::new(width);
            front.restart(0.0);
            for (i, &value) in (0..).zip(&values) {
                front.push(value, i);
            }
            let mut out: Vec<f64> = Vec::new();
            while let Some((value, i)) = front.pop() {
                prop_assert_eq!(value.to_bits(), values[i as usize].to_bits());
                if let Some(last) = out.last() {
                    prop_assert!(value < last + width * (1.0 + 1e-6));
                }
                out.push(value);
            }
            prop_assert_eq!(out.len(), values.len());
        }
    }
}
