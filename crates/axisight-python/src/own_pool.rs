//! Threads for a process that was forked after the core had started threads.
//!
//! The parent's threads do not exist in the child, so waiting for them would never end.

use rayon::ThreadPool;
use std::process;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Process in which the core was first used and rayon started its threads.
static FIRST: OnceLock<u32> = OnceLock::new();

/// Threads of a forked process, with its process id. A process forked from that one needs its own.
static FORKED: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Run `work` with threads for its parallel parts; an error if a forked process cannot start
/// threads.
pub fn with_threads<T: Send>(
    work: impl FnOnce() -> T + Send,
) -> Result<T, rayon::ThreadPoolBuildError> {
    let here = process::id();
    if *FIRST.get_or_init(|| here) == here {
        return Ok(work());
    }
    Ok(forked(here)?.install(work))
}

fn forked(here: u32) -> Result<Arc<ThreadPool>, rayon::ThreadPoolBuildError> {
    let mut held = FORKED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((process, pool)) = &*held
        && *process == here
    {
        return Ok(Arc::clone(pool));
    }
    let pool = Arc::new(rayon::ThreadPoolBuilder::new().build()?);
    // Dropping the parent's pool would wait for threads that do not exist.
    if let Some((_, parents)) = held.replace((here, Arc::clone(&pool))) {
        std::mem::forget(parents);
    }
    Ok(pool)
}
