//! The main colours of a photo, and the tones of a photo that has two.

use ndarray::Array2;
use stereology_imaging::distance_transform;

use crate::conversions::{single, whole_part};
use crate::ground::binder::{BinderModel, GUESSES};
use crate::ground::kmeans::{Clusters, kmeans, squared_distance};
use crate::ground::light::{Sample, sample};

/// Distance z between the two tones.
pub(crate) const TONE_DISTANCE: f32 = 9.0;
/// Distance z of one standard deviation of the binder on the side where no other tone mixes with it: three standard
/// deviations, beyond which a pixel is not binder, are the low threshold of five.
const BEYOND: f64 = 5.0 / 3.0;

/// The two tones, by k-means, of a photo such as a tomogram or a thin section in which neither tone is narrow enough
/// for [`BinderModel::fit`].
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
/// let image = encoded_image(&photo);
/// let tones = TwoTones::find(&image, 0).expect("two colours");
/// assert!(tones.separation() > 2.0 && tones.binder(&image).distance(&image)[[10, 10]] > 6.0);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct TwoTones {
    colours: [[f64; 3]; 2],
    fractions: [f64; 2],
    separation: f64,
}

impl TwoTones {
    /// Finds them; `None` if the image has one colour.
    ///
    /// # Complexity
    ///
    /// A sample of about 16,000 pixels is used.
    #[must_use]
    pub fn find(image: &Array2<[f32; 3]>, seed: u64) -> Option<Self> {
        let colours: Vec<[f64; 3]> = sample(image).iter().map(|s| s.colour).collect();
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
            fractions: [first, 1.0 - first],
            separation: squared_distance(&a, &b).sqrt() / (2.0 * (inertia / n).sqrt()),
        })
    }

    /// Distance of the tones over the sum of their scatters; below about 1.6 there are not two.
    #[must_use]
    pub fn separation(&self) -> f64 {
        self.separation
    }

    /// A binder of the tone that forms the thinner structures. The middle between the tones is at z = 4.5, half of
    /// their distance.
    ///
    /// # Complexity
    ///
    /// Linear in pixels.
    #[must_use]
    pub fn binder(&self, image: &Array2<[f32; 3]>) -> BinderModel {
        let [a, b] = self.colours.map(|c| c.map(single));
        let near = |p: &[f32; 3], c: &[f32; 3]| (0..3).map(|i| (p[i] - c[i]).powi(2)).sum::<f32>();
        let is_a = image.map(|p| near(p, &a) <= near(p, &b));
        let thin = usize::from(mean_depth(&is_a) > mean_depth(&is_a.mapv(|m| !m)));
        let step = squared_distance(&self.colours[0], &self.colours[1]).sqrt();
        BinderModel::flat(
            self.colours[thin],
            step / f64::from(TONE_DISTANCE),
            image.dim(),
            self.fractions[thin],
        )
    }

    /// Lowers the distances z from the [`binder`](Self::binder) of colours on its far side, away from the other tone,
    /// to 5/3 of the number of standard deviations of the binder's own colours on that side, where that is less.
    /// Colours nearer than a third of the tones' distance keep their distances.
    ///
    /// Towards the other tone, particles begin at half the distance of the tones. Away from it only the binder's
    /// scatter separates particles from binder: deep pores are in the tail of the binder's colours, dark grains are
    /// not.
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
    /// let image = encoded_image(&photo);
    /// let tones = TwoTones::find(&image, 0).expect("two colours");
    /// let binder = tones.binder(&image);
    /// let plain = binder.distance(&image);
    /// let mut distance = plain.clone();
    /// tones.lower_beyond(&binder, &image, &mut distance);
    /// assert!(distance[[10, 10]] > 5.0 && distance[[30, 30]] == plain[[30, 30]]);
    /// ```
    pub fn lower_beyond(&self, binder: &BinderModel, image: &Array2<[f32; 3]>, distance: &mut Array2<f32>) {
        let tone = binder.light(0, 0).map(f64::from);
        let [a, b] = self.colours;
        let nearer_a = squared_distance(&a, &tone) < squared_distance(&b, &tone);
        let other = if nearer_a { b } else { a };
        let is_beyond = |c: &[f64; 3]| (0..3).map(|i| (c[i] - tone[i]) * (other[i] - tone[i])).sum::<f64>() <= 0.0;
        let mut samples = sample(image);
        samples.retain(|s| is_beyond(&s.colour));
        // With their reflections added, the binder's tone is their mean.
        for i in 0..samples.len() {
            let Sample { place, colour } = samples[i];
            let colour = std::array::from_fn(|c| 2.0 * tone[c] - colour[c]);
            samples.push(Sample { place, colour });
        }
        let mut own = binder.clone();
        // Colours farther than half the distance of the tones may not be binder and do not take part in the fit.
        own.fit_round(&samples, f64::from(TONE_DISTANCE) / 2.0, 1);
        for (((y, x), z), colour) in distance.indexed_iter_mut().zip(image) {
            // Colours nearer than a third of the distance are certainly binder.
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

/// The photo's eight main colours by k-means, sRGB / 255, and the fraction of pixels nearest to each, most frequent
/// first: candidates for the binder. Fewer if the photo has fewer.
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
pub fn main_colours(image: &Array2<[f32; 3]>, seed: u64) -> Vec<([f32; 3], f64)> {
    let colours: Vec<[f64; 3]> = sample(image).iter().map(|s: &Sample| s.colour).collect();
    let groups = kmeans(&colours, GUESSES, seed);
    let fraction = |g: usize| groups.assignment.iter().filter(|a| **a == g).count() as f64 / colours.len() as f64;
    let main = groups.centres.iter().enumerate();
    main.map(|(g, centre)| (centre.map(single), fraction(g))).collect()
}

/// The most frequent colour: the centre of the fullest cube of eight levels' side.
pub(crate) fn densest(image: &Array2<[f32; 3]>) -> [f32; 3] {
    let mut counts = vec![0_u32; 32 * 32 * 32];
    let cube = |v: f32| whole_part(f64::from(v * 32.0)).min(31);
    for s in sample(image) {
        let [r, g, b] = s.colour.map(|c| cube(single(c)));
        counts[(r * 32 + g) * 32 + b] += 1;
    }
    let fullest = (0..counts.len())
        .max_by_key(|&i| (counts[i], std::cmp::Reverse(i)))
        .unwrap_or(0);
    [fullest / 1024, fullest / 32 % 32, fullest % 32].map(|l| (l as f32 + 0.5) / 32.0)
}

/// Mean distance of a mask's pixels from its outline: small for thin structures, large for particles.
pub(crate) fn mean_depth(mask: &Array2<bool>) -> f64 {
    let depths = distance_transform(mask.view());
    let inside = depths.iter().filter(|d| **d > 0.0 && d.is_finite());
    let (sum, count) = inside.fold((0.0, 0.0), |(sum, count), d| (sum + f64::from(*d), count + 1.0));
    sum / f64::max(count, 1.0)
}
