//! Laws of the measures, on materials whose statistics are known.
#![expect(clippy::unwrap_used, reason = "a failing test panics")]

mod boolean_models;
mod comparisons;
mod growth;
