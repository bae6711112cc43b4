//! Laws of the measures, on materials whose statistics are known.
#![expect(clippy::unwrap_used, reason = "a failing test panics")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::float_cmp,
    reason = "what is drawn is small; what is copied is equal"
)]

mod synthesis;
