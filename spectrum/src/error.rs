//! What can be wrong with a field that is to be transformed.

/// A field cannot be transformed as asked.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SpectrumError {
    /// A field has no samples along one axis, or no axis at all, or more than three.
    #[error("a field of shape {shape:?} cannot be transformed: give one to three axes with at least one sample each")]
    Shape {
        /// The shape that was given.
        shape: Vec<usize>,
    },
    /// An array does not have the shape that this transform was made for.
    #[error("this transform was made for shape {expected:?}, but was given {found:?}")]
    Mismatch {
        /// Shape the transform was made for.
        expected: Vec<usize>,
        /// Shape of the array.
        found: Vec<usize>,
    },
    /// A spectrum needs at least one radial bin.
    #[error("a radial spectrum needs at least one bin")]
    NoBins,
    /// A field holds NaN or infinity.
    #[error("the field holds a value that is NaN or infinite: clean it before the transform")]
    NotFinite,
    /// The field is constant: its correlation is 0/0.
    #[error("the field is constant, so it has no correlation")]
    Constant,
    /// The mask selects no sample.
    #[error("the mask selects no sample")]
    EmptyMask,
}
