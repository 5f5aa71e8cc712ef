//! The monitor: messages in, verdicts out. It knows nothing of where they come from or go to.

use tipwatch_mechanics::estimation::{CausalEstimator, RowClock};
use tipwatch_mechanics::state::Sensors;
use tipwatch_mechanics::verdict::{
    Conditions, InputFault, Judge, LiftOffForecast, RowFacts, Verdict,
};
use tipwatch_mechanics::{Machine, Scope, Workspace, evaluate, reference_posture};

use crate::guard::{Counts, Guard, SessionFacts};
use crate::sample::Message;
use crate::topics::{EVENT_BETWEEN, WireSample, WireVerdict};

/// A verdict is published at least so often (ns).
pub const HEARTBEAT_NS: i64 = 20_000_000;
/// A verdict may be acted on for so long (ns).
pub const VALIDITY_NS: i64 = 100_000_000;
/// A verdict that comes later after its sample is late (ns).
pub const DEADLINE_NS: i64 = 20_000_000;
/// So many cycles of the loop in a row with late verdicts are a fault.
const MOST_LATE: u32 = 3;

/// Follows one session. Once the first row has set the static loads, nothing allocates.
#[derive(Debug)]
pub struct Monitor {
    machine: Machine,
    guard: Guard,
    estimator: CausalEstimator,
    workspace: Workspace<f64>,
    judge: Judge,
    forecast: LiftOffForecast,
    has_reference: bool,
    is_acknowledged: bool,
    cycle: Cycle,
    /// Cycles in a row with late verdicts.
    late: u32,
    published_ns: i64,
    wire: WireVerdict,
}

/// Whether more is to come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// The session goes on.
    Running,
    /// The session is over.
    Ended,
}

/// Seals and sends a verdict; tells when that was (ns).
pub type Publish<'a> = dyn FnMut(&mut WireVerdict) -> i64 + 'a;

impl Monitor {
    /// A monitor of one session that has seen nothing; `now_ns` is the time of CLOCK_MONOTONIC, here
    /// and everywhere.
    #[must_use]
    pub fn new(machine: Machine, sensors: &Sensors, session: &SessionFacts, now_ns: i64) -> Self {
        let guard = Guard::new(session, sensors, now_ns);
        let mut wire = WireVerdict::unknown();
        wire.session = session.id;
        wire.untimed = u32::from(!guard.is_timed());
        Self {
            estimator: CausalEstimator::new(&machine, sensors, RowClock::JointStates),
            workspace: Workspace::with_scope(&machine, Scope::ALL),
            judge: Judge::new(machine.limits()),
            forecast: LiftOffForecast::new(&machine),
            guard,
            machine,
            has_reference: false,
            is_acknowledged: false,
            cycle: Cycle::Empty,
            late: 0,
            published_ns: i64::MIN,
            wire,
        }
    }

    /// What became of the samples so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.guard.counts()
    }

    /// The session that it follows.
    #[must_use]
    pub fn session(&self) -> u64 {
        self.wire.session
    }

    /// The machine.
    #[must_use]
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// The verdict now.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.judge.between_rows(self.guard.conditions())
    }

    /// Takes over an alarm that still waits to be acknowledged, from the monitor before this one.
    pub fn succeed(&mut self, before: &Self) {
        self.judge.succeed(&before.judge);
    }

    /// Somebody has seen the alarm.
    pub fn acknowledge(&mut self) {
        self.is_acknowledged = true;
    }

    /// Something that only the reader of the shared memory knows is wrong.
    pub fn note(&mut self, fault: InputFault) {
        self.guard.note(fault);
    }

    /// Takes a message; `publish` is called with the row that it completes.
    pub fn take(&mut self, wire: &WireSample, now_ns: i64, publish: &mut Publish<'_>) -> Progress {
        let sample = match self.guard.admit(wire, now_ns) {
            Ok(Message::Sample(sample)) => sample,
            Ok(Message::End) => return Progress::Ended,
            Err(_) => return Progress::Running,
        };
        let mut is_row = false;
        let pushed = self
            .estimator
            .push(&self.machine, &sample, &mut |_| is_row = true);
        let findings = self.estimator.findings();
        self.guard
            .estimated(&sample, wire.published_ns, pushed, findings);
        if is_row {
            self.wire.sample_sequence = wire.sequence;
            self.wire.sample_published_ns = wire.published_ns;
            self.guard.check_row(&sample, wire.published_ns, now_ns);
            self.row(publish);
        }
        Progress::Running
    }

    fn row(&mut self, publish: &mut Publish<'_>) {
        let estimate = self.estimator.last();
        let time_ns = estimate.time_ns;
        if !self.has_reference
            && let Some(posture) =
                reference_posture(&self.machine, &estimate.state, estimate.reasons)
        {
            self.machine.refer_to_posture(&posture);
            self.has_reference = true;
        }
        let outcome = evaluate(&self.machine, &estimate.state, &mut self.workspace);
        let reasons = estimate.reasons.with_outcome(outcome);
        let mut utilisation = f64::NAN;
        let mut next = None;
        if self.has_reference {
            utilisation = outcome.uncertainty.utilisation;
            if reasons.leave_loads() {
                next = self.forecast.row(&self.machine, time_ns, &outcome.otf);
            }
        }
        let conditions = self.guard.conditions();
        let verdict = self.judge.row(&RowFacts {
            time_ns,
            reasons,
            utilisation,
            conditions,
            is_acknowledged: self.is_acknowledged,
        });
        self.wire.acknowledged = self.is_acknowledged.into();
        self.is_acknowledged = false;
        self.guard.row_is_done();
        self.wire
            .set_row(time_ns, reasons, outcome, utilisation, next);
        self.publish(verdict, conditions, publish);
        self.note_lateness();
    }

    /// After all samples that waited: publishes a verdict that has become worse, and now and then the one that stands.
    pub fn tick(&mut self, now_ns: i64, publish: &mut Publish<'_>) {
        self.end_cycle();
        self.guard.check_freshness(now_ns);
        let conditions = self.guard.conditions();
        let verdict = self.judge.between_rows(conditions);
        let is_new = verdict != self.wire.verdict();
        if is_new || now_ns.saturating_sub(self.published_ns) >= HEARTBEAT_NS {
            self.wire.event = EVENT_BETWEEN;
            self.publish(verdict, conditions, publish);
        }
    }

    fn publish(&mut self, verdict: Verdict, conditions: Conditions, publish: &mut Publish<'_>) {
        let counts = self.guard.counts();
        self.wire.set_verdict(verdict, conditions, counts);
        self.published_ns = publish(&mut self.wire);
    }

    /// Late verdicts of one cycle have one cause and count once.
    fn note_lateness(&mut self) {
        let delay_ns = self
            .published_ns
            .saturating_sub(self.wire.sample_published_ns);
        let is_late = self.guard.is_timed() && delay_ns > DEADLINE_NS;
        self.cycle = self
            .cycle
            .max(if is_late { Cycle::Late } else { Cycle::InTime });
    }

    fn end_cycle(&mut self) {
        match std::mem::replace(&mut self.cycle, Cycle::Empty) {
            Cycle::Empty => {}
            Cycle::InTime => self.late = 0,
            Cycle::Late => self.late += 1,
        }
        if self.late >= MOST_LATE {
            self.guard.note(InputFault::VerdictLate);
        }
    }
}

/// What verdicts there were since the last tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Cycle {
    /// None.
    Empty,
    /// All of them in time.
    InTime,
    /// A late one.
    Late,
}
