//! The size of a voxel, and its unit.

use crate::length_unit::LengthUnit;

/// Sides of a voxel along x, y, z, and the unit of length if there is one.
///
/// A function that takes it accepts three numbers too, which have no unit:
///
/// ```
/// use stereology_grid::VoxelSize;
///
/// assert_eq!(VoxelSize::from([0.5; 3]), VoxelSize { sides: [0.5; 3], unit: None });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelSize {
    /// Sides along x, y, z.
    pub sides: [f64; 3],
    /// Unit of the sides.
    pub unit: Option<LengthUnit>,
}

impl From<[f64; 3]> for VoxelSize {
    fn from(sides: [f64; 3]) -> Self {
        Self { sides, unit: None }
    }
}
