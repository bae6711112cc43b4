//! The texture of an image: grey levels, gradients, orientations, fringes, patches.

mod cross_scale;
mod fringes;
mod gradient;
mod grey;
mod level_curves;
mod monogenic;
mod orientation;
mod patches;

pub(crate) use cross_scale::{CrossScale, LEAST_SIDE, PAIRS};
pub use fringes::{Fringes, fringes};
pub use gradient::mean_gradient;
pub use grey::{Moments, grey, histogram, kl_divergence, moments};
pub use level_curves::{LevelCurve, level_curves};
pub(crate) use monogenic::{MonogenicBand, monogenic_bands};
pub use orientation::{OrientationField, orientation_field};
pub use patches::{Patches, sliced_wasserstein};
