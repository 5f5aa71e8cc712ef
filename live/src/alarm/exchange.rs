//! Exchange of numbers between the monitor's loop and the thread that writes the alarm. Neither waits for the other.

use crate::system::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// No alarm is written as this number.
const UNSAVED: u64 = u64::MAX;

/// Shared by the two threads: one wants alarms, the other writes them.
#[derive(Debug)]
pub(super) struct Exchange {
    /// The alarm to be written, and the one on the disk.
    wanted: AtomicU64,
    saved: AtomicU64,
    has_failed: AtomicBool,
    ends: AtomicBool,
}

impl Exchange {
    /// Creates the exchange; the alarm of this number is to be written first.
    pub(super) fn new(wanted: u64) -> Self {
        Self {
            wanted: AtomicU64::new(wanted),
            saved: AtomicU64::new(UNSAVED),
            has_failed: AtomicBool::new(false),
            ends: AtomicBool::new(false),
        }
    }

    /// Asks for the alarm of this number to be written. Older alarms need not be written any more.
    pub(super) fn want(&self, alarm: u64) {
        self.wanted.store(alarm, Ordering::Release);
    }

    /// Asks the writing thread to end once the last alarm is written.
    pub(super) fn end(&self) {
        self.ends.store(true, Ordering::Release);
    }

    /// Whether the last write has failed.
    pub(super) fn has_failed(&self) -> bool {
        self.has_failed.load(Ordering::Acquire)
    }

    /// Whether the alarm of this number is on the disk.
    pub(super) fn is_saved(&self, alarm: u64) -> bool {
        self.saved.load(Ordering::Acquire) == alarm
    }

    /// Notes that the alarm is no longer on the disk.
    pub(super) fn lose(&self) {
        self.saved.store(UNSAVED, Ordering::Release);
    }

    /// Writes alarms until the end, the last one at the end. `pause` waits between two looks, and returns whether a
    /// failed write is to be tried again.
    pub(super) fn run(
        &self,
        mut pause: impl FnMut(&Self) -> bool,
        mut write: impl FnMut(u64, bool) -> bool,
    ) {
        while !self.ends.load(Ordering::Acquire) {
            let retries = pause(self);
            if retries || !self.has_failed() {
                self.save(&mut write);
            }
        }
        self.save(&mut write);
    }

    /// Has the alarm written unless it is on the disk. `write` is told whether the last write had failed, and returns
    /// whether this one succeeded.
    pub(super) fn save(&self, write: &mut impl FnMut(u64, bool) -> bool) {
        let wanted = self.wanted.load(Ordering::Acquire);
        if self.is_saved(wanted) {
            return;
        }
        let is_written = write(wanted, self.has_failed());
        if is_written {
            self.saved.store(wanted, Ordering::Release);
        }
        self.has_failed.store(!is_written, Ordering::Release);
    }
}
