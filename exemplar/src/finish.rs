//! Improvement of an existing solid.

use ndarray::ArrayView3;
use stereology_metrics::Progress;

use crate::domain::Domain;
use crate::error::SolidError;
use crate::exemplar::Exemplar;
use crate::options::{Method, SolidOptions};
use crate::synthesis::{Solid, synthesize};

/// Makes an existing solid more similar to its exemplars: runs [`Method::Best`] from the given `pixels` (z, y, x;
/// numbers as in [`Solid::sources`], any other number where there is none) instead of random ones. Structures coarser
/// than a neighbourhood of the coarsest level are kept.
///
/// Method and solver of `options` are ignored. Cost as for [`synthesize_solid`](crate::synthesize_solid).
///
/// # Errors
///
/// [`SolidError`]; [`SolidError::Mismatch`] if the sizes of `pixels` and domain differ.
///
/// # Examples
///
/// Two halves that do not match:
///
/// ```
/// use ndarray::{Array2, Array3};
/// use std::ops::ControlFlow;
/// use stereology_exemplar::{Domain, Exemplar, SolidOptions, finish_solid};
///
/// let layers = Array2::from_shape_fn((40, 40), |(z, x)| 0.5 + 0.4 * (0.9 * z as f32 + (0.2 * x as f32).sin()).sin());
/// let exemplar = [Exemplar::grey(layers.view())?];
/// let broken = Array3::from_shape_fn((20, 20, 20), |(z, _, x)| ((z + if x < 10 { 0 } else { 3 }) * 40 + x) as u32);
/// let seam = |v: &dyn Fn(usize, usize) -> f32| (0..20).map(|z| (v(z, 9) - v(z, 10)).abs()).sum::<f32>();
/// let before = seam(&|z, x| layers[[z + if x < 10 { 0 } else { 3 }, x]]);
/// let domain = Domain::new([20; 3])?.open();
/// let go = |_: f64| ControlFlow::Continue(());
/// let solid = finish_solid(&exemplar, &domain, broken.view(), &SolidOptions::default(), &go)?;
/// assert!(seam(&|z, x| solid.values[[z, 5, x, 0]]) < 0.5 * before);
/// # Ok::<(), stereology_exemplar::SolidError>(())
/// ```
pub fn finish_solid(
    exemplars: &[Exemplar],
    domain: &Domain,
    pixels: ArrayView3<'_, u32>,
    options: &SolidOptions,
    progress: Progress<'_>,
) -> Result<Solid, SolidError> {
    let (nz, ny, nx) = pixels.dim();
    if [nz, ny, nx] != domain.size() {
        return Err(SolidError::Mismatch {
            what: format!("pixels of {nz} x {ny} x {nx} voxels for a box of {:?}", domain.size()),
        });
    }
    let mut options = options.clone().with_method(Method::Best);
    options.solver = None;
    synthesize(exemplars, domain, &options, Some(pixels), progress, &mut |_| ())
}
