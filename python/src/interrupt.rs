//! Long computations beside the interpreter: it stays free for other threads, and Ctrl+C ends them.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// How often the interpreter is asked whether it was interrupted.
const INTERVAL: Duration = Duration::from_millis(50);

/// Runs `compute` on a thread of its own. On an interruption it is told to stop, and its end is awaited. `report`
/// is called at intervals with the interpreter.
pub(crate) fn interruptible<R: Send>(
    py: Python<'_>,
    compute: impl FnOnce(&AtomicBool) -> R + Send,
    mut report: impl FnMut(Python<'_>) -> PyResult<()>,
) -> PyResult<R> {
    let stop = &AtomicBool::new(false);
    thread::scope(|scope| {
        let (sender, receiver) = channel();
        // only shared with closures that run in place
        let receiver = Mutex::new(receiver);
        scope.spawn(move || {
            // nobody waits for the result after an interruption
            let _ = sender.send(compute(stop));
        });
        loop {
            let received = py.detach(|| wait(&receiver));
            let asked = match received {
                Ok(result) => return report(py).map(|()| result),
                Err(RecvTimeoutError::Timeout) => py.check_signals().and_then(|()| report(py)),
                Err(RecvTimeoutError::Disconnected) => Err(PyRuntimeError::new_err(
                    "expected a result of the computation, found that it panicked",
                )),
            };
            if let Err(interruption) = asked {
                stop.store(true, Ordering::Relaxed);
                // until the computation has noticed
                let is_running = || matches!(wait(&receiver), Err(RecvTimeoutError::Timeout));
                py.detach(|| while is_running() {});
                return Err(interruption);
            }
        }
    })
}

/// Waits one interval for the result.
fn wait<R>(receiver: &Mutex<Receiver<R>>) -> Result<R, RecvTimeoutError> {
    // only one thread waits at a time: a poisoned lock means a panic, after which nothing comes
    let receiver = receiver
        .lock()
        .map_err(|_| RecvTimeoutError::Disconnected)?;
    receiver.recv_timeout(INTERVAL)
}
