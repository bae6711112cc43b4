//! The voxels of a closed mesh.

use nalgebra::{Point3, Vector3};
use ndarray::Array3;
use rayon::prelude::*;
use stereology_shape::{ClosedMesh, InsideTest};

use crate::error::GrowError;

/// The voxels whose centres lie inside a mesh, and where they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Voxels {
    /// Whether a voxel (z, y, x) is inside.
    pub inside: Array3<bool>,
    /// Lowest corner of the first voxel, in the mesh's unit.
    pub origin: Point3<f64>,
    /// Side of a voxel, in the mesh's unit.
    pub spacing: f64,
}

impl Voxels {
    /// The mesh with `resolution` voxels along the longest side of its box; the shorter sides get the smallest number
    /// of whole voxels that covers them, centred. Exact for every centre; points on the surface are outside. Cost:
    /// about a microsecond per voxel of the box and core.
    ///
    /// # Errors
    ///
    /// [`GrowError::Resolution`], [`GrowError::EmptyMask`].
    ///
    /// # Examples
    ///
    /// ```
    /// use stereology_grow::Voxels;
    /// use stereology_shape::{ClosedMesh, TriangleMesh};
    ///
    /// let brick = ClosedMesh::try_from(TriangleMesh::cuboid([4.0, 2.0, 1.0]))?;
    /// let voxels = Voxels::of_mesh(&brick, 8)?;
    /// assert_eq!(voxels.inside.dim(), (2, 4, 8));
    /// assert!(voxels.inside.iter().all(|inside| *inside));
    /// assert_eq!(voxels.voxel_at(&nalgebra::Point3::new(-1.9, -0.9, 0.4)), Some([1, 0, 0]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most the resolution"
    )]
    pub fn of_mesh(mesh: &ClosedMesh, resolution: usize) -> Result<Self, GrowError> {
        Self::size_of(mesh, resolution)?;
        let (low, high) = mesh.as_triangle_mesh().bounding_box().ok_or(GrowError::EmptyMask)?;
        let (counts, spacing) = counts_along(&(high - low), resolution);
        let origin = nalgebra::center(&low, &high) - counts * (spacing / 2.0);
        let [nx, ny, nz] = [counts.x as usize, counts.y as usize, counts.z as usize];
        let test = InsideTest::new(mesh);
        let rows: Vec<Vec<bool>> = (0..nz * ny)
            .into_par_iter()
            .map(|row| {
                let centre = |x: usize| {
                    let place = Vector3::new(x as f64, (row % ny) as f64, (row / ny) as f64);
                    origin + place.add_scalar(0.5) * spacing
                };
                (0..nx).map(|x| test.contains(&centre(x))).collect()
            })
            .collect();
        let inside = Array3::from_shape_vec((nz, ny, nx), rows.concat()).map_err(|_| GrowError::EmptyMask)?;
        if !inside.iter().any(|&here| here) {
            return Err(GrowError::EmptyMask);
        }
        Ok(Self {
            inside,
            origin,
            spacing,
        })
    }

    /// Voxels along z, y and x of [`of_mesh`](Self::of_mesh), without finding out which are inside.
    ///
    /// # Errors
    ///
    /// [`GrowError::Resolution`]; [`GrowError::EmptyMask`] for a mesh without vertices.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most the resolution"
    )]
    pub fn size_of(mesh: &ClosedMesh, resolution: usize) -> Result<[usize; 3], GrowError> {
        if !(1..=2048).contains(&resolution) {
            return Err(GrowError::Resolution { resolution });
        }
        let (low, high) = mesh.as_triangle_mesh().bounding_box().ok_or(GrowError::EmptyMask)?;
        let (counts, _) = counts_along(&(high - low), resolution);
        Ok([counts.z, counts.y, counts.x].map(|count| count as usize))
    }

    /// The voxel (z, y, x) that contains a point, inside the mesh or not; `None` outside the box.
    #[must_use]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "checked against the box"
    )]
    pub fn voxel_at(&self, point: &Point3<f64>) -> Option<[usize; 3]> {
        let place = (point - self.origin) / self.spacing;
        let (nz, ny, nx) = self.inside.dim();
        let index = |place: f64, n: usize| (place >= 0.0 && place < n as f64).then_some(place as usize);
        Some([index(place.z, nz)?, index(place.y, ny)?, index(place.x, nx)?])
    }

    /// The voxel inside whose centre is nearest to a point, and that distance in voxels, among those within `reach`
    /// voxels; the first of equally near ones.
    #[must_use]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the box"
    )]
    pub fn nearest_inside(&self, point: &Point3<f64>, reach: f64) -> Option<([usize; 3], f64)> {
        let place = (point - self.origin) / self.spacing;
        let (nz, ny, nx) = self.inside.dim();
        let range = |at: f64, n: usize| {
            let from = (at - reach - 1.0).floor().clamp(0.0, n as f64) as usize;
            from..(at + reach + 2.0).floor().clamp(0.0, n as f64) as usize
        };
        let mut best: Option<([usize; 3], f64)> = None;
        for z in range(place.z, nz) {
            for y in range(place.y, ny) {
                for x in range(place.x, nx) {
                    let centre = Vector3::new(x as f64, y as f64, z as f64).add_scalar(0.5);
                    let distance = (centre - place).norm();
                    if self.inside[[z, y, x]] && distance <= reach && best.is_none_or(|(_, d)| distance < d) {
                        best = Some(([z, y, x], distance));
                    }
                }
            }
        }
        best
    }
}

/// Voxels along x, y and z, and their side.
fn counts_along(sides: &Vector3<f64>, resolution: usize) -> (Vector3<f64>, f64) {
    let spacing = sides.max() / resolution as f64;
    // Rounding must not add a voxel to a side that is a whole number of voxels.
    let counts = sides.map(|side| (side / spacing - 1e-9).ceil().clamp(1.0, resolution as f64));
    (counts, spacing)
}
