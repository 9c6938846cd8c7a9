//! Plans of Fourier transforms.
//!
//! The general planner of rustfft brings its scalar algorithms along, two thirds of what it
//! compiles to; crates here are built for processors that never run them.

use rustfft::{Fft, FftDirection, FftNum};
use std::sync::Arc;

/// The transform of `n` complex numbers.
#[cfg(target_arch = "x86_64")]
pub(crate) fn plan<T: FftNum>(n: usize, direction: FftDirection) -> Arc<dyn Fft<T>> {
    match rustfft::FftPlannerAvx::new() {
        Ok(mut planner) => planner.plan_fft(n, direction),
        // Slow and right, where the rest of this build would not run at all.
        Err(()) => Arc::new(rustfft::algorithm::Dft::new(n, direction)),
    }
}

/// The transform of `n` complex numbers.
#[cfg(not(target_arch = "x86_64"))]
pub(crate) fn plan<T: FftNum>(n: usize, direction: FftDirection) -> Arc<dyn Fft<T>> {
    rustfft::FftPlanner::new().plan_fft(n, direction)
}
