//! The main colours of a photo, and its two tones where it has no more.

use ndarray::Array2;
use stereology_imaging::distance_transform;

use crate::conversions::{single, whole_part};
use crate::ground::binder::{BinderModel, GUESSES};
use crate::ground::kmeans::{Clusters, kmeans, squared_distance};
use crate::ground::light::{Sample, sample};

/// Distance z of two tones.
pub(crate) const TONE_DISTANCE: f32 = 9.0;
/// Distance z of one standard deviation of the binder where no other tone mixes with it: three, beyond which a pixel is none of its, make five.
const BEYOND: f64 = 5.0 / 3.0;

/// The two tones of a photo, such as a tomogram or a thin section, where neither is narrow enough for [`BinderModel::fit`], by k-means.
///
/// # Examples
///
/// ```
/// use stereology_segment::{TwoTones, encoded_image};
///
/// // Pale squares of 20 pixels, 5 apart, both with strong texture.
/// let photo = image::RgbImage::from_fn(100, 100, |x, y| {
///     let level = if x % 25 < 20 && y % 25 < 20 { 160 } else { 60 };
///     image::Rgb([level + ((x * 7919 + y * 104_729) % 41) as u8; 3])
/// });
/// let picture = encoded_image(&photo);
/// let tones = TwoTones::find(&picture, 0).expect("two colours");
/// assert!(tones.apart() > 2.0 && tones.binder(&picture).distance(&picture)[[10, 10]] > 6.0);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct TwoTones {
    colours: [[f64; 3]; 2],
    shares: [f64; 2],
    apart: f64,
}

impl TwoTones {
    /// Finds them; `None` if the picture has one colour.
    ///
    /// # Complexity
    ///
    /// A sample of 16,000 pixels is looked at.
    #[must_use]
    pub fn find(picture: &Array2<[f32; 3]>, seed: u64) -> Option<Self> {
        let colours: Vec<[f64; 3]> = sample(picture).iter().map(|s| s.colour).collect();
        let Clusters {
            centres,
            assignment,
            inertia,
        } = kmeans(&colours, 2, seed);
        let &[a, b] = centres.as_slice() else { return None };
        let n = colours.len() as f64;
        let first = assignment.iter().filter(|g| **g == 0).count() as f64 / n;
        Some(Self {
            colours: [a, b],
            shares: [first, 1.0 - first],
            apart: squared_distance(&a, &b).sqrt() / (2.0 * (inertia / n).sqrt()),
        })
    }

    /// Distance of the tones over the sum of their scatters; below about 1.6 they are not two.
    #[must_use]
    pub fn apart(&self) -> f64 {
        self.apart
    }

    /// The tone in thinner threads as a binder. Halfway between the tones lies at z = 4.5, half of what separates them.
    ///
    /// # Complexity
    ///
    /// Linear in pixels.
    #[must_use]
    pub fn binder(&self, picture: &Array2<[f32; 3]>) -> BinderModel {
        let [a, b] = self.colours.map(|c| c.map(single));
        let near = |p: &[f32; 3], c: &[f32; 3]| (0..3).map(|i| (p[i] - c[i]).powi(2)).sum::<f32>();
        let is_a = picture.map(|p| near(p, &a) <= near(p, &b));
        let thin = usize::from(mean_depth(&is_a) > mean_depth(&is_a.mapv(|m| !m)));
        let step = squared_distance(&self.colours[0], &self.colours[1]).sqrt();
        BinderModel::flat(
            self.colours[thin],
            step / f64::from(TONE_DISTANCE),
            picture.dim(),
            self.shares[thin],
        )
    }

    /// Lowers the distances z to the [`binder`](Self::binder) of colours that lie beyond it, seen from the other tone, to five thirds of what they are in standard deviations of the binder's own colour on that
    /// side, if that is less; colours nearer than a third of the tones' distance are left as they are. Towards the other tone, half of what separates them tells particles; away from it only the binder's scatter can: deeper pores are the tail of the binder's colours, dark grains are not.
    ///
    /// # Complexity
    ///
    /// Linear in pixels.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_segment::{BinderModel, TwoTones, encoded_image};
    ///
    /// // Pale squares of 20 pixels, 5 apart, on a binder of levels 40 to 100; one of them is a black grain.
    /// let photo = image::RgbImage::from_fn(100, 100, |x, y| {
    ///     let texture = ((x * 7919 ^ y * 104_729) % 61) as u8;
    ///     let level = if x < 20 && y < 20 { 0 } else if x % 25 < 20 && y % 25 < 20 { 170 } else { 40 + texture };
    ///     image::Rgb([level; 3])
    /// });
    /// let picture = encoded_image(&photo);
    /// let tones = TwoTones::find(&picture, 0).expect("two colours");
    /// let binder = tones.binder(&picture);
    /// let plain = binder.distance(&picture);
    /// let mut distance = plain.clone();
    /// tones.lower_beyond(&binder, &picture, &mut distance);
    /// assert!(distance[[10, 10]] > 5.0 && distance[[30, 30]] == plain[[30, 30]]);
    /// ```
    pub fn lower_beyond(&self, binder: &BinderModel, picture: &Array2<[f32; 3]>, distance: &mut Array2<f32>) {
        let tone = binder.light(0, 0).map(f64::from);
        let [a, b] = self.colours;
        let nearer_a = squared_distance(&a, &tone) < squared_distance(&b, &tone);
        let other = if nearer_a { b } else { a };
        let is_beyond = |c: &[f64; 3]| (0..3).map(|i| (c[i] - tone[i]) * (other[i] - tone[i])).sum::<f64>() <= 0.0;
        let mut samples = sample(picture);
        samples.retain(|s| is_beyond(&s.colour));
        // Together with their reflections the binder's tone is their middle.
        for i in 0..samples.len() {
            let Sample { place, colour } = samples[i];
            let colour = std::array::from_fn(|c| 2.0 * tone[c] - colour[c]);
            samples.push(Sample { place, colour });
        }
        let mut own = binder.clone();
        // What lies further than halfway is in question and has no say.
        own.fit_round(&samples, f64::from(TONE_DISTANCE) / 2.0, 1);
        for (((y, x), z), colour) in distance.indexed_iter_mut().zip(picture) {
            // Nearer than a third of the way nothing is in question.
            if *z < TONE_DISTANCE / 3.0 {
                continue;
            }
            let colour = colour.map(f64::from);
            if is_beyond(&colour) {
                let deviations = own.squared(own.place(x, y), colour).sqrt();
                *z = z.min(single(BEYOND * deviations));
            }
        }
    }
}

/// The photo's eight main colours by k-means, sRGB / 255, and the share of pixels nearest to each, most first: to choose the binder from. Fewer if there are fewer.
///
/// # Examples
///
/// ```
/// use stereology_segment::{encoded_image, main_colours};
///
/// let photo = image::RgbImage::from_fn(40, 40, |x, _| image::Rgb([if x < 30 { 200 } else { 50 }; 3]));
/// let colours = main_colours(&encoded_image(&photo), 0);
/// assert_eq!((colours.len(), colours[0].1), (2, 0.75));
/// ```
#[must_use]
pub fn main_colours(picture: &Array2<[f32; 3]>, seed: u64) -> Vec<([f32; 3], f64)> {
    let colours: Vec<[f64; 3]> = sample(picture).iter().map(|s: &Sample| s.colour).collect();
    let groups = kmeans(&colours, GUESSES, seed);
    let share = |g: usize| groups.assignment.iter().filter(|a| **a == g).count() as f64 / colours.len() as f64;
    let main = groups.centres.iter().enumerate();
    main.map(|(g, centre)| (centre.map(single), share(g))).collect()
}

/// Colour of the densest spot of a picture's colours: the middle of the fullest cube of eight levels' side.
pub(crate) fn densest(picture: &Array2<[f32; 3]>) -> [f32; 3] {
    let mut counts = vec![0_u32; 32 * 32 * 32];
    let cube = |v: f32| whole_part(f64::from(v * 32.0)).min(31);
    for s in sample(picture) {
        let [r, g, b] = s.colour.map(|c| cube(single(c)));
        counts[(r * 32 + g) * 32 + b] += 1;
    }
    let fullest = (0..counts.len())
        .max_by_key(|&i| (counts[i], std::cmp::Reverse(i)))
        .unwrap_or(0);
    [fullest / 1024, fullest / 32 % 32, fullest % 32].map(|l| (l as f32 + 0.5) / 32.0)
}

/// Mean distance of a mask's pixels to its outline: threads are shallow, particles deep.
pub(crate) fn mean_depth(mask: &Array2<bool>) -> f64 {
    let depths = distance_transform(mask.view());
    let inside = depths.iter().filter(|d| **d > 0.0 && d.is_finite());
    let (sum, count) = inside.fold((0.0, 0.0), |(sum, count), d| (sum + f64::from(*d), count + 1.0));
    sum / f64::max(count, 1.0)
}
