//! What a computation reports about itself and about its result.
//!
//! Every crate of the project describes remarks on its result as [`Finding`]s, accepts a [`Progress`] callback for long work, and checks the edges of size bins with
//! [`check_edges`], so that a program that combines several crates handles one type of each.
//!
//! # Examples
//!
//! ```
//! use stereology_metrics::{EdgesError, check_edges};
//!
//! assert_eq!(check_edges(&[0.0, 1.0, 2.0]), Ok(()));
//! assert_eq!(check_edges(&[0.0, 2.0, 2.0]), Err(EdgesError::NotIncreasing { index: 2 }));
//! ```

mod edge_rule;
mod edges;
mod finding;
mod progress;

pub use edge_rule::{BoundingBox, EdgeRule, EdgeWeights, SamplingWindow};
pub use edges::{EdgesError, check_edges};
pub use finding::Finding;
pub use progress::Progress;
