//! Ensembles of simulated runs: random streams as functions of (seed, run), and streaming
//! accumulators that merge. Memory does not grow with the number of runs.

mod moments;
mod quantiles;
mod seeds;

pub use moments::{Moments, STATISTICS};
pub use quantiles::{QuantileSketch, SketchError};
pub use seeds::{Purpose, generator};

/// Error: two accumulators have different shapes and cannot be merged.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field}: expected {expected}, got {got}")]
pub struct MergeError {
    /// The property that differs.
    pub field: &'static str,
    /// Value of this accumulator.
    pub expected: String,
    /// Value of the other accumulator.
    pub got: String,
}
