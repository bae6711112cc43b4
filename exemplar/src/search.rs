//! Search for the neighbourhood of the exemplar that is most similar to one of the solid.

use crate::level::{Atlas, Level, NONE};
use crate::options::Search;
use crate::quantiser::Quantiser;
use crate::similar::Similar;
use crate::window::Window;

/// A neighbourhood of the solid.
pub(crate) struct Query<'a> {
    /// Its values, in the padded layout.
    pub(crate) window: &'a [f32],
    /// Which of its pixels count.
    pub(crate) weights: &'a [f32],
    /// Number of pixels of a window over the number that count, which makes distances comparable.
    pub(crate) scale: f32,
    /// Number of the exemplar to search.
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
    /// Prepares the search.
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

    /// Place and squared distance of the window with the smallest cost, squared distance plus `price`. `bases` are the
    /// present match and the continuations of the neighbours' matches; only [`Search::KCoherence`] uses all of them.
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
