//! Colours of the particles: each gets that of a profile of its category and of similar size.

use crate::pipeline::narrowing::single;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology_anneal::Packing;
use stereology_segment::Profile;
use stereology_shape::Particle;

/// For each particle the mean colour of a random profile, drawn from those of its category that are nearest in size:
/// section 4.2.
///
/// The paper draws from all profiles of a category. Where colours within a category vary with size (black dust and teal
/// slabs, both dark), that gives the few large particles the colours of the many small ones. Here a fifth of the
/// category, at least a dozen profiles, is drawn from. `pixel` is the size of a pixel in the unit of length of the
/// packing. Profiles outside the counting frame are drawn too; a category without profiles draws from all.
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
        drawn.map_or([0.5; 3], |profile| profile.colour.map(single))
    };
    packing.particles().iter().map(&mut draw).collect()
}

/// Smallest number of profiles that a colour is drawn from, if the category has as many.
const FEWEST: usize = 12;
/// Mean profile size of a particle of size 1: π / 4 for spheres.
const TYPICAL_PROFILE: f64 = std::f64::consts::FRAC_PI_4;

/// Random streams of the pipeline, apart from those of the rooms.
const COLOURS: u64 = 1 << 40;
