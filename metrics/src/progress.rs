//! Progress of long work, and its cancellation.

use std::ops::ControlFlow;

/// Callback of long work: receives the completed fraction, from 0 to 1, and returns `Break` to cancel.
///
/// It may be called from several threads, and the fraction may arrive out of order.
pub type Progress<'a> = &'a (dyn Fn(f64) -> ControlFlow<()> + Sync);
