//! The thread that makes files durable: periodically, and at once after an alarm.

use std::fs::File;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use anyhow::Result;

/// A power failure loses at most this, apart from the time of the sync itself.
const PERIOD: Duration = Duration::from_millis(200);

enum Order {
    Follow(File),
    Now,
}

/// Handle of the thread. The thread ends when this is dropped.
pub(super) struct SyncThread(Sender<Order>);

impl SyncThread {
    pub(super) fn start() -> Result<Self> {
        let (sender, receiver) = channel();
        std::thread::Builder::new()
            .name("sync".into())
            .spawn(move || sync_all(&receiver))?;
        Ok(Self(sender))
    }

    /// Syncs this file from now on.
    pub(super) fn follow(&self, file: File) {
        // the thread lives as long as this handle
        let _ = self.0.send(Order::Follow(file));
    }

    /// Syncs at once.
    pub(super) fn now(&self) {
        let _ = self.0.send(Order::Now);
    }
}

fn sync_all(orders: &Receiver<Order>) {
    let mut file: Option<File> = None;
    let mut failed = false;
    let mut due = Instant::now() + PERIOD;
    loop {
        match orders.recv_timeout(due.saturating_duration_since(Instant::now())) {
            Ok(Order::Follow(next)) => {
                failed = false;
                file = Some(next);
                continue;
            }
            Ok(Order::Now) | Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
        if let Some(file) = &file
            && let Err(error) = file.sync_data()
            && !std::mem::replace(&mut failed, true)
        {
            eprintln!("record: cannot sync the file: {error}");
        }
        due = Instant::now() + PERIOD;
    }
}
