//! Long computations beside the interpreter: it stays free for other threads, and Ctrl+C ends them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Time between two checks whether the interpreter was interrupted.
const INTERVAL: Duration = Duration::from_millis(50);

/// Time that an interrupted computation which may be left gets to end by itself.
const GRACE: Duration = Duration::from_millis(500);

/// Flag of an interrupted computation: nobody waits for its result, and it must write nothing more.
#[derive(Debug, Clone, Default)]
pub(crate) struct Stop(Arc<AtomicBool>);

impl Stop {
    pub(crate) fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// The flag itself, for computations that know nothing of Python.
    pub(crate) fn flag(&self) -> &AtomicBool {
        &self.0
    }
}

/// Runs `compute` on a thread of its own. On an interruption it is told to stop, and its end is awaited: for
/// computations that notice soon, or that must not be left halfway. `report` is called at intervals with the
/// interpreter. An end that takes longer is announced on standard error.
pub(crate) fn interruptible<R: Send>(
    py: Python<'_>,
    compute: impl FnOnce(&Stop) -> R + Send,
    report: impl FnMut(Python<'_>) -> PyResult<()>,
) -> PyResult<R> {
    let stop = &Stop::default();
    thread::scope(|scope| {
        let (sender, receiver) = channel();
        scope.spawn(move || {
            // nobody waits for the result after an interruption
            let _ = sender.send(compute(stop));
        });
        attend(py, receiver, stop, report, None)
    })
}

/// Runs `compute` as [`interruptible`] does, for a computation that owns everything it uses: after an interruption the
/// computation is left behind if it does not end soon.
pub(crate) fn leavable<R: Send + 'static>(
    py: Python<'_>,
    compute: impl FnOnce(&Stop) -> R + Send + 'static,
    report: impl FnMut(Python<'_>) -> PyResult<()>,
) -> PyResult<R> {
    let stop = Stop::default();
    let (sender, receiver) = channel();
    let told = stop.clone();
    thread::spawn(move || {
        // nobody waits for the result after an interruption
        let _ = sender.send(compute(&told));
    });
    attend(py, receiver, &stop, report, Some(GRACE))
}

/// Waits for the result; after an interruption at most `grace` for the end.
fn attend<R: Send>(
    py: Python<'_>,
    receiver: Receiver<R>,
    stop: &Stop,
    mut report: impl FnMut(Python<'_>) -> PyResult<()>,
    grace: Option<Duration>,
) -> PyResult<R> {
    // only shared with closures that run in place
    let receiver = Mutex::new(receiver);
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
            stop.0.store(true, Ordering::Relaxed);
            let asked_at = Instant::now();
            let may_wait = || grace.is_none_or(|grace| asked_at.elapsed() < grace);
            let is_running = || matches!(wait(&receiver), Err(RecvTimeoutError::Timeout));
            let is_late = || asked_at.elapsed() >= GRACE;
            py.detach(|| while is_running() && may_wait() && !is_late() {});
            if grace.is_none() && is_late() {
                say(
                    py,
                    "tipwatch: interrupted; what is in work is finished first\n",
                );
                py.detach(|| while is_running() {});
            }
            return Err(interruption);
        }
    }
}

/// Writes to standard error; without one, nothing is written.
fn say(py: Python<'_>, text: &str) {
    let stderr = py.import("sys").and_then(|sys| sys.getattr("stderr"));
    let _ = stderr.and_then(|stderr| stderr.call_method1("write", (text,)));
}

/// Waits one interval for the result.
fn wait<R>(receiver: &Mutex<Receiver<R>>) -> Result<R, RecvTimeoutError> {
    // only one thread waits at a time: a poisoned lock means a panic, after which nothing comes
    let receiver = receiver
        .lock()
        .map_err(|_| RecvTimeoutError::Disconnected)?;
    receiver.recv_timeout(INTERVAL)
}
