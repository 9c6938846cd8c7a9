//! The entry into the core: own the inputs, release the GIL, catch panics, react to Ctrl-C.

use crate::own_pool::with_threads;
use pyo3::prelude::*;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::Duration;

pyo3::import_exception!(axisight.errors, AxisightError);
pyo3::import_exception!(axisight.errors, InputError);
pyo3::import_exception!(axisight.errors, RobotError);

/// Lets one thread stop the long calls of others.
#[pyclass(frozen, module = "axisight._core")]
#[derive(Default)]
pub struct CancelToken {
    flag: Arc<AtomicBool>,
}

#[pymethods]
impl CancelToken {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Ask every call that holds this token to stop.
    fn cancel(&self) {
        self.flag.store(true, Ordering::Relaxed);
    }
}

/// The flag of an optional token, or a new one.
pub fn flag(token: Option<&Bound<'_, CancelToken>>) -> Arc<AtomicBool> {
    token.map_or_else(Arc::default, |t| Arc::clone(&t.get().flag))
}

/// Interval at which a waiting call checks for Ctrl-C.
const POLL: Duration = Duration::from_millis(50);

/// Run `work` without the GIL. Ctrl-C sets `cancel`, and is raised once `work` has returned.
pub fn detached<T: Send>(
    py: Python<'_>,
    cancel: &AtomicBool,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    py.detach(|| {
        std::thread::scope(|scope| {
            let (done, finished) = mpsc::channel();
            let handle = scope.spawn(move || {
                let result = with_threads(work);
                // The receiver outlives the scope. A failed send only means that nobody waits.
                let _ = done.send(());
                result
            });
            let mut interrupt = None;
            while finished.recv_timeout(POLL) == Err(mpsc::RecvTimeoutError::Timeout) {
                // The method path is not general enough over the lifetime.
                #[allow(clippy::redundant_closure_for_method_calls)]
                let signals = Python::attach(|py| py.check_signals());
                if let Err(e) = signals {
                    cancel.store(true, Ordering::Relaxed);
                    interrupt.get_or_insert(e);
                }
            }
            let result = handle.join();
            if let Some(e) = interrupt {
                return Err(e);
            }
            result
                .map_err(|panic| panicked(panic.as_ref()))?
                .map_err(|e| AxisightError::new_err(format!("threads: {e}")))
        })
    })
}

/// Run `work` on `NumPy` memory in place, with the GIL. Afterwards Ctrl-C and other threads get a
/// turn. Use it for work of a few milliseconds.
pub fn in_place<T>(py: Python<'_>, work: impl FnOnce() -> T) -> PyResult<T> {
    let result = catch_unwind(AssertUnwindSafe(work));
    py.check_signals()?;
    py.detach(|| ());
    result.map_err(|panic| panicked(panic.as_ref()))
}

fn panicked(panic: &(dyn Any + Send)) -> PyErr {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    let message = text.unwrap_or("no message");
    AxisightError::new_err(format!("internal error, please report: {message}"))
}

/// An input error from any core error.
pub fn input_error(e: impl std::fmt::Display) -> PyErr {
    InputError::new_err(e.to_string())
}
