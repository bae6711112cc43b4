//! Laws of pictures.
#![expect(clippy::unwrap_used, reason = "a failing test panics")]

mod bad_input;
mod pictures;
