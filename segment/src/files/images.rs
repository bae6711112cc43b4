//! Images of a segmentation, and the residual from which texture is made.

use std::path::Path;

use image::{Rgb, RgbImage};
use ndarray::{Array3, ArrayView3, Axis};
use stereology_grid::write_atomically;
use tiff::encoder::{TiffEncoder, colortype};

use crate::conversions::{index, level, single};
use crate::error::SegmentError;
use crate::files::label_raster::dimensions;
use crate::labels::profile::Index;
use crate::outlines::regions::neighbours4;
use crate::segmentation::Segmentation;

/// Colours of the outlines of categories: Okabe & Ito's, which colour-blind readers can distinguish, without black.
const OUTLINES: [[u8; 3]; 8] = [
    [230, 25, 75],
    [0, 158, 255],
    [0, 200, 60],
    [240, 228, 66],
    [204, 60, 220],
    [230, 159, 0],
    [0, 230, 220],
    [255, 255, 255],
];

impl Segmentation {
    /// The photo with a line one pixel wide just inside every profile, in the colour of its category; what was found
    /// but left out, as too small or a fleck of texture, is chequered in black.
    #[must_use]
    pub fn overlay(&self) -> RgbImage {
        let ids: Vec<u32> = self.profiles.iter().map(|p| p.id).collect();
        let places = Index::new(&ids);
        let mut out = self.photo.clone();
        for &[y, x] in self.rejected.iter().filter(|[y, x]| (y + x) % 2 == 0) {
            out.put_pixel(index(x), index(y), Rgb([0; 3]));
        }
        for ((y, x), &label) in self.labels.indexed_iter().filter(|(_, l)| **l != 0) {
            if neighbours4([y, x], self.labels.dim()).any(|q| self.labels[q] != label) {
                let category = usize::from(self.profiles[places.of(label)].category);
                out.put_pixel(index(x), index(y), Rgb(OUTLINES[category % OUTLINES.len()]));
            }
        }
        out
    }

    /// The photo with every profile replaced by the binder's mean colour.
    #[must_use]
    pub fn binder_image(&self) -> RgbImage {
        let colour = Rgb(self.binder.colour.map(level));
        let mut out = self.photo.clone();
        for (pixel, _) in out.pixels_mut().zip(&self.labels).filter(|(_, l)| **l != 0) {
            *pixel = colour;
        }
        out
    }

    /// Every profile in its mean colour and the rest in the binder's, rounded to 8 bits.
    #[must_use]
    pub fn means(&self) -> RgbImage {
        let ids: Vec<u32> = self.profiles.iter().map(|p| p.id).collect();
        let places = Index::new(&ids);
        let colours: Vec<Rgb<u8>> = self.profiles.iter().map(|p| Rgb(p.colour.map(level))).collect();
        let binder = Rgb(self.binder.colour.map(level));
        let mut out = self.photo.clone();
        for (pixel, &label) in out.pixels_mut().zip(&self.labels) {
            *pixel = if label == 0 { binder } else { colours[places.of(label)] };
        }
        out
    }

    /// The residual: photo / 255 − [`Profile::colour`](crate::Profile::colour), and −
    /// [`Binder::colour`](crate::Binder::colour) in the binder, axes (y, x, channel). Its mean over every profile and
    /// over the binder is 0, and mean colour + residual is the photo, both to the rounding of f32; so is
    /// [`means`](Self::means) + residual once rounded to 8 bits.
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_segment::{SegmentOptions, Segmentation};
    ///
    /// let photo = image::RgbImage::from_fn(20, 20, |x, y| image::Rgb([(x * y) as u8, x as u8, 90]));
    /// let labels = ndarray::Array2::from_shape_fn((20, 20), |(y, _)| u32::from(y < 8));
    /// let segmentation = Segmentation::from_labels(&photo, labels, &SegmentOptions::default())?;
    /// let residual = segmentation.residual();
    /// let [profile, binder] = [segmentation.profiles[0].colour, segmentation.binder.colour];
    /// let mut sum = 0.0;
    /// for ((y, x, c), r) in residual.indexed_iter() {
    ///     let mean = if y < 8 { profile } else { binder }[c];
    ///     assert!((mean + f64::from(*r) - f64::from(photo.get_pixel(x as u32, y as u32)[c]) / 255.0).abs() < 1e-7);
    ///     sum += if y < 8 { f64::from(*r) } else { 0.0 };
    /// }
    /// assert!(sum.abs() < 1e-5);
    /// # Ok::<(), stereology_segment::SegmentError>(())
    /// ```
    #[must_use]
    pub fn residual(&self) -> Array3<f32> {
        let ids: Vec<u32> = self.profiles.iter().map(|p| p.id).collect();
        let places = Index::new(&ids);
        let mut out = Array3::zeros((self.window.height, self.window.width, 3));
        for ((mut r, p), &label) in out
            .lanes_mut(Axis(2))
            .into_iter()
            .zip(self.photo.pixels())
            .zip(&self.labels)
        {
            let mean = if label == 0 {
                self.binder.colour
            } else {
                self.profiles[places.of(label)].colour
            };
            for c in 0..3 {
                r[c] = single(f64::from(p[c]) / 255.0 - mean[c]);
            }
        }
        out
    }

    /// The residual added to the binder's colour: the section as if every particle had that mean colour.
    #[must_use]
    pub fn residual_image(&self) -> RgbImage {
        let binder = self.binder.colour.map(level);
        let mut out = self.means();
        for (mean, pixel) in out.pixels_mut().zip(self.photo.pixels()) {
            for c in 0..3 {
                let shifted = i16::from(pixel[c]) - i16::from(mean[c]) + i16::from(binder[c]);
                mean[c] = u8::try_from(shifted.clamp(0, 255)).unwrap_or(255);
            }
        }
        out
    }

    /// Writes the residual as a 32-bit float TIFF of three channels; the file appears whole or not at all.
    ///
    /// # Errors
    ///
    /// The file cannot be written.
    pub fn write_residual(&self, path: impl AsRef<Path>) -> Result<(), SegmentError> {
        write_float_tiff(path, self.residual().view())
    }

    /// The photo that was segmented.
    #[must_use]
    pub fn photo(&self) -> &RgbImage {
        &self.photo
    }
}

fn write_float_tiff(path: impl AsRef<Path>, image: ArrayView3<'_, f32>) -> Result<(), SegmentError> {
    let (height, width, _) = image.dim();
    let (width, height) = dimensions((height, width));
    let samples: Vec<f32> = image.iter().copied().collect();
    Ok(write_atomically(path, |out| {
        let write = || -> tiff::TiffResult<()> {
            TiffEncoder::new(out)?.write_image::<colortype::RGB32Float>(width, height, &samples)
        };
        write().map_err(std::io::Error::other)
    })?)
}
