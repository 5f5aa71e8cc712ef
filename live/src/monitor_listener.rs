//! What the monitor program does beside its loop: it prints, and is watched over.

use anyhow::Result;

use crate::monitor::Monitor;
use crate::monitor_loop::Listener;
use crate::output::Format;
use crate::print_thread::PrintThread;
use crate::session::Session;
use crate::topics::WireVerdict;
use crate::watch_over::WatchOver;

/// Printing, if wanted, and the thread that watches over the loop.
#[derive(Debug)]
pub struct MonitorListener {
    printing: Option<PrintThread>,
    watch_over: WatchOver,
}

impl MonitorListener {
    /// Starts printing in this format, if any.
    ///
    /// # Errors
    /// No thread can be started.
    pub fn start(format: Option<Format>, watch_over: WatchOver) -> Result<Self> {
        Ok(Self {
            printing: format.map(PrintThread::start).transpose()?,
            watch_over,
        })
    }

    /// Prints what waits; how many verdicts were not printed because there was no room.
    ///
    /// # Errors
    /// Stdout cannot be written.
    pub fn finish(self) -> Result<u64> {
        self.printing.map_or(Ok(0), PrintThread::finish)
    }
}

impl Listener for MonitorListener {
    fn session(&mut self, monitor: &Monitor, session: &Session) -> Result<()> {
        match &mut self.printing {
            Some(printing) => printing.session(monitor, session),
            None => Ok(()),
        }
    }

    fn verdict(&mut self, verdict: &WireVerdict) {
        if let Some(printing) = &mut self.printing {
            printing.verdict(verdict);
        }
    }

    fn cycle(&mut self) {
        self.watch_over.cycle_is_done();
    }

    fn wants_more(&self) -> bool {
        self.printing.as_ref().is_none_or(PrintThread::wants_more)
    }
}
