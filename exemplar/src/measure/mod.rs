//! Measures that judge any solid against the picture it was made from. They know nothing of how a solid was made.

mod band_pass;
mod comparison;
mod copying;
mod figures;
mod fringes;
mod gradient;
mod grey;
mod inside;
mod level_curves;
mod local_porosity;
mod orientation;
mod paths;
mod portrait;
mod seams;
mod sections;
mod sliced_wasserstein;
mod two_point;

pub use band_pass::BandPass;
pub use comparison::{MeasureError, MeasureOptions, compare};
pub use copying::{Copying, copying};
pub use figures::{Comparison, Curves, Figure};
pub use fringes::{Fringes, fringes};
pub use gradient::mean_gradient;
pub use grey::{Moments, grey, histogram, kl_divergence, moments, otsu_threshold};
pub use inside::{largest_rectangle, sections_inside};
pub use level_curves::{LevelCurve, level_curves};
pub use local_porosity::local_porosity;
pub use orientation::{OrientationField, orientation_field};
pub use paths::{chord_lengths, lineal_path};
pub use seams::{Seams, seams};
pub use sections::{Family, FamilyError, sections};
pub use sliced_wasserstein::{Patches, sliced_wasserstein, wasserstein};
pub use two_point::{radial_mean, two_point};
