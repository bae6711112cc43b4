//! One period of the solid as voxels, in memory or in files.

#![allow(
    clippy::cast_possible_truncation,
    reason = "ids are checked against 2^31 by Solid::new; distances are stored as f32"
)]

use crate::Solid;
use crate::cells::Marks;
use crate::colour::{Lanes, to_bytes};
use crate::row::{Row, index};
use nalgebra::{Point3, Vector3};
use ndarray::{ArrayViewMut2, ArrayViewMut3, aview2};
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::path::Path;
use std::str::FromStr;
use stereology_grid::{Element, Format, GridError, VolumeShape, resume_volume, write_volume};

/// What a voxel says of the point at its centre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Colour: three of `u8`, clamped here and nowhere before.
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

/// A name that is no channel.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{name}' is no channel; use rgb, id, category, distance or alpha")]
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

/// How many voxels one period has along x, y, z, and how large they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelGrid {
    /// Voxels along x, y, z.
    pub counts: [usize; 3],
    /// Edges of a voxel along x, y, z: side / count, so they may differ a little where the box is not cubic.
    pub spacing: [f64; 3],
    /// A colour is the mean over this many points along each axis of its voxel (a box filter); 1: the colour of its centre.
    pub samples: usize,
}

impl VoxelGrid {
    /// The array's shape with this many channels.
    #[must_use]
    pub fn shape(&self, channels: usize) -> VolumeShape {
        let [nx, ny, nz] = self.counts;
        VolumeShape { nz, ny, nx, channels }
    }

    /// Centre of voxel (i, j, k) along x, y, z.
    #[must_use]
    pub fn centre(&self, [i, j, k]: [usize; 3]) -> Point3<f64> {
        let along = |n: usize, axis: usize| (n as f64 + 0.5) * self.spacing[axis];
        Point3::new(along(i, 0), along(j, 1), along(k, 2))
    }

    /// The points at this offset from the centres of a row of voxels.
    fn row(&self, y: usize, z: usize, offset: &Vector3<f64>) -> Row {
        let first = self.centre([0, y, z]) + offset;
        Row::new([first.y, first.z], self.spacing[0], offset.x)
    }
}

impl Solid {
    /// One period with `along_longest` voxels (at least 1) along the longest side and as many along the others as keep them nearly cubic.
    ///
    /// ```
    /// # use nalgebra::Vector3;
    /// # use stereology_shape::PeriodicBox;
    /// # use stereology_volume::Solid;
    /// let period = PeriodicBox::new(Vector3::new(10.0, 20.0, 4.9))?;
    /// let solid = Solid::new(vec![], vec![], vec![], period, [0.5; 3], None)?;
    /// assert_eq!(solid.voxel_grid(100).counts, [50, 100, 25]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn voxel_grid(&self, along_longest: usize) -> VoxelGrid {
        let sides = self.period().sides();
        let counts = [0, 1, 2].map(|k| {
            let share = sides[k] / sides.max();
            // The longest side gets exactly what was asked for, however large that number is.
            if share >= 1.0 {
                along_longest.max(1)
            } else {
                (share * along_longest as f64).round().max(1.0) as usize
            }
        });
        VoxelGrid {
            counts,
            spacing: [0, 1, 2].map(|k| sides[k] / counts[k] as f64),
            samples: 1,
        }
    }

    /// Fills the slab of voxels at `z` with colours; axes (y, x, channel), three channels, rows shared among threads.
    ///
    /// The colour of a voxel is the mean over `grid.samples`³ points spread evenly in it; 4³ leave steps of 1/64 at the borders of particles.
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
        let share = Lanes::splat(1.0 / offsets.len() as f32);
        let buffers = || (Marks::new(nx), vec![Lanes::ZERO; nx], Vec::with_capacity(nx));
        let fill = |(marks, sums, bytes): &mut (Marks, Vec<Lanes>, Vec<[u8; 3]>),
                    (y, mut voxels): (usize, ArrayViewMut2<'_, u8>)| {
            sums.fill(Lanes::ZERO);
            for (offset, places) in offsets.iter().zip(places.iter().cycle()) {
                let row = grid.row(y, z, offset);
                self.ids_along(&row, marks);
                self.add_colours_along(&row, &marks.ids, places.as_ref(), sums);
            }
            bytes.clear();
            bytes.extend(sums.iter().map(|sum| to_bytes(*sum * share)));
            voxels.assign(&aview2(bytes));
        };
        rows(&mut slab).into_par_iter().enumerate().for_each_init(buffers, fill);
    }

    /// Fills the slab at `z` with ids: 0 in the binder, else index + 1.
    pub fn fill_ids(&self, grid: &VoxelGrid, z: usize, slab: ArrayViewMut3<'_, u32>) {
        let ids = |row: &Row, marks: &mut Marks| self.ids_along(row, marks);
        fill_by_id(grid, z, slab, ids, |id| id.map_or(0, |id| id as u32 + 1));
    }

    /// Fills the slab at `z` with categories: 0 in the binder, else category + 1.
    pub fn fill_categories(&self, grid: &VoxelGrid, z: usize, slab: ArrayViewMut3<'_, u8>) {
        let ids = |row: &Row, marks: &mut Marks| self.ids_along(row, marks);
        fill_by_id(grid, z, slab, ids, |id| {
            id.map_or(0, |id| self.particles()[id].category + 1)
        });
    }

    /// Fills the slab at `z` with signed distances.
    pub fn fill_distances(&self, grid: &VoxelGrid, z: usize, mut slab: ArrayViewMut3<'_, f32>) {
        rows(&mut slab).into_par_iter().enumerate().for_each(|(y, mut row)| {
            for (x, voxel) in row.iter_mut().enumerate() {
                *voxel = self.distance_at(&grid.centre([x, y, z])) as f32;
            }
        });
    }

    /// Fills the slab at `z` with 0 in voids, else 255.
    pub fn fill_alpha(&self, grid: &VoxelGrid, z: usize, slab: ArrayViewMut3<'_, u8>) {
        let voids = |row: &Row, marks: &mut Marks| self.voids_along(row, marks);
        fill_by_id(grid, z, slab, voids, |void| if void.is_some() { 0 } else { 255 });
    }

    /// Writes one period of the solid as voxels of `grid`, as a file of any format; all formats hold the same bytes, at any number of threads.
    ///
    /// `progress` is told the share that is done and may break off. Memory beside the solid: one slab.
    ///
    /// # Errors
    ///
    /// [`GridError`], [`GridError::Cancelled`] included; nothing is left behind then.
    ///
    /// # Examples
    ///
    /// ```
    /// # use nalgebra::{Point3, UnitQuaternion, Vector3};
    /// # use std::ops::ControlFlow;
    /// # use stereology_shape::{Body, Particle, PeriodicBox, UnitBody};
    /// use stereology_grid::{Format, read_npy};
    /// use stereology_volume::{Channel, Solid};
    /// # let sphere = UnitBody::new(&Body::sphere(1.0)?);
    /// # let particle = Particle { shape: 0, size: 6.0, category: 0, position: Point3::new(5.0, 5.0, 5.0), orientation: UnitQuaternion::identity() };
    /// # let period = PeriodicBox::new(Vector3::repeat(10.0))?;
    /// # let solid = Solid::new(vec![sphere], vec![particle], vec![[1.0, 0.0, 0.0]], period, [0.0; 3], None)?;
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
        progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
    ) -> Result<(), GridError> {
        self.write(path.as_ref(), format, grid, channel, false, progress)
    }

    /// Writes the same file as [`Self::write_voxels`], goes on from `FILE.partial` if there is one, and leaves it there if it is broken off: see [`resume_volume`].
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
        progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
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
        progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
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

/// A file of voxels to be written.
struct VoxelFile<'a> {
    path: &'a Path,
    format: Format,
    grid: &'a VoxelGrid,
    resume: bool,
    progress: &'a (dyn Fn(f64) -> ControlFlow<()> + Sync),
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
            resume_volume(self.path, self.format, shape, self.grid.spacing, slab)
        } else {
            write_volume(self.path, self.format, shape, self.grid.spacing, slab)
        }
    }
}

/// Asks `value` for every voxel of a slab, of the particle at its centre. The centres lie in the box: no wrapping is needed.
fn fill_by_id<T: Send>(
    grid: &VoxelGrid,
    z: usize,
    mut slab: ArrayViewMut3<'_, T>,
    mark: impl Fn(&Row, &mut Marks) + Sync,
    value: impl Fn(Option<usize>) -> T + Sync,
) {
    let buffer = || Marks::new(grid.counts[0]);
    let fill = |marks: &mut Marks, (y, mut voxels): (usize, ArrayViewMut2<'_, T>)| {
        mark(&grid.row(y, z, &Vector3::zeros()), marks);
        for (voxel, &id) in voxels.iter_mut().zip(&marks.ids) {
            *voxel = value(index(id));
        }
    };
    rows(&mut slab).into_par_iter().enumerate().for_each_init(buffer, fill);
}

fn rows<'a, T>(slab: &'a mut ArrayViewMut3<'_, T>) -> Vec<ArrayViewMut2<'a, T>> {
    slab.outer_iter_mut().collect()
}
