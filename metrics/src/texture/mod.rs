//! The texture of an image: grey levels, gradients, orientations, fringes, patches.

mod fringes;
mod gradient;
mod grey;
mod level_curves;
mod orientation;
mod patches;

pub use fringes::{Fringes, fringes};
pub use gradient::mean_gradient;
pub use grey::{Moments, grey, histogram, kl_divergence, moments};
pub use level_curves::{LevelCurve, level_curves};
pub use orientation::{OrientationField, orientation_field};
pub use patches::{Patches, sliced_wasserstein};
