//! Numerics with concrete types: Fourier transforms, eigenvalues, batches of small complex systems,
//! weighting of residuals over frequency, recursive filters, and least squares.
//!
//! Generic libraries are compiled where they are used with a concrete type. Only this crate uses
//! rustfft and faer, so a change in another crate does not build them again.

// Kernels are generic over the scalar and become vector code only if they are inlined.
#![allow(clippy::inline_always)]

mod adjugate;
mod ahead;
mod complex_batch;
mod complex_solve;
mod dense;
pub mod descent;
mod dft;
mod lane_fft;
mod line_dft;
mod line_plans;
mod line_transform;
mod lockstep_lu;
mod pair;
mod plan;
mod pseudo_inverse;
pub mod recursion;
mod weighting;

pub use complex_batch::{BatchShapeError, Threads, invert_batch, right_divide_batch};
pub use complex_solve::SmallSolver;
pub use dense::{eigen, solve_positive};
pub use dft::{Dft, DftScratch};
pub use line_dft::{LineDft, LineDftScratch};
pub use line_plans::line_plan;
pub use line_transform::{GridNumber, LineGrid, LineTransform};
pub use pseudo_inverse::PseudoInverse;
pub use weighting::{Weighter, Weighting, WeightingError};
