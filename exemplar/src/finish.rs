//! A solid that is there already, made more like its exemplars.

use std::ops::ControlFlow;

use ndarray::ArrayView3;

use crate::synthesis::synthesize;
use crate::{Domain, Exemplar, Method, Solid, SolidError, SolidOptions};

/// Makes a solid that was made in another way more like its exemplars: [`Method::Best`] from voxels that show `pixels`
/// (z, y, x; numbers as [`Solid::sources`], others where nothing is shown) instead of random ones. What is coarser than a neighbourhood of the coarsest level stays as it is.
///
/// Method and solver of `options` do not count. Cost as [`synthesize_solid`](crate::synthesize_solid).
///
/// # Errors
///
/// [`SolidError`]; [`SolidError::Mismatch`] if `pixels` has another size than the domain.
///
/// # Examples
///
/// Two halves that do not fit together:
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
/// let solid = finish_solid(&exemplar, &domain, broken.view(), &SolidOptions::default(), &|_| ControlFlow::Continue(()))?;
/// assert!(seam(&|z, x| solid.values[[z, 5, x, 0]]) < 0.5 * before);
/// # Ok::<(), stereology_exemplar::SolidError>(())
/// ```
pub fn finish_solid(
    exemplars: &[Exemplar],
    domain: &Domain,
    pixels: ArrayView3<'_, u32>,
    options: &SolidOptions,
    progress: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
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
