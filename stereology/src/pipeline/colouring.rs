//! Which colour each particle gets: that of a profile drawn from those of its category.

#![allow(clippy::cast_possible_truncation, reason = "colours are f32 in a solid")]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_anneal::Packing;
use stereology_segment::Profile;

/// The mean colour of a randomly chosen profile for each particle, from the profiles of its category: section 4.2.
///
/// Profiles outside the counting frame have colours too and are drawn as well. A category without profiles takes from all.
#[must_use]
pub fn particle_colours(packing: &Packing, profiles: &[Profile], seed: u64) -> Vec<[f32; 3]> {
    let colour = |profile: &Profile| profile.colour.map(|c| c as f32);
    let all: Vec<[f32; 3]> = profiles.iter().map(colour).collect();
    let of_category: Vec<Vec<[f32; 3]>> = (0..=u8::MAX)
        .map(|category| {
            profiles
                .iter()
                .filter(|profile| profile.category == category)
                .map(colour)
                .collect()
        })
        .collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(COLOURS);
    let mut draw = |category: u8| {
        let own = &of_category[usize::from(category)];
        let from = if own.is_empty() { &all } else { own };
        from.get(rng.random_range(0..from.len().max(1)))
            .copied()
            .unwrap_or([0.5; 3])
    };
    packing
        .particles()
        .iter()
        .map(|particle| draw(particle.category))
        .collect()
}

/// Random streams of the pipeline, apart from those of the rooms.
const COLOURS: u64 = 1 << 40;
