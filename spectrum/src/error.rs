//! Errors of the transforms.

/// Why a field cannot be transformed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SpectrumError {
    /// A field has an axis without samples, no axis, or more than three axes.
    #[error("a field of shape {shape:?} cannot be transformed: give one to three axes with at least one sample each")]
    Shape {
        /// The shape that was given.
        shape: Vec<usize>,
    },
    /// An array does not have the shape of this transform.
    #[error("this transform is for shape {expected:?}, but the array has shape {found:?}")]
    Mismatch {
        /// Shape of the transform.
        expected: Vec<usize>,
        /// Shape of the array.
        found: Vec<usize>,
    },
    /// A spectrum needs at least one radial bin.
    #[error("a radial spectrum needs at least one bin")]
    NoBins,
    /// A field contains NaN or infinity.
    #[error("the field contains a NaN or infinite value: replace it before the transform")]
    NotFinite,
    /// The field is constant, so its correlation is 0/0.
    #[error("the field is constant, so it has no correlation")]
    Constant,
    /// The mask selects no sample.
    #[error("the mask selects no sample")]
    EmptyMask,
}
