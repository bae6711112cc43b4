//! One period of the solid as voxels, in memory or in files.

use crate::colour::row_to_bytes;
use crate::narrow::{number, single, whole};
use crate::row::Row;
use crate::row_colours::RowColours;
use crate::solid::Solid;
use crate::strip::{Runs, Strip};
use nalgebra::{Point3, Vector3};
use ndarray::{Array3, ArrayViewMut3};
use rayon::prelude::*;
use std::path::Path;
use std::slice::ChunksExactMut;
use std::str::FromStr;
use stereology_grid::{Element, Format, GridError, LengthUnit, VolumeShape, VoxelSize, resume_volume, write_volume};
use stereology_metrics::Progress;

/// Rows processed together: enough to share the particles they meet, few enough to distribute among threads.
const ROWS_AT_A_TIME: usize = 64;

/// The property of the solid that voxels hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Colour: three `u8`, clamped only here.
    Rgb,
    /// Particle: `u32`, 0 in the binder, else the particle's index + 1.
    Id,
    /// Category: `u8`, 0 in the binder, else the particle's category + 1.
    Category,
    /// Distance to the nearest surface of a particle, negative inside: `f32`.
    Distance,
    /// Mask: `u8`, 0 in a void, else 255.
    Alpha,
}

/// A name that is not a channel.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{name}' is not a channel; use rgb, id, category, distance or alpha")]
#[non_exhaustive]
pub struct ChannelError {
    /// The name given.
    pub name: String,
}

impl FromStr for Channel {
    type Err = ChannelError;

    fn from_str(name: &str) -> Result<Self, ChannelError> {
        match name {
            "rgb" => Ok(Self::Rgb),
            "id" => Ok(Self::Id),
            "category" => Ok(Self::Category),
            "distance" => Ok(Self::Distance),
            "alpha" => Ok(Self::Alpha),
            _ => Err(ChannelError { name: name.to_owned() }),
        }
    }
}

/// Number and size of the voxels of one period along x, y, z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelGrid {
    /// Voxels along x, y, z.
    pub counts: [usize; 3],
    /// Edges of a voxel along x, y, z: side / count, so they may differ a little where the box is not cubic.
    pub spacing: [f64; 3],
    /// Unit of length of the spacing, for the formats that store one.
    pub unit: Option<LengthUnit>,
    /// A colour is the mean over this many points along each axis of its voxel (a box filter); 1: the colour of its
    /// centre.
    pub samples: usize,
}

impl VoxelGrid {
    /// The array's shape with this many channels.
    #[must_use]
    pub fn shape(&self, channels: usize) -> VolumeShape {
        let [nx, ny, nz] = self.counts;
        VolumeShape { nz, ny, nx, channels }
    }

    /// Size of a voxel, with its unit.
    fn size(&self) -> VoxelSize {
        VoxelSize {
            sides: self.spacing,
            unit: self.unit,
        }
    }

    /// Centre of voxel (i, j, k) along x, y, z.
    #[must_use]
    pub fn centre(&self, [i, j, k]: [usize; 3]) -> Point3<f64> {
        let along = |n: usize, axis: usize| (n as f64 + 0.5) * self.spacing[axis];
        Point3::new(along(i, 0), along(j, 1), along(k, 2))
    }

    /// The y range of some rows of voxels.
    fn ends_along_y(&self, first: usize, rows: usize) -> [f64; 2] {
        [first, first + rows].map(|y| y as f64 * self.spacing[1])
    }

    /// The points at this offset from the centres of a row of voxels.
    fn row(&self, y: usize, z: usize, offset: &Vector3<f64>) -> Row {
        let first = self.centre([0, y, z]) + offset;
        Row::new([first.y, first.z], self.spacing[0], offset.x)
    }
}

impl Solid {
    /// One period with `along_longest` voxels (at least 1) along the longest side, and numbers along the others that
    /// keep voxels nearly cubic.
    ///
    /// ```
    /// # use nalgebra::Vector3;
    /// # use stereology_shape::{Arrangement, PeriodicBox};
    /// # use stereology_volume::Solid;
    /// let period = PeriodicBox::new(Vector3::new(10.0, 20.0, 4.9))?;
    /// let solid = Solid::new(Arrangement::new(vec![], vec![], period)?, vec![], [0.5; 3], None)?;
    /// assert_eq!(solid.voxel_grid(100).counts, [50, 100, 25]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn voxel_grid(&self, along_longest: usize) -> VoxelGrid {
        let sides = self.period().sides();
        let counts = [0, 1, 2].map(|k| {
            let share = sides[k] / sides.max();
            // The longest side gets exactly the requested number, however large.
            if share >= 1.0 {
                along_longest.max(1)
            } else {
                whole((share * along_longest as f64).round().max(1.0))
            }
        });
        VoxelGrid {
            counts,
            spacing: [0, 1, 2].map(|k| sides[k] / counts[k] as f64),
            unit: None,
            samples: 1,
        }
    }

    /// Fills the slab of voxels at `z` with colours; axes (y, x, channel), three channels, in parallel over rows.
    ///
    /// The colour of a voxel is the mean over `grid.samples`³ points spread evenly in it; 4³ leave steps of 1/64 at the
    /// borders of particles.
    ///
    /// # Panics
    ///
    /// If the slab does not have the shape of `grid`.
    pub fn fill_rgb(&self, grid: &VoxelGrid, z: usize, mut slab: ArrayViewMut3<'_, u8>) {
        let n = grid.samples.max(1);
        let along = |i: usize, axis: usize| ((i as f64 + 0.5) / n as f64 - 0.5) * grid.spacing[axis];
        let offsets: Vec<Vector3<f64>> = (0..n.pow(3))
            .map(|i| Vector3::new(along(i % n, 0), along(i / n % n, 1), along(i / n / n, 2)))
            .collect();
        // Offsets differ along x among the first n only, and then repeat.
        let [nx, ..] = grid.counts;
        let places: Vec<_> = offsets[..n]
            .iter()
            .map(|offset| self.places_along(&grid.row(0, z, offset), nx))
            .collect();
        let share = 1.0 / offsets.len() as f32;
        by_strips(grid, 3, &mut slab, |first, rows| {
            let ys = grid.ends_along_y(first, rows.len());
            let strip = |plane: &[Vector3<f64>]| self.strip(grid.row(0, z, &plane[0]).z, ys);
            let strips: Vec<Strip<'_>> = offsets.chunks(n * n).map(strip).collect();
            let (mut runs, mut into) = (Runs::new(nx), RowColours::new(nx));
            let mut sums = Vec::new();
            for (y, bytes) in (first..).zip(rows) {
                sums.clear();
                sums.resize(if n > 1 { 3 * nx } else { 0 }, 0.0);
                for (i, offset) in offsets.iter().enumerate() {
                    let row = grid.row(y, z, offset);
                    strips[i / n / n].cut(&row, &mut runs);
                    let colours = self.colours_along(&row, &runs, places[i % n].as_ref(), &mut into);
                    if n == 1 {
                        row_to_bytes(colours, bytes);
                    } else {
                        sums.iter_mut().zip(colours).for_each(|(sum, colour)| *sum += colour);
                    }
                }
                if n > 1 {
                    sums.iter_mut().for_each(|sum| *sum *= share);
                    row_to_bytes(&sums, bytes);
                }
            }
        });
    }

    /// Fills the slab at `z` with ids: 0 in the binder, else index + 1.
    ///
    /// # Panics
    ///
    /// If the slab does not have the shape of `grid`.
    pub fn fill_ids(&self, grid: &VoxelGrid, z: usize, slab: ArrayViewMut3<'_, u32>) {
        let strip = |z: f64, ys: [f64; 2]| Some(self.strip(z, ys));
        fill_by_id(grid, z, slab, strip, |id| id.map_or(0, |id| number(id) + 1));
    }

    /// Fills the slab at `z` with categories: 0 in the binder, else category + 1.
    ///
    /// # Panics
    ///
    /// If the slab does not have the shape of `grid`.
    pub fn fill_categories(&self, grid: &VoxelGrid, z: usize, slab: ArrayViewMut3<'_, u8>) {
        let strip = |z: f64, ys: [f64; 2]| Some(self.strip(z, ys));
        fill_by_id(grid, z, slab, strip, |id| {
            id.map_or(0, |id| self.particles()[id].category + 1)
        });
    }

    /// Fills the slab at `z` with signed distances.
    ///
    /// # Panics
    ///
    /// If the slab does not have the shape of `grid`.
    pub fn fill_distances(&self, grid: &VoxelGrid, z: usize, mut slab: ArrayViewMut3<'_, f32>) {
        by_strips(grid, 1, &mut slab, |first, rows| {
            for (y, row) in (first..).zip(rows) {
                for (x, voxel) in row.iter_mut().enumerate() {
                    *voxel = single(self.distance_at(&grid.centre([x, y, z])));
                }
            }
        });
    }

    /// Fills the slab at `z` with 0 in voids, else 255.
    ///
    /// # Panics
    ///
    /// If the slab does not have the shape of `grid`.
    pub fn fill_alpha(&self, grid: &VoxelGrid, z: usize, slab: ArrayViewMut3<'_, u8>) {
        let strip = |z: f64, ys: [f64; 2]| self.strip_of_voids(z, ys);
        fill_by_id(grid, z, slab, strip, |void| if void.is_some() { 0 } else { 255 });
    }

    /// Writes one period of the solid as voxels of `grid`, as a file of any format; all formats hold the same bytes, at
    /// any number of threads.
    ///
    /// `progress` receives the fraction done and may cancel. Memory in addition to the solid: that of the format, two
    /// slabs or somewhat more ([`write_volume`]).
    ///
    /// # Errors
    ///
    /// [`GridError`], including [`GridError::Cancelled`]; no file is left then.
    ///
    /// # Examples
    ///
    /// ```
    /// # use nalgebra::{Point3, UnitQuaternion, Vector3};
    /// # use std::ops::ControlFlow;
    /// # use stereology_shape::{Arrangement, Body, Particle, PeriodicBox, UnitBody};
    /// use stereology_grid::{Format, read_npy};
    /// use stereology_volume::{Channel, Solid};
    /// # let sphere = UnitBody::new(&Body::sphere(1.0)?);
    /// # let particle = Particle { shape: 0, size: 6.0, category: 0, position: Point3::new(5.0, 5.0, 5.0), orientation: UnitQuaternion::identity() };
    /// # let period = PeriodicBox::new(Vector3::repeat(10.0))?;
    /// # let solid = Solid::new(Arrangement::new(vec![sphere], vec![particle], period)?, vec![[1.0, 0.0, 0.0]], [0.0; 3], None)?;
    /// # let folder = tempfile::tempdir()?;
    /// let file = folder.path().join("ids.npy");
    /// solid.write_voxels(&file, Format::Npy, &solid.voxel_grid(64), Channel::Id, &|_| ControlFlow::Continue(()))?;
    /// let inside = read_npy::<u32>(&file)?.iter().filter(|id| **id == 1).count();
    /// let fraction = inside as f64 / 64_f64.powi(3);
    /// assert!((fraction / (std::f64::consts::PI * 36.0 / 1000.0) - 1.0).abs() < 1e-2); // π d³ / 6 over the box
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn write_voxels(
        &self,
        path: impl AsRef<Path>,
        format: Format,
        grid: &VoxelGrid,
        channel: Channel,
        progress: Progress<'_>,
    ) -> Result<(), GridError> {
        self.write(path.as_ref(), format, grid, channel, false, progress)
    }

    /// Writes the same file as [`Self::write_voxels`], but continues from `FILE.partial` if there is one, and keeps it
    /// if cancelled; see [`resume_volume`].
    ///
    /// # Errors
    ///
    /// [`GridError`]; [`GridError::OtherPartial`] if `FILE.partial` is the beginning of another solid or channel.
    pub fn resume_voxels(
        &self,
        path: impl AsRef<Path>,
        format: Format,
        grid: &VoxelGrid,
        channel: Channel,
        progress: Progress<'_>,
    ) -> Result<(), GridError> {
        self.write(path.as_ref(), format, grid, channel, true, progress)
    }

    fn write(
        &self,
        path: &Path,
        format: Format,
        grid: &VoxelGrid,
        channel: Channel,
        resume: bool,
        progress: Progress<'_>,
    ) -> Result<(), GridError> {
        let file = VoxelFile {
            path,
            format,
            grid,
            resume,
            progress,
        };
        match channel {
            Channel::Rgb => file.write(3, |grid, z, slab| self.fill_rgb(grid, z, slab)),
            Channel::Id => file.write(1, |grid, z, slab| self.fill_ids(grid, z, slab)),
            Channel::Category => file.write(1, |grid, z, slab| self.fill_categories(grid, z, slab)),
            Channel::Distance => file.write(1, |grid, z, slab| self.fill_distances(grid, z, slab)),
            Channel::Alpha => file.write(1, |grid, z, slab| self.fill_alpha(grid, z, slab)),
        }
    }
}

/// A voxel file to write.
struct VoxelFile<'a> {
    path: &'a Path,
    format: Format,
    grid: &'a VoxelGrid,
    resume: bool,
    progress: Progress<'a>,
}

impl VoxelFile<'_> {
    fn write<T: Element>(
        &self,
        channels: usize,
        fill: impl Fn(&VoxelGrid, usize, ArrayViewMut3<'_, T>),
    ) -> Result<(), GridError> {
        let shape = self.grid.shape(channels);
        let slab = |z: usize, slab: ArrayViewMut3<'_, T>| {
            fill(self.grid, z, slab);
            (self.progress)((z + 1) as f64 / shape.nz as f64)
        };
        if self.resume {
            resume_volume(self.path, self.format, shape, self.grid.size(), slab)
        } else {
            write_volume(self.path, self.format, shape, self.grid.size(), slab)
        }
    }
}

/// Fills the runs of every row of a slab by `value`. The centres lie in the box, so no wrapping is needed.
fn fill_by_id<'a, T: Element>(
    grid: &VoxelGrid,
    z: usize,
    mut slab: ArrayViewMut3<'_, T>,
    strip: impl Fn(f64, [f64; 2]) -> Option<Strip<'a>> + Sync,
    value: impl Fn(Option<usize>) -> T + Sync,
) {
    by_strips(grid, 1, &mut slab, |first, rows| {
        let row_at = |y: usize| grid.row(y, z, &Vector3::zeros());
        let Some(strip) = strip(row_at(first).z, grid.ends_along_y(first, rows.len())) else {
            rows.for_each(|row| row.fill(value(None)));
            return;
        };
        let mut runs = Runs::new(grid.counts[0]);
        for (y, row) in (first..).zip(rows) {
            strip.cut(&row_at(y), &mut runs);
            for (voxels, id) in runs.iter() {
                row[voxels].fill(value(id));
            }
        }
    });
}

/// Fills the rows of a slab in blocks, in parallel: `fill` gets the index of the first row and the samples of each.
fn by_strips<T: Element>(
    grid: &VoxelGrid,
    channels: usize,
    slab: &mut ArrayViewMut3<'_, T>,
    fill: impl Fn(usize, ChunksExactMut<'_, T>) + Sync,
) {
    let [nx, ny, _] = grid.counts;
    assert_eq!(
        slab.dim(),
        (ny, nx, channels),
        "the slab's shape differs from the grid's"
    );
    if slab.is_empty() {
        return;
    }
    let row = nx * channels;
    if let Some(samples) = slab.as_slice_mut() {
        let strips = samples.par_chunks_mut(ROWS_AT_A_TIME * row).enumerate();
        strips.for_each(|(i, strip)| fill(i * ROWS_AT_A_TIME, strip.chunks_exact_mut(row)));
    } else {
        let mut samples = Array3::from_elem(slab.dim(), T::default());
        by_strips(grid, channels, &mut samples.view_mut(), fill);
        slab.assign(&samples);
    }
}
