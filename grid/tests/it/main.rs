//! Files written by the crate, read back by readers that are not ours.
#![expect(clippy::unwrap_used, reason = "a failing test panics")]

mod damaged;
mod formats;
mod hdf5;
#[cfg(feature = "read")]
mod other_programs;
mod resume;
mod units;
mod whole_or_nothing;
