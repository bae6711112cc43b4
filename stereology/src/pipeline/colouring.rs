//! Colours of the particles: each gets that of a profile of its category and of similar size.

use crate::pipeline::narrowing::single;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_segment::Profile;
use stereology_shape::Particle;

/// A profile of which colours are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourSample {
    /// Equivalent circular diameter, in the unit of the particles.
    pub size: f64,
    /// Colour category.
    pub category: u8,
    /// Mean colour, encoded values / 255.
    pub colour: [f64; 3],
}

impl ColourSample {
    /// That of a profile, with a pixel of this length.
    #[must_use]
    pub fn of(profile: &Profile, pixel: f64) -> Self {
        Self {
            size: profile.size * pixel,
            category: profile.category,
            colour: profile.colour,
        }
    }
}

/// For each particle the mean colour of a random profile, drawn from those of its category that are nearest in size:
/// section 4.2.
///
/// The paper draws from all profiles of a category. Where colours within a category vary with size (black dust and teal
/// slabs, both dark), that gives the few large particles the colours of the many small ones. Here a fifth of the
/// category, at least a dozen profiles, is drawn from. Profiles outside the counting frame are drawn too; a category
/// without profiles draws from all. Profiles of equal size are in the given order.
///
/// # Examples
///
/// ```
/// use nalgebra::{Point3, UnitQuaternion};
/// use stereology::pipeline::{ColourSample, particle_colours};
/// use stereology::shape::Particle;
///
/// // One brick profile; every particle becomes brick.
/// let brick = ColourSample { size: 20.0, category: 0, colour: [0.67, 0.27, 0.2] };
/// let particle = Particle { shape: 0, size: 4.0, category: 0, position: Point3::origin(), orientation: UnitQuaternion::identity() };
/// assert_eq!(particle_colours(&[particle], &[brick], 0), [[0.67, 0.27, 0.2]]);
/// ```
#[must_use]
pub fn particle_colours(particles: &[Particle], profiles: &[ColourSample], seed: u64) -> Vec<[f32; 3]> {
    let by_size = |chosen: &dyn Fn(&ColourSample) -> bool| -> Vec<ColourSample> {
        let mut of: Vec<ColourSample> = profiles.iter().copied().filter(|profile| chosen(profile)).collect();
        of.sort_by(|a, b| a.size.total_cmp(&b.size));
        of
    };
    let all = by_size(&|_| true);
    let of_category: Vec<Vec<ColourSample>> = (0..=u8::MAX)
        .map(|category| by_size(&|profile| profile.category == category))
        .collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(COLOURS);
    let mut draw = |particle: &Particle| {
        let own = &of_category[usize::from(particle.category)];
        let from = if own.is_empty() { &all } else { own };
        let few = (from.len() / 5).max(FEWEST).min(from.len());
        let middle = from.partition_point(|profile| profile.size < TYPICAL_PROFILE * particle.size);
        let first = middle.saturating_sub(few / 2).min(from.len() - few);
        let drawn = from.get(first + rng.random_range(0..few.max(1)));
        drawn.map_or([0.5; 3], |profile| profile.colour.map(single))
    };
    particles.iter().map(&mut draw).collect()
}

/// Smallest number of profiles that a colour is drawn from, if the category has as many.
const FEWEST: usize = 12;
/// Mean profile size of a particle of size 1: π / 4 for spheres.
const TYPICAL_PROFILE: f64 = std::f64::consts::FRAC_PI_4;

/// Random streams of the pipeline, apart from those of the rooms.
const COLOURS: u64 = 1 << 40;
