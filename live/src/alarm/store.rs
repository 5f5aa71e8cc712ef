//! Writes the latched alarm outside the monitor's loop, which never waits for the disk.

use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::Result;
use tipwatch_mechanics::verdict::{Latch, Level};

use super::exchange::Exchange;
use super::file::AlarmFile;
use crate::safety_limits::ALARM_SAVE_NS;
use crate::system::clock::monotonic_ns;

/// How often the thread looks for a changed alarm.
const LOOK_PERIOD: Duration = Duration::from_millis(2);
/// How often it checks that the file is still there, and retries after a failure.
const CHECK_PERIOD: Duration = Duration::from_secs(1);

/// Keeps the alarm of a machine on the disk. Dropping it waits for the last write.
#[derive(Debug)]
pub struct AlarmStore {
    exchange: Arc<Exchange>,
    thread: Option<JoinHandle<()>>,
    wanted: u32,
    /// When the alarm last changed (ns).
    changed_ns: i64,
}

impl AlarmStore {
    /// Opens the store of a machine; returns the alarm that is on the disk. A file that cannot be read counts as a
    /// latched fault. If the folder cannot be written, [`Self::is_unsaved`] tells.
    ///
    /// # Errors
    /// No thread can be started.
    pub fn open(folder: &Path, machine_hash: u64, machine_name: &str) -> Result<(Self, Latch)> {
        let file = AlarmFile::new(folder, machine_hash, machine_name);
        let predecessors = file.predecessors();
        let mut latch = file.read().unwrap_or_else(|error| {
            eprintln!(
                "monitor: {}: {error}; an alarm may be lost: it counts as a fault that nobody has acknowledged",
                file.path().display()
            );
            file.keep_damaged();
            Latch::raised(Level::Fault)
        });
        for (before, latched) in &predecessors {
            eprintln!(
                "monitor: {}: the alarm of a machine of this name is taken over",
                before.path().display()
            );
            latch = worse(latch, *latched);
        }
        let wanted = number_of(latch);
        let exchange = Arc::new(Exchange::new(wanted));
        // the first write shows whether the folder can be written
        exchange.save(&mut |alarm, had_failed| write(&file, alarm, had_failed));
        if !exchange.has_failed() {
            for (before, _) in &predecessors {
                // if this fails it is taken over once more
                let _ = before.write(Latch::default());
            }
        }
        let thread = {
            let exchange = Arc::clone(&exchange);
            std::thread::Builder::new()
                .name("alarm".into())
                .spawn(move || write_all(&exchange, &file))?
        };
        let store = Self {
            exchange,
            thread: Some(thread),
            wanted,
            changed_ns: monotonic_ns(),
        };
        Ok((store, latch))
    }

    /// Keeps this alarm from now on. It neither waits nor allocates.
    pub fn keep(&mut self, latch: Latch) {
        let wanted = number_of(latch);
        if wanted != self.wanted {
            self.wanted = wanted;
            self.changed_ns = monotonic_ns();
            self.exchange.want(wanted);
        }
    }

    /// Whether a power cut would lose the alarm: writing has failed, or takes too long.
    #[must_use]
    pub fn is_unsaved(&self) -> bool {
        self.exchange.has_failed()
            || !self.exchange.is_saved(self.wanted)
                && monotonic_ns().saturating_sub(self.changed_ns) > ALARM_SAVE_NS
    }
}

impl Drop for AlarmStore {
    fn drop(&mut self) {
        self.exchange.end();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// The store in its own thread.
fn write_all(exchange: &Exchange, file: &AlarmFile) {
    let mut checked = Instant::now();
    let pause = |exchange: &Exchange| {
        std::thread::sleep(LOOK_PERIOD);
        let is_check = checked.elapsed() >= CHECK_PERIOD;
        if is_check {
            checked = Instant::now();
            if !file.path().exists() {
                exchange.lose();
            }
        }
        is_check
    };
    exchange.run(pause, |alarm, had_failed| write(file, alarm, had_failed));
}

/// Writes an alarm; returns whether that has succeeded. The first failure and the first success after it are told.
fn write(file: &AlarmFile, alarm: u32, had_failed: bool) -> bool {
    let path = file.path();
    match file.write(latch_of(alarm)) {
        Ok(()) => {
            if had_failed {
                eprintln!("monitor: {}: the alarm is saved again", path.display());
            }
            true
        }
        Err(error) => {
            if !had_failed {
                eprintln!(
                    "monitor: {}: cannot save the alarm: {error}; a power cut or a restart would lose it",
                    path.display()
                );
            }
            false
        }
    }
}

/// Of two alarms the higher one, acknowledged if both are.
fn worse(a: Latch, b: Latch) -> Latch {
    let is_done = |latch: Latch| latch.level.is_none() || latch.is_acknowledged;
    Latch {
        level: a.level.max(b.level),
        is_acknowledged: is_done(a) && is_done(b),
    }
}

/// An alarm as a number.
fn number_of(latch: Latch) -> u32 {
    latch.level.map_or(0, |level| level as u32) << 1 | u32::from(latch.is_acknowledged)
}

fn latch_of(number: u32) -> Latch {
    Latch {
        level: Some(Level::from_number(number >> 1)).filter(|_| number >> 1 != 0),
        is_acknowledged: number & 1 == 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // requirement: TW-VERDICT-20
    #[test]
    fn alarm_outlives_its_store() {
        let folder = tempfile::tempdir().unwrap();
        let (mut store, latch) = AlarmStore::open(folder.path(), 3, "m").unwrap();
        assert_eq!(latch, Latch::default());
        store.keep(Latch::raised(Level::Danger));
        drop(store);
        let (store, latch) = AlarmStore::open(folder.path(), 3, "m").unwrap();
        assert_eq!(latch, Latch::raised(Level::Danger));
        assert!(!store.is_unsaved());
        let (_, other) = AlarmStore::open(folder.path(), 4, "other").unwrap();
        assert_eq!(other, Latch::default(), "another machine");
        drop(store);
        // a changed machine file: the alarm moves
        let (_, latch) = AlarmStore::open(folder.path(), 5, "m").unwrap();
        assert_eq!(latch, Latch::raised(Level::Danger));
        let (_, latch) = AlarmStore::open(folder.path(), 3, "m").unwrap();
        assert_eq!(latch, Latch::default());
    }

    // requirement: TW-VERDICT-20
    #[test]
    fn damaged_file_counts_as_a_latched_fault() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(AlarmFile::new(folder.path(), 3, "m").path(), "").unwrap();
        let (_, latch) = AlarmStore::open(folder.path(), 3, "m").unwrap();
        assert_eq!(latch, Latch::raised(Level::Fault));
    }

    // requirement: TW-FAULT-19
    #[test]
    fn folder_that_cannot_be_written_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let blocked = folder.path().join("blocked");
        std::fs::write(&blocked, "a file").unwrap();
        let (store, latch) = AlarmStore::open(&blocked, 3, "m").unwrap();
        assert!(store.is_unsaved());
        // nobody knows what was there
        assert_eq!(latch, Latch::raised(Level::Fault));
    }
}
