//! Ensembles: random streams as functions of (seed, run) and streaming accumulators that
//! merge, so that memory does not grow with the number of runs.

mod moments;
mod quantiles;
mod seeds;

pub use moments::{Moments, STATISTICS};
pub use quantiles::{QuantileSketch, SketchError};
pub use seeds::{Purpose, generator};

/// Accumulators of different shape cannot be merged.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field}: expected {expected}, got {got}")]
pub struct MergeError {
    /// What differs.
    pub field: &'static str,
    /// What this accumulator holds.
    pub expected: String,
    /// What came.
    pub got: String,
}
