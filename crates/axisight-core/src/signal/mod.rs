//! Signals: weighting of residuals over frequency, the Fourier transform of periodic
//! records, small complex systems.

mod adjugate;
mod ahead;
mod complex_batch;
mod complex_solve;
mod dft;
mod lane_fft;
mod line_dft;
mod line_plans;
mod line_transform;
mod lockstep_lu;
mod pair;
mod pseudo_inverse;
mod weighting;

pub use complex_batch::{BatchShapeError, Threads, invert_batch, right_divide_batch};
pub use complex_solve::SmallSolver;
pub use dft::{Dft, DftScratch};
pub use line_dft::{LineDft, LineDftScratch};
pub use line_plans::line_plan;
pub use line_transform::{LineGrid, LineTransform};
pub use pseudo_inverse::PseudoInverse;
pub use weighting::{Weighting, WeightingError};
