//! Are blocks of a solid's slices distinguishable from blocks of the exemplar? A two-sample test by a classifier.

mod classifier;
mod features;
mod source;
mod test;

pub use classifier::{ClassifierTest, classifier_test};
pub use source::BlockSource;
pub use test::{BlockTest, FeatureMeans, block_test};
