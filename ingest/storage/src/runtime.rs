//! The threads on which requests run. The rest of the program waits for them.

use std::future::Future;
use std::sync::{OnceLock, mpsc};

use tokio::runtime::{Builder, Runtime};

use crate::error::{Error, ErrorKind};

const THREADS: usize = 2;

fn runtime() -> Result<&'static Runtime, Error> {
    static RUNTIME: OnceLock<Result<Runtime, String>> = OnceLock::new();
    let made = RUNTIME.get_or_init(|| {
        let mut builder = Builder::new_multi_thread();
        builder.worker_threads(THREADS).thread_name("storage");
        builder
            .enable_all()
            .build()
            .map_err(|error| error.to_string())
    });
    made.as_ref()
        .map_err(|error| Error::new("", ErrorKind::Unavailable, error.clone()))
}

/// Runs a task to its end.
pub(crate) fn wait_for<T: Send + 'static>(
    task: impl Future<Output = Result<T, Error>> + Send + 'static,
) -> Result<T, Error> {
    let (sender, receiver) = mpsc::sync_channel(1);
    // Not `block_on`: it would panic if the caller's thread belongs to a runtime of its own.
    runtime()?.spawn(async move {
        // nobody waits any more only if the caller's thread is gone
        let _ = sender.send(task.await);
    });
    let ended = || Error::new("", ErrorKind::Unavailable, "the request's thread ended");
    receiver.recv().map_err(|_| ended())?
}

/// Starts a task; it ends early when the handle is aborted.
pub(crate) fn start(
    task: impl Future<Output = ()> + Send + 'static,
) -> Result<tokio::task::AbortHandle, Error> {
    Ok(runtime()?.spawn(task).abort_handle())
}
