//! Images of plane sections.

use crate::colour::{add, to_bytes};
use crate::narrow::{number, whole_u32};
use crate::sections::Axis;
use crate::solid::Solid;
use crate::solid_error::SolidError;
use image::RgbImage;
use nalgebra::{Point3, Unit, UnitVector3, Vector3};
use ndarray::Array2;
use rayon::prelude::*;

/// Images have at most this many pixels.
const MOST_PIXELS: u64 = 1 << 30;
/// A pixel larger than the residual's voxels averages at most this many of them along each axis.
const MOST_RESIDUAL_SAMPLES: f64 = 4.0;

/// A plane with the position and orientation of an image on it: its corner and the directions of its rows and columns.
///
/// # Examples
///
/// ```
/// use nalgebra::{Point3, Vector3};
/// use stereology_volume::{Axis, SlicePlane};
///
/// // Rows of a section perpendicular to z run along x, as in an array (z, y, x).
/// let plane = SlicePlane::across(Axis::Z, 3.0);
/// assert_eq!(plane.point(1.0, 2.0), Point3::new(1.0, 2.0, 3.0));
///
/// let oblique = SlicePlane::oblique(Vector3::new(1.0, 1.0, 0.0), 2.0)?;
/// let p = oblique.point(5.0, 7.0);
/// assert!(((p.x + p.y) / 2.0_f64.sqrt() - 2.0).abs() < 1e-12);
/// # Ok::<(), stereology_volume::SolidError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlicePlane {
    corner: Point3<f64>,
    right: UnitVector3<f64>,
    down: UnitVector3<f64>,
}

impl SlicePlane {
    /// The plane perpendicular to an axis at a depth along it, in units of length. The image is the slice of an array
    /// (z, y, x): its rows run along the faster of the other two axes.
    #[must_use]
    pub fn across(axis: Axis, depth: f64) -> Self {
        let (right, down) = match axis {
            Axis::X => (Vector3::y_axis(), Vector3::z_axis()),
            Axis::Y => (Vector3::x_axis(), Vector3::z_axis()),
            Axis::Z => (Vector3::x_axis(), Vector3::y_axis()),
        };
        Self {
            corner: Point3::from(depth * axis.direction().into_inner()),
            right,
            down,
        }
    }

    /// The plane n·p = `offset`, where n is the normalised normal; the image's corner is its point nearest to the
    /// origin.
    ///
    /// # Errors
    ///
    /// [`SolidError::Plane`] if the normal is zero or any number not finite.
    pub fn oblique(normal: Vector3<f64>, offset: f64) -> Result<Self, SolidError> {
        let refused = SolidError::Plane {
            normal: normal.into(),
            offset,
        };
        let largest = normal.amax();
        if !(normal.iter().all(|x| x.is_finite()) && largest > 0.0 && offset.is_finite()) {
            return Err(refused);
        }
        // Divided by the largest component first, as squares of very large or small components would overflow.
        let normal = Unit::new_normalize(normal / largest);
        // The rows follow the x axis, or the y axis if the normal is close to x.
        let along = if normal.x.abs() < 0.9 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let right = Unit::new_normalize(along - normal.dot(&along) * normal.into_inner());
        let down = Unit::new_normalize(normal.cross(&right));
        Ok(Self {
            corner: Point3::from(offset * normal.into_inner()),
            right,
            down,
        })
    }

    /// The point `right` and `down` units of length from the image's corner.
    #[must_use]
    pub fn point(&self, right: f64, down: f64) -> Point3<f64> {
        self.corner + right * self.right.into_inner() + down * self.down.into_inner()
    }
}

impl Solid {
    /// Image of a section: `width` × `height` pixels of edge `pixel`.
    ///
    /// A pixel whose corners lie in different particles is sampled at n × n points ([`Solid::with_border_samples`]) and
    /// gets the mean of their colours, like the pixel of a photograph. The residual is taken at its centre, or averaged
    /// over at most 4 × 4 points if a pixel is larger than the residual's voxels. All other pixels have the colour of
    /// their centre. The bytes are the same at any number of threads.
    ///
    /// # Errors
    ///
    /// [`SolidError::Picture`] if `pixel` is not a positive length or the image has no or more than 2³⁰ pixels.
    ///
    /// # Examples
    ///
    /// ```
    /// # use nalgebra::{Point3, UnitQuaternion, Vector3};
    /// # use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
    /// # use stereology_volume::{Axis, SlicePlane, Solid};
    /// # let sphere = UnitBody::new(&Body::sphere(1.0)?);
    /// # let particle = Particle { shape: 0, size: 6.0, category: 0, position: Point3::new(5.0, 5.0, 5.0), orientation: UnitQuaternion::identity() };
    /// # let period = PeriodicBox::new(Vector3::repeat(10.0))?;
    /// let solid = Solid::new(Arrangement::new(vec![sphere], vec![particle], period)?, vec![[1.0, 0.0, 0.0]], [0.0; 3], None)?;
    /// let image = solid.slice(&SlicePlane::across(Axis::Z, 5.0), 100, 100, 0.1)?;
    /// assert_eq!(image.get_pixel(50, 50).0, [255, 0, 0]);
    /// assert_eq!(image.get_pixel(10, 10).0, [0, 0, 0]);
    /// let red: f64 = image.pixels().map(|p| f64::from(p.0[0]) / 255.0 * 0.01).sum();
    /// assert!((red - 9.0 * std::f64::consts::PI).abs() < 0.02); // the area of the profile
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn slice(&self, plane: &SlicePlane, width: u32, height: u32, pixel: f64) -> Result<RgbImage, SolidError> {
        check_picture(width, height, pixel)?;
        let mut picture = RgbImage::new(width, height);
        let row_bytes = 3 * width as usize;
        picture.par_chunks_mut(row_bytes).enumerate().for_each(|(row, bytes)| {
            let top = row as f64 * pixel;
            let corner_ids = |down: f64| -> Vec<Option<usize>> {
                (0..=width)
                    .map(|column| self.id_at(&plane.point(f64::from(column) * pixel, down)))
                    .collect()
            };
            let (above, below) = (corner_ids(top), corner_ids(top + pixel));
            for (column, place) in bytes.chunks_exact_mut(3).enumerate() {
                let left = column as f64 * pixel;
                let corners = [above[column], above[column + 1], below[column], below[column + 1]];
                let colour = self.pixel_colour(plane, [left, top], pixel, &corners);
                place.copy_from_slice(&to_bytes(colour));
            }
        });
        Ok(picture)
    }

    /// Ids of a section: 0 where the centre of a pixel lies in the binder, else the particle's index + 1; axes (y, x).
    ///
    /// # Errors
    ///
    /// As [`Solid::slice`].
    pub fn slice_ids(
        &self,
        plane: &SlicePlane,
        width: u32,
        height: u32,
        pixel: f64,
    ) -> Result<Array2<u32>, SolidError> {
        check_picture(width, height, pixel)?;
        let mut ids = vec![0; width as usize * height as usize];
        ids.par_chunks_mut(width as usize).enumerate().for_each(|(row, ids)| {
            for (column, id) in ids.iter_mut().enumerate() {
                let p = plane.point((column as f64 + 0.5) * pixel, (row as f64 + 0.5) * pixel);
                *id = self.id_at(&p).map_or(0, |id| number(id) + 1);
            }
        });
        let ids = Array2::from_shape_vec((height as usize, width as usize), ids);
        ids.map_err(|_| SolidError::Picture { width, height, pixel })
    }

    /// Colour of the pixel whose corner is at (left, top) of the image.
    fn pixel_colour(
        &self,
        plane: &SlicePlane,
        [left, top]: [f64; 2],
        pixel: f64,
        corners: &[Option<usize>; 4],
    ) -> [f32; 3] {
        // The centres of n × n parts of the pixel, wrapped into the box.
        let places = |n: u32| {
            let step = pixel / f64::from(n);
            let centre = move |i: u32| (f64::from(i) + 0.5) * step;
            (0..n * n).map(move |i| {
                self.period()
                    .wrap(&plane.point(left + centre(i % n), top + centre(i / n)))
            })
        };
        let centre = self.id_within(&self.period().wrap(&plane.point(left + 0.5 * pixel, top + 0.5 * pixel)));
        let (mean, particle_share) = if self.border_samples() < 2 || corners.iter().all(|id| *id == centre) {
            (self.mean_colour(centre), f32::from(u8::from(centre.is_some())))
        } else {
            let ids = places(self.border_samples()).map(|p| self.id_within(&p));
            average(ids.map(|id| (self.mean_colour(id), f32::from(u8::from(id.is_some())))))
        };
        let Some(voxel) = self.residual_voxel() else {
            return mean;
        };
        let n = whole_u32((pixel / voxel).round().clamp(1.0, MOST_RESIDUAL_SAMPLES));
        let residual = |in_particle: bool| average(places(n).map(|p| (self.residual_within(&p, in_particle), 0.0))).0;
        let mut colour = mean;
        for (in_particle, share) in [(true, particle_share), (false, 1.0 - particle_share)] {
            if share > 0.0 {
                colour = add(colour, residual(in_particle).map(|value| share * value));
            }
        }
        colour
    }
}

fn average(values: impl ExactSizeIterator<Item = ([f32; 3], f32)>) -> ([f32; 3], f32) {
    let weight = 1.0 / values.len() as f32;
    let (colour, share) = values.fold(([0.0; 3], 0.0), |(colour, share), (c, s)| (add(colour, c), share + s));
    (colour.map(|value| value * weight), share * weight)
}

fn check_picture(width: u32, height: u32, pixel: f64) -> Result<(), SolidError> {
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels > MOST_PIXELS || !(pixel.is_finite() && pixel > 0.0) {
        return Err(SolidError::Picture { width, height, pixel });
    }
    Ok(())
}
