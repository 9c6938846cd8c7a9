//! Signals: weighting of residuals over frequency, the Fourier transform of periodic
//! records, small complex systems.

mod complex_batch;
mod complex_solve;
mod dft;
mod line_dft;
mod pseudo_inverse;
mod weighting;

pub use complex_batch::{BatchShapeError, invert_batch, right_divide_batch};
pub use complex_solve::SmallSolver;
pub use dft::{Dft, DftScratch};
pub use line_dft::{LineDft, LineDftScratch};
pub use pseudo_inverse::PseudoInverse;
pub use weighting::{Weighting, WeightingError};
