//! The pictures a solid is made from.

use ndarray::{ArrayView2, ArrayView3};

use crate::SolidError;

/// A picture of the material: grey, colours or phases, and perhaps further channels that only guide the synthesis.
///
/// # Examples
///
/// ```
/// use ndarray::Array2;
/// use stereology_exemplar::Exemplar;
///
/// let stripes = Array2::from_shape_fn((32, 32), |(z, _)| f32::from(u8::from(z % 8 < 3)));
/// let exemplar = Exemplar::grey(stripes.view())?;
/// assert_eq!((exemplar.shape(), exemplar.colours(), exemplar.phases()), ((32, 32), 1, None));
/// let labels = stripes.mapv(|v| v as u32);
/// assert_eq!(Exemplar::phase_map(labels.view())?.phases(), Some(&[0, 1][..]));
/// # Ok::<(), stereology_exemplar::SolidError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Exemplar {
    height: usize,
    width: usize,
    /// Channels one after the other: colours (phases: one an indicator; two phases share one), then features.
    planes: Vec<f32>,
    /// Channels of the result before phases are told apart.
    colours: usize,
    phases: Option<Vec<u32>>,
}

impl Exemplar {
    /// A grey picture (row, column); values of 0 to 1 suit the histograms best, any are allowed.
    ///
    /// # Errors
    ///
    /// [`SolidError::NotFinite`], [`SolidError::ConstantExemplar`].
    pub fn grey(image: ArrayView2<'_, f32>) -> Result<Self, SolidError> {
        Self::colour(image.insert_axis(ndarray::Axis(2)))
    }

    /// A picture (row, column, channel) of as many colour channels as it has.
    ///
    /// # Errors
    ///
    /// [`SolidError::NotFinite`], [`SolidError::ConstantExemplar`].
    pub fn colour(image: ArrayView3<'_, f32>) -> Result<Self, SolidError> {
        let (height, width, colours) = image.dim();
        let planes = planes(image)?;
        #[allow(clippy::float_cmp, reason = "the very same value everywhere is what is asked")]
        let constant = |plane: &[f32]| plane.iter().all(|v| *v == plane[0]);
        if planes.is_empty() || planes.chunks_exact(height * width).all(constant) {
            return Err(SolidError::ConstantExemplar);
        }
        Ok(Self {
            height,
            width,
            planes,
            colours,
            phases: None,
        })
    }

    /// A map of phases or labels (row, column), all of whose numbers stand for themselves: they are not ordered. The solid gets
    /// their fractions exactly (to the voxel). At most 16 phases.
    ///
    /// # Errors
    ///
    /// [`SolidError::ConstantExemplar`] for a single phase, [`SolidError::Mismatch`] for more than 16.
    pub fn phase_map(labels: ArrayView2<'_, u32>) -> Result<Self, SolidError> {
        let mut phases: Vec<u32> = labels.iter().copied().collect();
        phases.sort_unstable();
        phases.dedup();
        if phases.len() > 16 {
            return Err(SolidError::Mismatch {
                what: format!("a phase map of {} phases: at most 16 can be told apart", phases.len()),
            });
        }
        if phases.len() < 2 {
            return Err(SolidError::ConstantExemplar);
        }
        let indicator = |phase: u32| labels.iter().map(move |&label| f32::from(u8::from(label == phase)));
        let planes: Vec<f32> = match phases[..] {
            [_, second] => indicator(second).collect(),
            _ => phases.iter().flat_map(|&phase| indicator(phase)).collect(),
        };
        Ok(Self {
            height: labels.nrows(),
            width: labels.ncols(),
            colours: planes.len() / labels.len(),
            planes,
            phases: Some(phases),
        })
    }

    /// With further channels (row, column, channel) that count in the comparison of neighbourhoods, `weight` times as much as
    /// colours do, but are no part of the result: a distance from edges, an orientation, a mineral's chemistry.
    ///
    /// # Errors
    ///
    /// [`SolidError::Mismatch`] if they have another size than the picture, [`SolidError::NotFinite`].
    pub fn with_features(mut self, features: ArrayView3<'_, f32>, weight: f32) -> Result<Self, SolidError> {
        let (height, width, _) = features.dim();
        if (height, width) != self.shape() {
            return Err(SolidError::Mismatch {
                what: format!(
                    "features of {height} x {width} pixels for an exemplar of {} x {}",
                    self.height, self.width
                ),
            });
        }
        if !weight.is_finite() || weight < 0.0 {
            return Err(SolidError::Mismatch {
                what: format!("the weight of features must be positive, not {weight}"),
            });
        }
        let scale = weight.sqrt();
        self.planes.extend(planes(features)?.into_iter().map(|v| v * scale));
        Ok(self)
    }

    /// Rows and columns.
    #[must_use]
    pub fn shape(&self) -> (usize, usize) {
        (self.height, self.width)
    }

    /// Colour channels of the result; 1 for phases.
    #[must_use]
    pub fn colours(&self) -> usize {
        if self.phases.is_some() { 1 } else { self.colours }
    }

    /// The phases in ascending order, if this is a map of phases.
    #[must_use]
    pub fn phases(&self) -> Option<&[u32]> {
        self.phases.as_deref()
    }

    /// Channels that are compared: colours or indicators, and features.
    pub(crate) fn channels(&self) -> usize {
        self.planes.len() / (self.height * self.width)
    }

    /// The first of [`Exemplar::channels`] that are no features.
    pub(crate) fn inner_colours(&self) -> usize {
        self.colours
    }

    pub(crate) fn planes(&self) -> Vec<f32> {
        self.planes.clone()
    }
}

fn planes(image: ArrayView3<'_, f32>) -> Result<Vec<f32>, SolidError> {
    if let Some(((row, column, _), _)) = image.indexed_iter().find(|(_, v)| !v.is_finite()) {
        return Err(SolidError::NotFinite { row, column });
    }
    Ok(image
        .axis_iter(ndarray::Axis(2))
        .flat_map(|plane| plane.iter().copied().collect::<Vec<_>>())
        .collect())
}
