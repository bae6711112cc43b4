//! The slices of a volume on planes normal to its axes, whole or inside a mask.

mod family;
mod inside;

pub use family::{Family, FamilyError, sections};
pub use inside::{largest_rectangle, sections_inside};
