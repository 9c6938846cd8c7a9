//! Cache of FFT plans: making a plan takes as long as several transforms.
//!
//! The general planner of rustfft would add its scalar algorithms, two thirds of the compiled code.
//! The processors for which these crates are built never run them.

use rustfft::{Fft, FftDirection, FftNum};
use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

/// Number type, length, and whether the transform is forward.
type Key = (TypeId, usize, bool);
/// Each entry is an `Arc<dyn Fft<T>>`.
type Plans = HashMap<Key, Box<dyn Any + Send + Sync>>;

static PLANS: LazyLock<Mutex<Plans>> = LazyLock::new(Mutex::default);

/// Number of plans that the cache keeps. A job rarely needs more lengths, and a plan for a long
/// record takes megabytes.
const MOST_PLANS: usize = 32;

/// The transform of `n` complex numbers.
pub(crate) fn plan<T: FftNum>(n: usize, direction: FftDirection) -> Arc<dyn Fft<T>> {
    let key = (TypeId::of::<T>(), n, direction == FftDirection::Forward);
    // A thread that panicked cannot leave a partial plan behind.
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
        // Slow but correct on processors without the vector instructions of this build.
        Err(()) => Arc::new(rustfft::algorithm::Dft::new(n, direction)),
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn make<T: FftNum>(n: usize, direction: FftDirection) -> Arc<dyn Fft<T>> {
    rustfft::FftPlanner::new().plan_fft(n, direction)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustfft::num_complex::Complex;

    /// No other test of this crate uses these lengths.
    const LENGTHS: [usize; 3] = [691, 720, 1033];
    const DIRECTIONS: [FftDirection; 2] = [FftDirection::Forward, FftDirection::Inverse];

    fn transformed<T: FftNum>(plan: &dyn Fft<T>, scale: f64) -> Vec<Complex<T>> {
        let part = |x: f64| T::from_f64(scale * x.sin()).unwrap_or_else(T::zero);
        let number = |k: usize| Complex::new(part(k as f64), part(1.0 + 2.0 * k as f64));
        let mut series: Vec<Complex<T>> = (0..plan.len()).map(number).collect();
        plan.process(&mut series);
        series
    }

    /// The results are bit-identical, even if the cache holds plans of other directions, types and
    /// lengths.
    #[test]
    fn a_kept_plan_does_what_a_new_one_does() {
        for _ in 0..2 {
            for (n, direction) in LENGTHS.iter().flat_map(|n| DIRECTIONS.map(|d| (*n, d))) {
                let kept = plan::<f64>(n, direction);
                let new = make::<f64>(n, direction);
                assert_eq!((kept.len(), kept.fft_direction()), (n, direction));
                assert_eq!(transformed(&*kept, 1.0), transformed(&*new, 1.0));
                let kept = plan::<f32>(n, direction);
                let new = make::<f32>(n, direction);
                assert_eq!(transformed(&*kept, 1.0), transformed(&*new, 1.0));
            }
        }
    }

    /// Threads can use one plan at the same time, and none makes the plan again.
    #[test]
    fn threads_share_a_plan_and_few_are_kept() {
        let (n, direction) = (947, FftDirection::Forward);
        let first = plan::<f64>(n, direction);
        let work = |thread: usize| {
            let mine = plan::<f64>(n, direction);
            let scale = 1.0 + thread as f64;
            let want = transformed(&*make::<f64>(n, direction), scale);
            let right = (0..50).all(|_| transformed(&*mine, scale) == want);
            (right, Arc::ptr_eq(&mine, &first))
        };
        let work = &work;
        let done: Vec<(bool, bool)> = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..4).map(|t| scope.spawn(move || work(t))).collect();
            threads.into_iter().filter_map(|t| t.join().ok()).collect()
        });
        assert_eq!(done, [(true, true); 4]);
        // The cache does not keep all lengths of a job; here it drops `first`.
        for n in 2..2 * MOST_PLANS {
            plan::<f64>(n, direction);
            let kept = PLANS.lock().expect("no thread has panicked").len();
            assert!(kept <= MOST_PLANS, "{kept} plans");
        }
    }
}
