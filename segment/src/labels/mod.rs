//! From a mask to labels, and from labels to profiles: touching particles split, profiles measured, counted and grouped
//! by colour.

pub(crate) mod category;
pub(crate) mod flecks;
pub(crate) mod halo;
pub(crate) mod import;
pub(crate) mod nearest;
pub(crate) mod outline;
pub(crate) mod profile;
pub(crate) mod profile_shape;
pub(crate) mod separated;
pub(crate) mod split;
pub(crate) mod watershed;
