//! The slices of a volume on planes normal to its axes.

use ndarray::{ArrayView3, ArrayView4, Axis};
use std::fmt::{self, Display};
use std::str::FromStr;

/// Parallel planes through a volume, named by the axes that lie in them.
///
/// Rows of a slice run along z and columns along x or y, so that flat layers of the volume are horizontal in it; on
/// `Xy` rows run along y and columns along x.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Constant y: rows along z, columns along x.
    Xz,
    /// Constant x: rows along z, columns along y.
    Yz,
    /// Constant z: rows along y, columns along x.
    Xy,
}

impl Family {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Xz, Self::Yz, Self::Xy];

    /// The axis of a volume (z, y, x) that the planes are normal to.
    #[must_use]
    pub fn normal(self) -> Axis {
        match self {
            Self::Xz => Axis(1),
            Self::Yz => Axis(2),
            Self::Xy => Axis(0),
        }
    }
}

impl Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Xz => "xz",
            Self::Yz => "yz",
            Self::Xy => "xy",
        })
    }
}

/// A name that is not a family of planes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("slices are xz, yz or xy")]
pub struct FamilyError;

impl FromStr for Family {
    type Err = FamilyError;

    fn from_str(name: &str) -> Result<Self, FamilyError> {
        match name.trim() {
            "xz" => Ok(Self::Xz),
            "yz" => Ok(Self::Yz),
            "xy" => Ok(Self::Xy),
            _ => Err(FamilyError),
        }
    }
}

/// All slices (row, column, channel) of one family of a volume (z, y, x, channel), without copying.
///
/// # Examples
///
/// ```
/// use ndarray::Array4;
/// use stereology_metrics::{Family, sections};
///
/// let volume = Array4::<f32>::zeros((2, 3, 4, 1));
/// let slices = |family| { let all = sections(volume.view(), family); (all.len(), all[0].dim()) };
/// assert_eq!(slices(Family::Xz), (3, (2, 4, 1)));
/// assert_eq!(slices(Family::Yz), (4, (2, 3, 1)));
/// assert_eq!(slices(Family::Xy), (2, (3, 4, 1)));
/// ```
#[must_use]
pub fn sections(volume: ArrayView4<'_, f32>, family: Family) -> Vec<ArrayView3<'_, f32>> {
    let normal = family.normal();
    (0..volume.len_of(normal))
        .map(|at| volume.index_axis_move(normal, at))
        .collect()
}
