//! Laws of packings, judged by closed forms and brute force.

#![expect(clippy::unwrap_used, reason = "a test that fails says where")]

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
