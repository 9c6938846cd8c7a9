//! Signals: weighting of residuals over frequency.

mod weighting;

pub use weighting::{Weighting, WeightingError};
