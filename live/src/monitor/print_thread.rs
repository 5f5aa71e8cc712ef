//! Prints verdicts outside the monitor's loop: a slow reader of stdout does not delay it.

use std::io::{self, BufWriter, ErrorKind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::Duration;

use anyhow::Result;

use super::output::{Format, Printer};
use super::session_monitor::Monitor;
use crate::wire::names::Names;
use crate::wire::topics::{WireMachine, WireVerdict};

/// Verdicts that can wait to be printed.
const WAITING: usize = 1024;
/// The wait when there is nothing to print.
const IDLE_PERIOD: Duration = Duration::from_millis(1);

/// Handle of the thread that prints.
#[derive(Debug)]
pub(super) struct PrintThread {
    ring: rtrb::Producer<WireVerdict>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    /// Verdicts dropped because the queue was full.
    dropped: u64,
    failure: Arc<OnceLock<io::Error>>,
}

#[derive(Debug, Default)]
struct Shared {
    names: OnceLock<Names>,
    ends: AtomicBool,
    /// The reader has closed stdout, or a write has failed.
    is_done: AtomicBool,
}

impl PrintThread {
    /// Starts printing to stdout.
    ///
    /// # Errors
    /// No thread can be started.
    pub(super) fn start(format: Format) -> Result<Self> {
        let (ring, verdicts) = rtrb::RingBuffer::new(WAITING);
        let shared = Arc::new(Shared::default());
        let failure = Arc::new(OnceLock::new());
        let thread = {
            let (shared, failure) = (Arc::clone(&shared), Arc::clone(&failure));
            std::thread::Builder::new()
                .name("print".into())
                .spawn(move || {
                    match print_all(format, verdicts, &shared) {
                        // the reader has closed stdout: not an error
                        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
                            let _ = failure.set(error);
                        }
                        _ => {}
                    }
                    shared.is_done.store(true, Ordering::Release);
                })?
        };
        Ok(Self {
            ring,
            shared,
            thread: Some(thread),
            dropped: 0,
            failure,
        })
    }

    /// Sets the names to print: those of the session's machine.
    ///
    /// # Errors
    /// A name is too long for the wire.
    pub(super) fn set_machine(&self, monitor: &Monitor) -> Result<()> {
        let wire = WireMachine::new(monitor.machine(), monitor.session())?;
        let names = Names::try_from(&wire.commissioned(monitor.commissioning()))?;
        // all sessions are of one machine
        let _ = self.shared.names.set(names);
        Ok(())
    }

    /// Prints a verdict. A full queue drops it, unless real time is not checked.
    pub(super) fn print(&mut self, verdict: &WireVerdict) {
        let mut waits = self.ring.push(*verdict);
        while let Err(rtrb::PushError::Full(verdict)) = waits {
            // a replay as fast as possible waits for the printer, a machine never does
            if verdict.untimed == 0 || self.shared.is_done.load(Ordering::Acquire) {
                self.dropped += 1;
                return;
            }
            std::thread::sleep(Duration::from_micros(100));
            waits = self.ring.push(verdict);
        }
    }

    /// Whether printing goes on: the reader of stdout has not closed it, and no write has failed.
    #[must_use]
    pub(super) fn wants_more(&self) -> bool {
        !self.shared.is_done.load(Ordering::Acquire)
    }

    /// Prints the verdicts that wait; returns how many were dropped.
    ///
    /// # Errors
    /// Stdout cannot be written.
    pub(super) fn finish(mut self) -> Result<u64> {
        self.shared.ends.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        match self.failure.get() {
            Some(error) => Err(io::Error::new(error.kind(), error.to_string()).into()),
            None => Ok(self.dropped),
        }
    }
}

fn print_all(
    format: Format,
    mut verdicts: rtrb::Consumer<WireVerdict>,
    shared: &Shared,
) -> io::Result<()> {
    let out = BufWriter::with_capacity(1 << 16, io::stdout());
    let mut printer = Printer::new(format, Names::default(), out);
    let mut has_names = false;
    loop {
        // read before the ring, so that everything pushed before the end is printed
        let ends = shared.ends.load(Ordering::Acquire);
        while let Ok(verdict) = verdicts.pop() {
            if !has_names && let Some(names) = shared.names.get() {
                printer.set_names(names.clone());
                has_names = true;
            }
            printer.print(&verdict)?;
        }
        printer.flush()?;
        if ends {
            return Ok(());
        }
        std::thread::sleep(IDLE_PERIOD);
    }
}
