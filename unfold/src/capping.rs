//! Missing fines that are lost at the rim of particles: the capping angle of Keiding & Jensen (1972).
//!
//! A plane that cuts off no more than a small cap shows a profile too faint or too thin to be seen. With a capping
//! angle φ a particle of size D shows no profile below D sin φ, whatever D; a size threshold loses the same profiles of
//! all particles. The kernel is that of the law of relative sizes F, cut at sin φ:
//!
//! ```text
//! K_ij = H D [F(max(x_i, s)) − F(max(x_(i−1), s))],   x = d / D,  s = sin φ
//! ```

use crate::{Kernel, KernelError, SizeBins};
use nalgebra::DMatrix;

/// The kernel of a body from its law of relative profile sizes, seen under a capping angle (0: everything is seen).
///
/// `law` is F, the fraction of the profiles of a particle of size 1 that are no larger than x, rising from 0 to 1 on
/// [0, 1]; `caliper` the expected number of its profiles per unit area of plane when there is one particle per unit
/// volume: for a convex body its mean caliper diameter. `capping_angle` is in radians, from 0 to below π/2. Takes 24
/// evaluations of F an entry for sizes spread over their bins.
///
/// # Errors
///
/// [`KernelError::CappingAngle`] for an invalid angle, otherwise as [`Kernel::new`].
///
/// # References
///
/// Keiding & Jensen 1972, Biometrics 28, 813-829.
///
/// # Examples
///
/// ```
/// use stereology_unfold::{SizeBins, capped_kernel, equal_edges};
/// let edges = equal_edges(1.0, 4);
/// let law = |x: f64| 1.0 - (1.0 - x.min(1.0).powi(2)).sqrt();
/// let kernel = capped_kernel(&law, 1.0, 0.5, &edges, SizeBins::upper_edge(&edges)?, std::f64::consts::PI / 6.0)?;
/// // The fraction cos φ of a sphere's profiles is observed.
/// assert!((kernel.matrix().column(3).sum() - 0.5_f64.cos()).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn capped_kernel(
    law: &dyn Fn(f64) -> f64,
    caliper: f64,
    capping_angle: f64,
    profile_edges: &[f64],
    sizes: SizeBins,
    unit_volume: f64,
) -> Result<Kernel, KernelError> {
    if !(0.0..std::f64::consts::FRAC_PI_2).contains(&capping_angle) {
        return Err(KernelError::CappingAngle(capping_angle));
    }
    let seen = capping_angle.sin();
    let below = |d: f64, size: f64| size * law((d / size).clamp(seen, 1.0));
    let rows = profile_edges.len().saturating_sub(1);
    let mut matrix = DMatrix::zeros(rows, sizes.len());
    for (j, bin) in sizes.edges().windows(2).enumerate() {
        let steps = if sizes.is_spread() { STEPS } else { 1 };
        for step in 0..steps {
            let size = if sizes.is_spread() {
                bin[0] + (bin[1] - bin[0]) * (f64::from(step) + 0.5) / f64::from(STEPS)
            } else {
                bin[1]
            };
            for i in 0..rows {
                let share = below(profile_edges[i + 1], size) - below(profile_edges[i], size);
                matrix[(i, j)] += caliper * share.max(0.0) / f64::from(steps);
            }
        }
    }
    Kernel::new(matrix, sizes, unit_volume)
}

/// Sizes at which a bin is sampled.
const STEPS: u32 = 24;
