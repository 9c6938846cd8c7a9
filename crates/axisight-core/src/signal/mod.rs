//! Signals: weighting of residuals over frequency, the Fourier transform of periodic
//! records, small complex systems.

mod complex_solve;
mod dft;
mod line_transform;
mod weighting;

pub use complex_solve::SmallSolver;
pub use dft::{Dft, DftScratch};
pub use line_transform::{LineGrid, LineTransform};
pub use weighting::{Weighting, WeightingError};
