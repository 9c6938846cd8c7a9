//! Threads for a process that was forked after the core had threads: those of the parent are gone in
//! the child, and whoever waits for them waits for ever.

use rayon::ThreadPool;
use std::process;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// The process in which the core first had work, and the threads of rayon began.
static FIRST: OnceLock<u32> = OnceLock::new();

/// The threads of a forked process, with its number: a process forked from that one needs others.
static FORKED: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Run `work` where its parallel parts find threads; an error where a forked process can have none.
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
    // To drop the pool of the parent would wait for threads that are not there.
    if let Some((_, parents)) = held.replace((here, Arc::clone(&pool))) {
        std::mem::forget(parents);
    }
    Ok(pool)
}
