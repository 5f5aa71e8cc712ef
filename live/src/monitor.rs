//! The monitor: a sample in, at most one row out. It knows nothing of where samples come from.

use tipwatch_mechanics::signal::{CausalEstimator, Reasons, RowClock, Sensors};
use tipwatch_mechanics::{Machine, Outcome, Workspace, evaluate};

use crate::sample::Message;
use crate::topics::WireSample;

/// Estimates and evaluates, sample by sample. [`Self::take`] allocates nothing.
#[derive(Debug)]
pub struct Monitor {
    machine: Machine,
    session: u64,
    estimator: CausalEstimator,
    workspace: Workspace<f64>,
    next_sequence: Option<u64>,
    counts: Counts,
}

/// The result for one instant.
#[derive(Debug, Clone, Copy)]
pub struct Row<'a> {
    /// Its time, in nanoseconds, by the clock of the joint states.
    pub time_ns: i64,
    /// Why it is not valid; empty if it is.
    pub reasons: Reasons,
    /// Loads and stability.
    pub outcome: &'a Outcome<f64>,
}

/// What became of the samples.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Rows given.
    pub rows: u64,
    /// Samples of the session before the first that came.
    pub before_joining: u64,
    /// Samples that never came since then.
    pub lost: u64,
    /// Samples that came but could not be used: of another session, malformed, not later than the one
    /// before, or not finite.
    pub refused: u64,
    /// Samples that came again, and were not used again.
    pub repeated: u64,
}

/// Whether more is to come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// The session goes on.
    Running,
    /// The session is over.
    Ended,
}

impl Monitor {
    /// A monitor of one session that has seen nothing.
    #[must_use]
    pub fn new(machine: Machine, sensors: &Sensors, session: u64) -> Self {
        Self {
            estimator: CausalEstimator::new(&machine, sensors, RowClock::JointStates),
            workspace: Workspace::new(&machine),
            machine,
            session,
            next_sequence: None,
            counts: Counts::default(),
        }
    }

    /// What became of the samples so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The machine.
    #[must_use]
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// Takes a message; `give` is called with the row that it completes.
    pub fn take(&mut self, wire: &WireSample, give: &mut dyn FnMut(&Row<'_>)) -> Progress {
        if wire.session != self.session {
            self.counts.refused += 1;
            return Progress::Running;
        }
        if !self.is_next(wire.sequence) {
            self.counts.repeated += 1;
            return Progress::Running;
        }
        match Message::try_from(wire) {
            Ok(Message::End) => return Progress::Ended,
            Ok(Message::Sample(sample)) => {
                let Self {
                    machine,
                    estimator,
                    workspace,
                    counts,
                    ..
                } = self;
                let pushed = estimator.push(machine, &sample, &mut |estimate| {
                    let outcome = evaluate(machine, &estimate.state, workspace);
                    counts.rows += 1;
                    give(&Row {
                        time_ns: estimate.time_ns,
                        reasons: estimate.reasons.with_outcome(outcome),
                        outcome,
                    });
                });
                self.counts.refused += u64::from(pushed.is_err());
            }
            Err(_) => self.counts.refused += 1,
        }
        Progress::Running
    }

    /// Counts what is missing before `sequence`; whether it was not seen yet.
    fn is_next(&mut self, sequence: u64) -> bool {
        match self.next_sequence {
            None => self.counts.before_joining = sequence,
            Some(next) if sequence < next => return false,
            Some(next) => self.counts.lost += sequence - next,
        }
        self.next_sequence = Some(sequence.saturating_add(1));
        true
    }
}
