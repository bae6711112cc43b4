//! Properties of rendered images.
#![expect(clippy::unwrap_used, reason = "a failing test panics")]

mod bad_input;
mod images;
