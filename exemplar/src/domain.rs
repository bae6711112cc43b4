//! The domain of a solid: its size, its mask and its fixed voxels.

use ndarray::{Array3, ArrayView3};

use crate::error::SolidError;

/// A fixed voxel: (z, y, x), and its value in every colour channel (for phases the number of the phase).
pub type FixedVoxel = ([usize; 3], Vec<f32>);

/// The box in which a solid is made.
///
/// # Examples
///
/// ```
/// use ndarray::Array3;
/// use stereology_exemplar::{Domain, SolidError};
///
/// let square = |i: usize| (i as f64 - 7.5).powi(2);
/// let ball = Array3::from_shape_fn((16, 16, 16), |(z, y, x)| square(z) + square(y) + square(x) < 49.0);
/// let domain = Domain::new([16; 3])?.with_mask(ball.view())?.with_fixed(vec![([8, 8, 8], vec![0.5])])?;
/// assert_eq!(domain.voxels(), 1_472);
/// assert!(matches!(domain.with_fixed(vec![([0, 0, 0], vec![0.5])]), Err(SolidError::FixedOutsideMask { .. })));
/// # Ok::<(), stereology_exemplar::SolidError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Domain {
    size: [usize; 3],
    periodic: bool,
    mask: Option<Array3<bool>>,
    fixed: Vec<FixedVoxel>,
}

impl Domain {
    /// A whole box of `size` (nz, ny, nx) that is periodic along each axis.
    ///
    /// # Errors
    ///
    /// [`SolidError::Size`].
    pub fn new(size: [usize; 3]) -> Result<Self, SolidError> {
        let voxels = size.iter().try_fold(1_usize, |all, &n| all.checked_mul(n));
        if size.iter().any(|n| !(2..=4096).contains(n)) || voxels.is_none_or(|n| n >= 1 << 31) {
            return Err(SolidError::Size { size });
        }
        Ok(Self {
            size,
            periodic: true,
            mask: None,
            fixed: Vec::new(),
        })
    }

    /// The box without periodicity: opposite faces are independent.
    #[must_use]
    pub fn open(mut self) -> Self {
        self.periodic = false;
        self
    }

    /// With a mask (z, y, x): voxels outside are neither written nor compared.
    ///
    /// # Errors
    ///
    /// [`SolidError::MaskShape`], [`SolidError::EmptyMask`], [`SolidError::FixedOutsideMask`].
    pub fn with_mask(mut self, mask: ArrayView3<'_, bool>) -> Result<Self, SolidError> {
        let (nz, ny, nx) = mask.dim();
        if [nz, ny, nx] != self.size {
            return Err(SolidError::MaskShape {
                found: [nz, ny, nx],
                size: self.size,
            });
        }
        if !mask.iter().any(|&inside| inside) {
            return Err(SolidError::EmptyMask);
        }
        if let Some(&(at, _)) = self.fixed.iter().find(|(at, _)| !mask[*at]) {
            return Err(SolidError::FixedOutsideMask { at });
        }
        self.mask = Some(mask.to_owned());
        Ok(self)
    }

    /// With voxels whose values are fixed exactly; the voxels around them are made to fit. The same voxel may be given
    /// twice if its values are equal.
    ///
    /// # Errors
    ///
    /// [`SolidError::FixedOutside`], [`SolidError::FixedOutsideMask`], [`SolidError::FixedTwice`],
    /// [`SolidError::FixedValue`] for a value that is not finite.
    pub fn with_fixed(mut self, mut fixed: Vec<FixedVoxel>) -> Result<Self, SolidError> {
        for (at, value) in &fixed {
            if at.iter().zip(&self.size).any(|(i, n)| i >= n) {
                return Err(SolidError::FixedOutside {
                    at: *at,
                    size: self.size,
                });
            }
            if self.mask.as_ref().is_some_and(|mask| !mask[*at]) {
                return Err(SolidError::FixedOutsideMask { at: *at });
            }
            if value.iter().any(|v| !v.is_finite()) {
                return Err(SolidError::FixedValue {
                    at: *at,
                    channels: value.len(),
                    found: value.clone(),
                });
            }
        }
        fixed.sort_by_key(|(at, _)| *at);
        if let Some(pair) = fixed
            .windows(2)
            .find(|pair| pair[0].0 == pair[1].0 && pair[0].1 != pair[1].1)
        {
            return Err(SolidError::FixedTwice {
                at: pair[0].0,
                first: pair[0].1.clone(),
                second: pair[1].1.clone(),
            });
        }
        fixed.dedup_by_key(|(at, _)| *at);
        self.fixed = fixed;
        Ok(self)
    }

    /// Voxels along z, y, x.
    #[must_use]
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Whether the solid is periodic.
    #[must_use]
    pub fn is_periodic(&self) -> bool {
        self.periodic
    }

    /// Voxels inside the mask.
    #[must_use]
    pub fn voxels(&self) -> usize {
        self.mask.as_ref().map_or(self.size.iter().product(), |mask| {
            mask.iter().filter(|inside| **inside).count()
        })
    }

    /// The mask, if only a part of the box is filled.
    #[must_use]
    pub fn mask(&self) -> Option<&Array3<bool>> {
        self.mask.as_ref()
    }

    /// The fixed voxels, sorted by position.
    #[must_use]
    pub fn fixed(&self) -> &[FixedVoxel] {
        &self.fixed
    }
}
