//! The composed chain, against the sample whose solid is known and against analytic spheres.

mod files;
mod sample;
mod spheres;
