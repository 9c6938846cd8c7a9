//! Plans of Fourier transforms, kept: a plan takes as long as several transforms.
//!
//! The general planner of rustfft brings its scalar algorithms along, two thirds of what it
//! compiles to; crates here are built for processors that never run them.

use rustfft::{Fft, FftDirection, FftNum};
use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

/// Number type, length, and whether forward.
type Key = (TypeId, usize, bool);
/// An `Arc<dyn Fft<T>>` each.
type Plans = HashMap<Key, Box<dyn Any + Send + Sync>>;

static PLANS: LazyLock<Mutex<Plans>> = LazyLock::new(Mutex::default);

/// Plans kept; a job rarely has more lengths, and one of a long record takes megabytes.
const MOST_PLANS: usize = 32;

/// The transform of `n` complex numbers.
pub(crate) fn plan<T: FftNum>(n: usize, direction: FftDirection) -> Arc<dyn Fft<T>> {
    let key = (TypeId::of::<T>(), n, direction == FftDirection::Forward);
    // A thread that panicked has left whole plans behind.
    let known = |plans: &Plans| plans.get(&key)?.downcast_ref::<Arc<dyn Fft<T>>>().cloned();
    if let Some(found) = known(&PLANS.lock().unwrap_or_else(PoisonError::into_inner)) {
        return found;
    }
    let made = make(n, direction);
    let mut plans = PLANS.lock().unwrap_or_else(PoisonError::into_inner);
    if plans.len() >= MOST_PLANS {
        plans.clear();
    }
    plans.insert(key, Box::new(Arc::clone(&made)));
    made
}

#[cfg(target_arch = "x86_64")]
fn make<T: FftNum>(n: usize, direction: FftDirection) -> Arc<dyn Fft<T>> {
    match rustfft::FftPlannerAvx::new() {
        Ok(mut planner) => planner.plan_fft(n, direction),
        // Slow and right, where the rest of this build would not run at all.
        Err(()) => Arc::new(rustfft::algorithm::Dft::new(n, direction)),
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn make<T: FftNum>(n: usize, direction: FftDirection) -> Arc<dyn Fft<T>> {
    rustfft::FftPlanner::new().plan_fft(n, direction)
}
