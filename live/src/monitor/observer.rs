//! Observers of the monitor's loop: they print verdicts, and report every cycle to housekeeping.

use anyhow::Result;

use super::output::Format;
use super::print_thread::PrintThread;
use super::session_monitor::Monitor;
use crate::node::Housekeeping;
use crate::wire::session::Session;
use crate::wire::topics::WireVerdict;

/// Observes the monitor's loop. It is called within the loop and must not wait.
pub trait Observer {
    /// A session begins.
    ///
    /// # Errors
    /// Ends the loop.
    fn session(&mut self, monitor: &Monitor, session: &Session) -> Result<()>;

    /// A verdict was sent.
    fn verdict(&mut self, verdict: &WireVerdict);

    /// A cycle is complete.
    fn cycle(&mut self) {}

    /// Whether the monitor's loop is to go on.
    fn wants_more(&self) -> bool {
        true
    }
}

/// The observer of the program `monitor`.
#[derive(Debug)]
pub struct ProgramObserver {
    printing: Option<PrintThread>,
    housekeeping: Housekeeping,
}

impl ProgramObserver {
    /// Starts printing in this format, if any.
    ///
    /// # Errors
    /// No thread can be started.
    pub fn start(format: Option<Format>, housekeeping: Housekeeping) -> Result<Self> {
        Ok(Self {
            printing: format.map(PrintThread::start).transpose()?,
            housekeeping,
        })
    }

    /// Prints the verdicts that wait; returns how many were dropped because printing was too slow.
    ///
    /// # Errors
    /// Stdout cannot be written.
    pub fn finish(self) -> Result<u64> {
        self.printing.map_or(Ok(0), PrintThread::finish)
    }
}

impl Observer for ProgramObserver {
    fn session(&mut self, monitor: &Monitor, _: &Session) -> Result<()> {
        match &self.printing {
            Some(printing) => printing.set_machine(monitor),
            None => Ok(()),
        }
    }

    fn verdict(&mut self, verdict: &WireVerdict) {
        if let Some(printing) = &mut self.printing {
            printing.print(verdict);
        }
    }

    fn cycle(&mut self) {
        self.housekeeping.cycle_completed();
    }

    fn wants_more(&self) -> bool {
        self.printing.as_ref().is_none_or(PrintThread::wants_more)
    }
}
