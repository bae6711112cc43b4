//! What the particles differ from: the binder's colour, light and scatter, and the distance of every pixel to it.

pub(crate) mod binder;
pub(crate) mod enlarged;
pub(crate) mod faint;
pub(crate) mod kmeans;
pub(crate) mod light;
pub(crate) mod rims;
pub(crate) mod seen;
pub(crate) mod tones;
