//! Laws of packings, tested against closed forms and brute force.

#![expect(clippy::unwrap_used, reason = "a failing test reports where")]

mod all_images;
mod brute_force;
mod hollow;
mod modes;
mod overlaps;
mod packings;
mod populations;
mod quality;
mod refusals;
mod sections;
