//! Analyses logs in parallel, one per worker, as many as fit into memory.

use std::path::{Path, PathBuf};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use anyhow::{Context, Result};

use crate::base::lock::lock;
use crate::base::memory;

/// Memory of an analysis regardless of the size of the log (bytes).
const BASE_BYTES: u64 = 96 << 20;
/// Additional memory per byte of the log, if it contains only joint states and IMU samples under zstd;
/// images and point clouds need none.
const BYTES_PER_BYTE: u64 = 12;
/// Stack size of a worker, as large as that of a main thread.
const STACK_BYTES: usize = 8 << 20;

/// The queue of logs.
struct Queue {
    /// Sizes and paths of the logs, the largest first.
    waiting: Vec<(u64, PathBuf)>,
    /// Estimated memory of the logs in progress (bytes).
    in_use_bytes: u64,
    /// An error of the run itself, not of a log: all workers stop.
    failure: Option<anyhow::Error>,
}

struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
    memory_bytes: u64,
}

/// Calls `work` for each log on `jobs` threads, the largest first. Each analyses its log on its own, so memory and speed
/// scale with the number of workers. The estimated memory stays within `memory_bytes`, except that one
/// log is always in progress.
///
/// # Errors
/// The first error of `work`; logs in progress are finished, no others are started.
pub(super) fn for_each_log(
    logs: &[PathBuf],
    size_of: impl Fn(&Path) -> u64,
    jobs: usize,
    memory_bytes: Option<u64>,
    work: impl Fn(&Path) -> Result<()> + Sync,
) -> Result<()> {
    let mut waiting: Vec<_> = logs.iter().map(|log| (size_of(log), log.clone())).collect();
    waiting.sort_by(|a, b| b.0.cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
    let shared = Shared {
        queue: Mutex::new(Queue {
            waiting,
            in_use_bytes: 0,
            failure: None,
        }),
        changed: Condvar::new(),
        memory_bytes: memory_bytes.unwrap_or_else(memory::limit_bytes),
    };
    std::thread::scope(|scope| -> Result<()> {
        for _ in 0..jobs.min(logs.len()) {
            let pool = own_thread()?;
            let (shared, work) = (&shared, &work);
            scope.spawn(move || pool.install(|| shared.work_off(work)));
        }
        Ok(())
    })?;
    shared.lock().failure.take().map_or(Ok(()), Err)
}

/// Calls `work` on a worker of its own.
///
/// # Errors
/// The thread cannot be started.
pub(super) fn on_own_thread<R: Send>(work: impl FnOnce() -> R + Send) -> Result<R> {
    Ok(own_thread()?.install(work))
}

/// A worker: parallel parts of an analysis stay on it.
fn own_thread() -> Result<rayon::ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1);
    pool.stack_size(STACK_BYTES)
        .build()
        .context("cannot start a worker thread")
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        lock(&self.queue)
    }

    fn work_off(&self, work: &impl Fn(&Path) -> Result<()>) {
        while let Some((log, memory)) = self.next() {
            let done = work(&log);
            let mut queue = self.lock();
            queue.in_use_bytes -= memory;
            if let Err(error) = done {
                queue.failure.get_or_insert(error);
                queue.waiting.clear();
            }
            drop(queue);
            self.changed.notify_all();
        }
    }

    /// The largest log that fits into the remaining memory; waits while none does. `None` at the end.
    fn next(&self) -> Option<(PathBuf, u64)> {
        let mut queue = self.lock();
        loop {
            if queue.waiting.is_empty() {
                return None;
            }
            let in_use = queue.in_use_bytes;
            let fits = |&(size, _): &(u64, PathBuf)| {
                in_use == 0 || in_use.saturating_add(memory_of(size)) <= self.memory_bytes
            };
            if let Some(place) = queue.waiting.iter().position(fits) {
                let (size, log) = queue.waiting.remove(place);
                queue.in_use_bytes = in_use.saturating_add(memory_of(size));
                return Some((log, memory_of(size)));
            }
            queue = self
                .changed
                .wait(queue)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// Estimated memory of the analysis of a log of this size (bytes).
pub(super) fn memory_of(size: u64) -> u64 {
    // keeps the sum of many far from overflow
    BASE_BYTES
        .saturating_add(size.saturating_mul(BYTES_PER_BYTE))
        .min(1 << 50)
}

/// Size of the files of a log of this computer, for order and memory only; zero if unreadable.
pub(super) fn size_of(path: &Path) -> u64 {
    let Ok(metadata) = std::fs::metadata(path) else {
        return 0;
    };
    if !metadata.is_dir() {
        return metadata.len();
    }
    let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
    let lengths = entries
        .filter_map(|entry| entry.metadata().ok())
        .map(|m| m.len());
    lengths.sum()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    fn most_at_once(memory_bytes: u64) -> (usize, usize) {
        let folder = tempfile::tempdir().unwrap();
        let logs: Vec<PathBuf> = (0..12).map(|i| folder.path().join(i.to_string())).collect();
        for log in &logs {
            std::fs::write(log, [0; 1000]).unwrap();
        }
        let (now, most, done) = (
            AtomicUsize::new(0),
            AtomicUsize::new(0),
            AtomicUsize::new(0),
        );
        for_each_log(&logs, size_of, 4, Some(memory_bytes), |_| {
            most.fetch_max(now.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
            (0..1000).for_each(|_| std::thread::yield_now());
            now.fetch_sub(1, Ordering::SeqCst);
            done.fetch_add(1, Ordering::SeqCst);
            Ok(())
        })
        .unwrap();
        (most.into_inner(), done.into_inner())
    }

    #[test]
    fn every_log_is_done_within_the_memory_limit() {
        assert_eq!(most_at_once(0), (1, 12));
        let two = most_at_once(2 * memory_of(1000));
        assert!(two.0 <= 2 && two.1 == 12, "{two:?}");
        assert_eq!(most_at_once(u64::MAX).1, 12);
    }

    #[test]
    fn an_error_of_the_run_stops_all_workers() {
        let logs = [PathBuf::from("a"), PathBuf::from("b")];
        let error =
            for_each_log(&logs, size_of, 1, None, |_| anyhow::bail!("disk full")).unwrap_err();
        assert_eq!(error.to_string(), "disk full");
    }
}
