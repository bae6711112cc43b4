//! Which colour each particle gets: that of a profile of its category, of about its size.

#![allow(clippy::cast_possible_truncation, reason = "colours are f32 in a solid")]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_anneal::Packing;
use stereology_segment::Profile;
use stereology_shape::Particle;

/// The mean colour of a randomly chosen profile for each particle, drawn from those of its category that are nearest to it in size: section 4.2.
///
/// The paper draws from all of a category. Where colours inside a category still differ by size (black dust and teal slabs that are both dark), that paints
/// the few large particles in the colours of the many small ones; a fifth of the category, at least a dozen, is drawn from instead. `pixel` is the size of a
/// pixel in the packing's unit of length. Profiles outside the counting frame have colours too and are drawn as well; a category without profiles takes from
/// all.
///
/// # Examples
///
/// ```
/// use image::{Rgb, RgbImage};
/// use nalgebra::{Point3, UnitQuaternion, Vector3};
/// use ndarray::Array2;
/// use stereology::anneal::Packing;
/// use stereology::pipeline::{ParticleTypes, particle_colours};
/// use stereology::segment::{SegmentOptions, Segmentation};
/// use stereology::shape::{Arrangement, Particle, PeriodicBox};
///
/// // One brick profile; every particle becomes brick.
/// let brick = |x: usize, y: usize| (20..60).contains(&x) && (30..50).contains(&y);
/// let photo = RgbImage::from_fn(80, 80, |x, y| Rgb(if brick(x as usize, y as usize) { [170, 70, 50] } else { [225, 220, 210] }));
/// let labels = Array2::from_shape_fn((80, 80), |(y, x)| u32::from(brick(x, y)));
/// let found = Segmentation::from_labels(&photo, labels, &SegmentOptions::default())?;
/// let particle = Particle { shape: 0, size: 4.0, category: 0, position: Point3::origin(), orientation: UnitQuaternion::identity() };
/// let spheres = ParticleTypes::parse(&["sphere"])?.unit_bodies();
/// let packing = Packing::verify(&Arrangement::new(&spheres[..], vec![particle], PeriodicBox::new(Vector3::repeat(10.0))?)?)?;
/// let red = particle_colours(&packing, &found.profiles, 1.0, 0)[0][0];
/// assert!((red - 170.0 / 255.0).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn particle_colours(packing: &Packing, profiles: &[Profile], pixel: f64, seed: u64) -> Vec<[f32; 3]> {
    let by_size = |chosen: &dyn Fn(&Profile) -> bool| -> Vec<&Profile> {
        let mut of: Vec<&Profile> = profiles.iter().filter(|profile| chosen(profile)).collect();
        of.sort_by(|a, b| a.size.total_cmp(&b.size).then(a.id.cmp(&b.id)));
        of
    };
    let all = by_size(&|_| true);
    let of_category: Vec<Vec<&Profile>> = (0..=u8::MAX)
        .map(|category| by_size(&|profile| profile.category == category))
        .collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(COLOURS);
    let mut draw = |particle: &Particle| {
        let own = &of_category[usize::from(particle.category)];
        let from = if own.is_empty() { &all } else { own };
        let few = (from.len() / 5).max(FEWEST).min(from.len());
        let middle = from.partition_point(|profile| profile.size * pixel < TYPICAL_PROFILE * particle.size);
        let first = middle.saturating_sub(few / 2).min(from.len() - few);
        let drawn = from.get(first + rng.random_range(0..few.max(1)));
        drawn.map_or([0.5; 3], |profile| profile.colour.map(|c| c as f32))
    };
    packing.particles().iter().map(&mut draw).collect()
}

/// Fewest profiles that a colour is drawn from, if there are so many.
const FEWEST: usize = 12;
/// A profile is this large on the average over the sections of a particle of size 1: π / 4 for spheres.
const TYPICAL_PROFILE: f64 = std::f64::consts::FRAC_PI_4;

/// Random streams of the pipeline, apart from those of the rooms.
const COLOURS: u64 = 1 << 40;
