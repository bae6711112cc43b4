//! The images from which a solid is made.

use ndarray::{ArrayView2, ArrayView3};

use crate::error::SolidError;
use crate::numbers::MOST_SIDE;

/// An image of the material: grey levels, colours or phases, and optional further channels that only guide the
/// synthesis.
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
    /// Channels one after the other: colours (for phases one indicator each; two phases share one), then features.
    planes: Vec<f32>,
    /// Colour channels or indicators.
    colours: usize,
    phases: Option<Vec<u32>>,
}

impl Exemplar {
    /// A grey image (row, column). Any values are allowed; 0 to 1 suit the histograms best.
    ///
    /// # Errors
    ///
    /// [`SolidError::NotFinite`], [`SolidError::ConstantExemplar`], [`SolidError::ExemplarTooLarge`].
    pub fn grey(image: ArrayView2<'_, f32>) -> Result<Self, SolidError> {
        Self::colour(image.insert_axis(ndarray::Axis(2)))
    }

    /// An image (row, column, channel) of any number of colour channels.
    ///
    /// # Errors
    ///
    /// [`SolidError::NotFinite`], [`SolidError::ConstantExemplar`], [`SolidError::ExemplarTooLarge`].
    pub fn colour(image: ArrayView3<'_, f32>) -> Result<Self, SolidError> {
        let (height, width, colours) = image.dim();
        check_size(height, width)?;
        let planes = planes(image)?;
        #[allow(clippy::float_cmp, reason = "equality to the bit is meant")]
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

    /// A map of at most 16 phases or labels (row, column). The order of the numbers has no meaning. The solid gets
    /// exactly their fractions, to the voxel.
    ///
    /// # Errors
    ///
    /// [`SolidError::ConstantExemplar`] for a single phase, [`SolidError::Mismatch`] for more than 16,
    /// [`SolidError::ExemplarTooLarge`].
    pub fn phase_map(labels: ArrayView2<'_, u32>) -> Result<Self, SolidError> {
        check_size(labels.nrows(), labels.ncols())?;
        let mut phases: Vec<u32> = labels.iter().copied().collect();
        phases.sort_unstable();
        phases.dedup();
        if phases.len() > 16 {
            return Err(SolidError::Mismatch {
                what: format!("a phase map of {} phases: at most 16 are supported", phases.len()),
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

    /// With further channels (row, column, channel) that are compared with `weight` times the weight of colours but are
    /// not part of the result, such as the distance to edges, an orientation or the chemistry of a mineral.
    ///
    /// # Errors
    ///
    /// [`SolidError::Mismatch`] if their size differs from the image's, [`SolidError::NotFinite`].
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
                what: format!("the weight of features must not be negative, and not {weight}"),
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
    #[must_use]
    pub fn channels(&self) -> usize {
        self.planes.len() / (self.height * self.width)
    }

    /// The number of [`Exemplar::channels`] that are not features.
    pub(crate) fn inner_colours(&self) -> usize {
        self.colours
    }

    pub(crate) fn planes(&self) -> Vec<f32> {
        self.planes.clone()
    }
}

fn check_size(height: usize, width: usize) -> Result<(), SolidError> {
    if height.max(width) > MOST_SIDE {
        return Err(SolidError::ExemplarTooLarge { height, width });
    }
    Ok(())
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
