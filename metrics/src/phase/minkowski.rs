//! Minkowski functionals of a phase on a grid: fraction, boundary, curvature and Euler number per unit of area or
//! volume.

use ndarray::{ArrayView2, ArrayView3, Axis};
use std::f64::consts::{PI, SQRT_2};

/// Minkowski functionals of a phase of an image, per pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlanarFunctionals {
    /// Fraction of the area.
    pub fraction: f64,
    /// Length of the boundary per unit of area, 1 / pixel.
    pub boundary_length: f64,
    /// Components minus holes per unit of area, 1 / pixel²; pixels of the phase that share a corner are connected.
    pub euler_8: f64,
    /// The same; only pixels that share a side are connected.
    pub euler_4: f64,
}

/// Minkowski functionals of a phase of a volume, per voxel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpatialFunctionals {
    /// Fraction of the volume.
    pub fraction: f64,
    /// Area of the surface per unit of volume, 1 / voxel.
    pub specific_surface: f64,
    /// Integral of the mean curvature over the surface per unit of volume, 1 / voxel²: 4π R for a ball of radius R.
    pub mean_curvature: f64,
    /// Components minus tunnels plus cavities per unit of volume, 1 / voxel³; voxels of the phase that share a corner
    /// are connected.
    pub euler_26: f64,
    /// The same; only voxels that share a face are connected.
    pub euler_6: f64,
}

impl PlanarFunctionals {
    /// Surface per unit of volume of an isotropic material with this boundary length on its sections: 4/π L_A, 1 /
    /// pixel.
    #[must_use]
    pub fn specific_surface(&self) -> f64 {
        4.0 / PI * self.boundary_length
    }

    /// Mean length of the chords of random lines through the phase, pixels: π A_A / L_A; infinite without boundary.
    #[must_use]
    pub fn mean_intercept(&self) -> f64 {
        PI * self.fraction / self.boundary_length
    }
}

impl SpatialFunctionals {
    /// Mean length of the chords of random lines through the phase, voxels: 4 V_V / S_V; infinite without surface.
    #[must_use]
    pub fn mean_intercept(&self) -> f64 {
        4.0 * self.fraction / self.specific_surface
    }
}

/// Minkowski functionals of a phase of an image. What lies outside the image is unknown, so the estimates use the
/// squares of 2 × 2 pixels inside it: they are unbiased for sections of a homogeneous material. Sums over an image
/// whose border does not belong to the phase are those of its figures. Zero for images less than two pixels high or
/// wide.
///
/// The boundary length has an error of 1 to 2 % for outlines of many directions, is 5 % low for straight outlines along
/// rows or columns, and misses parts finer than two pixels. Cost: linear.
///
/// # Formula
///
/// ```text
/// L_A = π/2 · mean over rows, columns and both diagonals of P_L      P_L: changes of phase per length (Crofton)
/// χ_8 = Σ over corners: V − E/2 + F/4      V, E, F: is any pixel at the corner, at each of its 4 sides, pixels
/// χ_4 = Σ over corners: F/4 − E/2 + V      the same with all pixels for any
/// ```
///
/// # References
///
/// Ohser & Mücklich 2000, chapter 4.
///
/// # Examples
///
/// ```
/// use ndarray::Array2;
/// use stereology_metrics::planar_functionals;
///
/// let ring = Array2::from_shape_fn((100, 100), |(y, x)| {
///     let r = (y as f64 - 49.5).hypot(x as f64 - 49.5);
///     r < 40.0 && r > 20.0
/// });
/// let found = planar_functionals(ring.view());
/// let corners = 99.0 * 99.0;
/// assert!((found.boundary_length * corners / (std::f64::consts::TAU * 60.0) - 1.0).abs() < 0.01);
/// assert_eq!((found.euler_8 * corners).round(), 0.0); // one component, one hole
/// ```
#[must_use]
pub fn planar_functionals(phase: ArrayView2<'_, bool>) -> PlanarFunctionals {
    let (height, width) = phase.dim();
    if height < 2 || width < 2 {
        return PlanarFunctionals::default();
    }
    let counts = squares(phase);
    let corners = ((height - 1) * (width - 1)) as f64;
    PlanarFunctionals {
        fraction: phase.iter().filter(|inside| **inside).count() as f64 / phase.len() as f64,
        boundary_length: PI / 2.0 * planar_crossings(&counts) / corners,
        euler_8: weighted(&counts, euler_of_square) / corners,
        // Of the complement by its corners, with the sign of the plane's Euler number.
        euler_4: weighted(&counts, |square| -euler_of_square(!square & 0b1111)) / corners,
    }
}

/// Minkowski functionals of a phase of a volume, from the cubes of 2 × 2 × 2 voxels inside it, as in
/// [`planar_functionals`]. Zero for volumes less than two voxels along an axis.
///
/// The specific surface has an error of about 1 % for surfaces of many directions, and is 7 % low for planes normal to
/// an axis. The mean curvature averages planes normal to the axes only, so it is exact only for materials whose mean
/// over the axes is that over all directions. Cost: linear.
///
/// # Formula
///
/// ```text
/// S_V = 2 Σ w_i P_L,i                 P_L: changes of phase per length along 13 directions of the grid (Crofton)
///                                     w: the part of the sphere that is nearest to a direction
/// M_V = 2π · mean of χ over planes    χ: mean of χ_8 and χ_4 per area of planes normal to the axes
/// χ_26 = Σ over corners: V − E/2 + F/4 − C/8     V, E, F, C: is any voxel at the corner, its 6 edges, 12 faces, voxels
/// χ_6 = Σ over corners: C/8 − F/4 + E/2 − V      the same with all voxels for any
/// ```
///
/// # References
///
/// Ohser & Mücklich 2000, chapter 5; Lang, Ohser & Hilfer 2001.
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use stereology_metrics::spatial_functionals;
///
/// let at = |v: usize| v as f64 - 23.5;
/// let ball = Array3::from_shape_fn((48, 48, 48), |(z, y, x)| at(z).powi(2) + at(y).powi(2) + at(x).powi(2) < 400.0);
/// let found = spatial_functionals(ball.view());
/// let corners = 47.0_f64.powi(3);
/// assert!((found.specific_surface * corners / (4.0 * std::f64::consts::PI * 400.0) - 1.0).abs() < 0.01);
/// assert_eq!((found.euler_26 * corners).round(), 1.0);
/// ```
#[must_use]
pub fn spatial_functionals(phase: ArrayView3<'_, bool>) -> SpatialFunctionals {
    let (nz, ny, nx) = phase.dim();
    if nz < 2 || ny < 2 || nx < 2 {
        return SpatialFunctionals::default();
    }
    let counts = cubes(phase);
    let corners = ((nz - 1) * (ny - 1) * (nx - 1)) as f64;
    let planes: f64 = [Axis(0), Axis(1), Axis(2)]
        .into_iter()
        .map(|axis| {
            let of = |plane| {
                let found = planar_functionals(plane);
                (found.euler_8 + found.euler_4) / 2.0
            };
            phase.axis_iter(axis).map(of).sum::<f64>() / phase.len_of(axis) as f64
        })
        .sum();
    SpatialFunctionals {
        fraction: phase.iter().filter(|inside| **inside).count() as f64 / phase.len() as f64,
        specific_surface: 2.0 * weighted(&counts, spatial_crossings) / corners,
        mean_curvature: 2.0 * PI * planes / 3.0,
        euler_26: weighted(&counts, euler_of_cube) / corners,
        // The boundary has two sides: χ(boundary) = 2 χ(phase) = 2 χ(complement), without a border.
        euler_6: weighted(&counts, |cube| euler_of_cube(!cube & 0xff)) / corners,
    }
}

/// Sum of a function of configurations over all of them.
fn weighted(counts: &[u64], of: impl Fn(usize) -> f64) -> f64 {
    counts
        .iter()
        .enumerate()
        .filter(|(_, count)| **count > 0)
        .map(|(configuration, &count)| count as f64 * of(configuration))
        .sum()
}

/// Numbers of the 16 configurations of 2 × 2 pixels; bit 2y + x is the pixel (y, x) of the square.
fn squares(phase: ArrayView2<'_, bool>) -> [u64; 16] {
    let mut counts = [0; 16];
    for window in phase.windows((2, 2)) {
        let bits = window
            .iter()
            .enumerate()
            .map(|(bit, &inside)| usize::from(inside) << bit);
        counts[bits.sum::<usize>()] += 1;
    }
    counts
}

/// Numbers of the 256 configurations of 2 × 2 × 2 voxels; bit 4z + 2y + x is the voxel (z, y, x) of the cube.
fn cubes(phase: ArrayView3<'_, bool>) -> [u64; 256] {
    let mut counts = [0; 256];
    let (nz, ny, nx) = phase.dim();
    for z in 0..nz - 1 {
        let planes = [z, z + 1].map(|z| phase.index_axis_move(Axis(0), z));
        for y in 0..ny - 1 {
            let rows = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(dz, dy)| planes[dz].row(y + dy));
            // Bits of the column x: those of its four voxels at the places 0, 2, 4, 6.
            let column = |x: usize| (0..4).map(|row| usize::from(rows[row][x]) << (2 * row)).sum::<usize>();
            let mut left = column(0);
            for x in 1..nx {
                let right = column(x);
                counts[left | right << 1] += 1;
                left = right;
            }
        }
    }
    counts
}

/// Mean over the four directions of the changes of phase per length, times the number of squares.
fn planar_crossings(counts: &[u64; 16]) -> f64 {
    let differ = |square: usize, a: usize, b: usize| f64::from(u8::from((square >> a & 1) != (square >> b & 1)));
    weighted(counts, |square| {
        let pairs = |a, b, c, d| (differ(square, a, b) + differ(square, c, d)) / 2.0;
        (pairs(0, 1, 2, 3) + pairs(0, 2, 1, 3) + (differ(square, 0, 3) + differ(square, 1, 2)) / SQRT_2) / 4.0
    })
}

/// Parts of the sphere that are nearest to one of the 26 directions of a cubic grid, times two since opposite
/// directions count once: axes, face diagonals, space diagonals.
const PARTS: [f64; 3] = [0.091_555_782, 0.073_961_256, 0.070_391_280];

/// Sum over the directions of the changes of phase per length in a cube, weighted by their parts of the sphere.
fn spatial_crossings(cube: usize) -> f64 {
    let mut sum = 0.0;
    for a in 0..8_usize {
        for b in a + 1..8 {
            if (cube >> a & 1) == (cube >> b & 1) {
                continue;
            }
            // Of one direction a cube has 4 edges, 2 face diagonals or 1 space diagonal.
            let steps = (a ^ b).count_ones() as usize;
            let pairs = [4.0, 2.0, 1.0][steps - 1];
            sum += PARTS[steps - 1] / pairs / (steps as f64).sqrt();
        }
    }
    sum
}

/// Contribution of the corner inside a square of pixels to the Euler number of their union.
fn euler_of_square(square: usize) -> f64 {
    let any = |pixels: usize| f64::from(u8::from(square & pixels != 0));
    let sides: f64 = [0b0011, 0b1100, 0b0101, 0b1010].map(any).iter().sum();
    any(0b1111) - sides / 2.0 + f64::from(square.count_ones()) / 4.0
}

/// Contribution of the corner inside a cube of voxels to the Euler number of their union.
fn euler_of_cube(cube: usize) -> f64 {
    let any = |voxels: usize| f64::from(u8::from(cube & voxels != 0));
    // Four voxels share an edge at the corner; two of them that differ in one coordinate share a face.
    let edges: f64 = [0x0f, 0xf0, 0x33, 0xcc, 0x55, 0xaa].map(any).iter().sum();
    let mut faces = 0.0;
    for a in 0..8_usize {
        for step in [1, 2, 4] {
            if a & step == 0 {
                faces += any(1 << a | 1 << (a | step));
            }
        }
    }
    any(0xff) - edges / 2.0 + faces / 4.0 - f64::from(cube.count_ones()) / 8.0
}
