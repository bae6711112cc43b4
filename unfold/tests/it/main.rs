//! Unfolding against what is known of spheres, and against the paper's own experiment.
#![allow(
    clippy::unwrap_used,
    clippy::float_cmp,
    clippy::print_stdout,
    reason = "a test that cannot go on fails; some results are exact; tables are shown"
)]

mod bad_input;
mod clusters;
mod experiment;
mod figure_7;
mod incomplete;
mod intervals;
mod misfit;
mod round_trips;
mod size_laws;
mod spheres;
