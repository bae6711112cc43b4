//! The exemplar's neighbourhood most like one of the solid.

use crate::Search;
use crate::level::{Atlas, LANES, Level, NONE};
use crate::quantiser::Quantiser;
use crate::similar::Similar;
use crate::window::Window;

/// A neighbourhood of the solid.
pub(crate) struct Query<'a> {
    /// Its values, in the padded layout.
    pub(crate) window: &'a [f32],
    /// Which of its pixels count.
    pub(crate) weights: &'a [f32],
    /// All pixels of a window over those that count: makes distances comparable.
    pub(crate) scale: f32,
    /// The exemplar in which to look.
    pub(crate) sheet: usize,
}

/// Finds neighbourhoods in the exemplars of a level.
pub(crate) struct Finder<'a> {
    level: &'a Level,
    window: &'a Window,
    way: Way,
}

enum Way {
    Exact,
    Tsvq(Vec<Quantiser>),
    KCoherence(Similar),
}

impl<'a> Finder<'a> {
    /// Learns what the search needs to know of the exemplars.
    pub(crate) fn new(search: Search, level: &'a Level, atlas: &Atlas, window: &'a Window, similar: usize) -> Self {
        let way = match search {
            Search::Exact => Way::Exact,
            Search::Tsvq => Way::Tsvq(
                level
                    .windows
                    .iter()
                    .map(|places| Quantiser::new(level, places, window))
                    .collect(),
            ),
            Search::KCoherence => Way::KCoherence(Similar::learn(level, atlas, window, similar)),
        };
        Self { level, window, way }
    }

    /// Place and squared distance of the window that costs least: distance and `price`. `bases` are the present match and
    /// those that continue the neighbours' matches; only [`Search::KCoherence`] looks at all of them.
    #[inline]
    pub(crate) fn nearest(&self, query: &Query<'_>, bases: &[usize], price: impl Fn(usize) -> f32) -> (usize, f32) {
        let mut best = Best {
            place: bases[0],
            distance: f32::INFINITY,
            cost: f32::INFINITY,
        };
        let consider = |place: usize, best: &mut Best| {
            let price = price(place);
            let bound = (best.cost - price) / query.scale;
            if bound <= 0.0 || (place == best.place && best.cost < f32::INFINITY) {
                return;
            }
            let distance = self
                .window
                .distance(self.level, place, query.window, query.weights, bound)
                * query.scale;
            if distance + price < best.cost {
                *best = Best {
                    place,
                    distance,
                    cost: distance + price,
                };
            }
        };
        consider(bases[0], &mut best);
        match &self.way {
            Way::Exact => {
                for &place in &self.level.windows[query.sheet] {
                    consider(place as usize, &mut best);
                }
            }
            Way::Tsvq(trees) => {
                for &place in trees[query.sheet].leaf(query.window, query.weights) {
                    consider(place as usize, &mut best);
                }
            }
            Way::KCoherence(similar) => {
                for &place in &bases[1..] {
                    consider(place, &mut best);
                }
                for &place in similar.of(best.place) {
                    if place != NONE {
                        consider(place as usize, &mut best);
                    }
                }
            }
        }
        (best.place, best.distance)
    }
}

struct Best {
    place: usize,
    distance: f32,
    cost: f32,
}

/// Sum of squared differences where `weights` count; channels of `a` and `b` one after the other.
#[inline]
pub(crate) fn weighted_distance(a: &[f32], b: &[f32], weights: &[f32]) -> f32 {
    let mut sums = [0.0_f32; LANES];
    let ((a, _), (b, _), (weights, _)) = (
        a.as_chunks::<LANES>(),
        b.as_chunks::<LANES>(),
        weights.as_chunks::<LANES>(),
    );
    for ((a, b), w) in a.iter().zip(b).zip(weights.iter().cycle()) {
        for lane in 0..LANES {
            let d = a[lane] - b[lane];
            sums[lane] += d * d * w[lane];
        }
    }
    sums.iter().sum()
}
