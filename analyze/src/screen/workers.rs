//! Logs in parallel, one on each worker, as many at a time as fit into memory.

use std::path::{Path, PathBuf};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use anyhow::{Context, Result};

/// The analysis of a log on a worker takes this much whatever its size (bytes).
const BASE_BYTES: u64 = 96 << 20;
/// ... and this many times the size of the log's files, were they nothing but joint states and IMU
/// samples under zstd; images and point clouds take nothing.
const BYTES_PER_BYTE: u64 = 12;
/// Of the machine's free memory this share is used where no limit is given (%).
const DEFAULT_MEMORY_PERCENT: u64 = 75;
/// Where the system does not tell how much is free (bytes).
const FALLBACK_MEMORY_BYTES: u64 = 2 << 30;
/// Stack of a worker, as large as that of a main thread.
const STACK_BYTES: usize = 8 << 20;

/// What workers take their logs from.
struct Queue {
    /// Size of the log's files and its path, the largest first.
    waiting: Vec<(u64, PathBuf)>,
    /// Estimated memory of the logs at work (bytes).
    in_use_bytes: u64,
    /// An error of the screen itself, not of a log: everybody stops.
    failure: Option<anyhow::Error>,
}

struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
    memory_bytes: u64,
}

/// Calls `work` for each log, on `jobs` threads of their own; each does its log alone, so that memory
/// and speed go with the number of workers. Estimated memory stays within `memory_bytes`, except that one
/// log is always at work.
///
/// # Errors
/// The first error of `work`; what was begun is done, nothing more is begun.
pub(super) fn for_each_log(
    logs: &[PathBuf],
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
        memory_bytes: memory_bytes.unwrap_or_else(default_memory_bytes),
    };
    std::thread::scope(|scope| -> Result<()> {
        for _ in 0..jobs.min(logs.len()) {
            // whatever the analysis does in parallel stays on this worker
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(1)
                .stack_size(STACK_BYTES)
                .build()
                .context("a worker cannot be started")?;
            let (shared, work) = (&shared, &work);
            scope.spawn(move || pool.install(|| shared.work_off(work)));
        }
        Ok(())
    })?;
    shared.lock().failure.take().map_or(Ok(()), Err)
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        // nobody panics while holding it
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
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

    /// The largest log that fits beside those at work; waits while none does. `None` at the end.
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
fn memory_of(size: u64) -> u64 {
    // far from overflow of a sum of many
    BASE_BYTES
        .saturating_add(size.saturating_mul(BYTES_PER_BYTE))
        .min(1 << 50)
}

/// Size of a log's files, for the order only: what cannot be read is small.
fn size_of(path: &Path) -> u64 {
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

fn default_memory_bytes() -> u64 {
    let text = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"));
    let kilobytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<u64>().ok());
    kilobytes.map_or(FALLBACK_MEMORY_BYTES, |free| {
        free.saturating_mul(1024) / 100 * DEFAULT_MEMORY_PERCENT
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

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
        for_each_log(&logs, 4, Some(memory_bytes), |_| {
            most.fetch_max(now.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
            std::thread::sleep(Duration::from_millis(5));
            now.fetch_sub(1, Ordering::SeqCst);
            done.fetch_add(1, Ordering::SeqCst);
            Ok(())
        })
        .unwrap();
        (most.into_inner(), done.into_inner())
    }

    #[test]
    fn every_log_is_done_with_no_more_at_once_than_fit() {
        assert_eq!(most_at_once(0), (1, 12));
        let two = most_at_once(2 * memory_of(1000));
        assert!(two.0 <= 2 && two.1 == 12, "{two:?}");
        assert_eq!(most_at_once(u64::MAX).1, 12);
    }

    #[test]
    fn an_error_of_the_screen_itself_ends_it() {
        let logs = [PathBuf::from("a"), PathBuf::from("b")];
        let error = for_each_log(&logs, 1, None, |_| anyhow::bail!("disk full")).unwrap_err();
        assert_eq!(error.to_string(), "disk full");
    }
}
