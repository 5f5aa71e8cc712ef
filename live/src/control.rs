//! The control of an active suspension: samples and verdicts in, openings of the valves out. It knows
//! nothing of where they come from or go to.
//!
//! ```text
//!     samples -> guard -> estimator -> stabiliser, once a step -> valve law, every row -> openings
//!     verdicts ----------------------> may it follow? no: openings ramp to zero, and hold
//! ```
//! Valves follow only while rows are valid, the verdict is fresh and neither unknown nor a fault, and the
//! rods do what they are told. On any doubt the openings go to zero at [`RAMP_RATE`] and stay there:
//! with counterbalance valves that holds the platform. Danger does not stop the control: that is when it
//! helps.

use anyhow::Result;
use tipwatch_mechanics::estimation::{CausalEstimator, RowClock};
use tipwatch_mechanics::state::{Sensor, Sensors};
use tipwatch_mechanics::verdict::Level;
use tipwatch_mechanics::{Machine, reference_posture};
use tipwatch_suspension::{Controller, MAX_ACTUATORS, Replay};

use crate::command::{HoldReason, HoldReasons, Mode, status_number};
use crate::guard::{Counts, Guard, SessionFacts};
use crate::monitor::{DEADLINE_NS, HEARTBEAT_NS, Progress};
use crate::sample::Message;
use crate::topics::{EVENT_BETWEEN, EVENT_ROW, Wire, WireCommand, WireSample, WireVerdict};

/// How fast openings go to zero where the valves are not to follow (full openings a second): from all
/// the way open in a quarter of a second, which closes no valve with a blow.
pub const RAMP_RATE: f64 = 4.0;
/// A command is sent at least so often while valves close (ns).
const RAMP_PERIOD_NS: i64 = 2_000_000;
/// Good rows in a row before the valves follow.
const GOOD_ROWS: u32 = 10;
/// No row for so long: none.
const ROW_NS: i64 = 50_000_000;
/// Rows with late commands in a row that are too many.
const MOST_LATE: u32 = 3;
/// A valve this far open moves its rod (opening).
const OPEN: f64 = 0.1;
/// A rod that moved less did not move (m).
const STILL: f64 = 1e-3;
/// How long a valve may be open, in all, while its rod does not move (s).
const STILL_S: f64 = 1.0;

/// Follows one session. Once it has seen the first valid row, nothing allocates.
#[derive(Debug)]
pub struct Control {
    machine: Machine,
    guard: Guard,
    estimator: CausalEstimator,
    rods: Replay,
    controller: Option<Controller>,
    verdict: Option<SeenVerdict>,
    /// Time of the last row, and when it came (ns).
    row_ns: Option<(i64, i64)>,
    row_is_valid: bool,
    /// Time of the row at which the stabiliser is asked next (ns).
    due_ns: i64,
    good_rows: u32,
    late: u32,
    solver_holds: bool,
    stuck: [Stuck; MAX_ACTUATORS],
    is_stuck: bool,
    is_over: bool,
    /// When the openings last changed (ns).
    moved_ns: i64,
    published_ns: i64,
    wire: WireCommand,
}

/// What of a verdict matters here.
#[derive(Debug, Clone, Copy)]
struct SeenVerdict {
    is_fit: bool,
    valid_until_ns: i64,
}

/// Where a rod has not moved from (m), and how long its valve has been open since (s).
#[derive(Debug, Clone, Copy)]
struct Stuck {
    from: f64,
    open_s: f64,
}

impl Stuck {
    const NEVER: Self = Self {
        from: f64::NAN,
        open_s: 0.0,
    };
}

/// Seals and sends a command; tells when that was (ns).
pub type Send<'a> = dyn FnMut(&mut WireCommand) -> i64 + 'a;

impl Control {
    /// A control of one session that has seen nothing; `now_ns` is the time of CLOCK_MONOTONIC, here and
    /// everywhere.
    ///
    /// # Errors
    /// The machine has no suspension that can be steered.
    pub fn new(
        machine: Machine,
        sensors: &Sensors,
        session: &SessionFacts,
        now_ns: i64,
    ) -> Result<Self> {
        let rods = Replay::new(&machine)?;
        let mut wire = WireCommand::closed();
        wire.session = session.id;
        wire.actuator_count = rods.actuators() as u32;
        Ok(Self {
            guard: Guard::new(session, sensors, now_ns),
            estimator: CausalEstimator::new(&machine, sensors, RowClock::JointStates),
            machine,
            rods,
            controller: None,
            verdict: None,
            row_ns: None,
            row_is_valid: false,
            due_ns: i64::MIN,
            good_rows: 0,
            late: 0,
            solver_holds: false,
            stuck: [Stuck::NEVER; MAX_ACTUATORS],
            is_stuck: false,
            is_over: false,
            moved_ns: now_ns,
            published_ns: i64::MIN,
            wire,
        })
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

    /// Somebody has seen that a rod does not follow.
    pub fn acknowledge(&mut self) {
        self.is_stuck = false;
        self.stuck = [Stuck::NEVER; MAX_ACTUATORS];
    }

    /// Takes over from the control of the session before this one: valves go on from where they are.
    pub fn succeed(&mut self, before: &Self) {
        self.wire.opening = before.wire.opening;
        self.moved_ns = before.moved_ns;
        self.is_stuck = before.is_stuck;
    }

    /// No more samples come: the valves close.
    pub fn end(&mut self) {
        self.is_over = true;
    }

    /// Whether it was ended and the valves are closed.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.is_over && self.is_closed()
    }

    /// Takes a verdict. One that is torn, or of another session, is none.
    pub fn verdict(&mut self, wire: &WireVerdict) {
        if !wire.is_whole() || wire.session != self.wire.session {
            return;
        }
        let verdict = wire.verdict();
        let is_fit = |level: Level| !matches!(level, Level::Unknown | Level::Fault);
        self.verdict = Some(SeenVerdict {
            is_fit: is_fit(verdict.level) && verdict.latched_level != Level::Fault,
            valid_until_ns: wire.valid_until_ns,
        });
        self.wire.verdict_sequence = wire.sequence;
        self.wire.level = wire.level;
    }

    /// Takes a message; `send` is called with the command of the row that it completes.
    ///
    /// # Errors
    /// The machine cannot be steered from where it stands.
    pub fn take(
        &mut self,
        wire: &WireSample,
        now_ns: i64,
        send: &mut Send<'_>,
    ) -> Result<Progress> {
        let sample = match self.guard.admit(wire, now_ns) {
            Ok(Message::Sample(sample)) => sample,
            Ok(Message::End) => return Ok(Progress::Ended),
            Err(_) => return Ok(Progress::Running),
        };
        let mut is_row = false;
        let pushed = self
            .estimator
            .push(&self.machine, &sample, &mut |_| is_row = true);
        let findings = self.estimator.findings();
        self.guard
            .estimated(&sample, wire.published_ns, pushed, findings);
        if is_row && sample.sensor == Sensor::Joints(0) {
            self.wire.sample_sequence = wire.sequence;
            self.wire.sample_published_ns = wire.published_ns;
            self.guard.check_row(&sample, wire.published_ns, now_ns);
            self.row(now_ns, send)?;
        }
        Ok(Progress::Running)
    }

    fn row(&mut self, now_ns: i64, send: &mut Send<'_>) -> Result<()> {
        let estimate = self.estimator.last();
        let time_ns = estimate.time_ns;
        self.row_is_valid = estimate.reasons.leave_loads();
        if self.controller.is_none()
            && let Some(posture) =
                reference_posture(&self.machine, &estimate.state, estimate.reasons)
            && let Some(suspension) = self.machine.suspension()
        {
            self.controller = Some(Controller::new(
                &self.machine,
                &suspension.control,
                &posture,
            )?);
        }
        let measured = self.rods.rods(&estimate.state).map(|rod| rod.position);
        let before_ns = self.row_ns.map_or(time_ns, |(before, _)| before);
        self.row_ns = Some((time_ns, now_ns));
        let why = self.why(now_ns);
        self.good_rows = if why.is_empty() {
            self.good_rows.saturating_add(1)
        } else {
            0
        };
        let mut reasons = why;
        reasons.note(
            HoldReason::Starting,
            why.is_empty() && self.good_rows < GOOD_ROWS,
        );
        self.wire.measured = measured;
        if reasons.is_empty() && (self.is_following() || self.is_closed()) {
            let seconds = time_ns.saturating_sub(before_ns) as f64 * 1e-9;
            self.follow(time_ns, seconds, now_ns);
        } else {
            self.hold(reasons, now_ns);
        }
        self.wire.time_ns = time_ns;
        self.wire.event = EVENT_ROW;
        self.wire.rows = self.guard.counts().rows + 1;
        self.guard.row_is_done();
        self.publish(send);
        self.note_lateness();
        Ok(())
    }

    /// One step of the stabiliser if it is due, and of the valve law.
    fn follow(&mut self, time_ns: i64, seconds: f64, now_ns: i64) {
        let Some(controller) = &mut self.controller else {
            return;
        };
        let actuators = self.wire.actuator_count as usize;
        let measured = &self.wire.measured[..actuators];
        if self.wire.mode != Mode::Follow as u32 {
            controller.reset();
            self.due_ns = time_ns;
        }
        if time_ns >= self.due_ns {
            let command = controller.tick(&self.estimator.last().state, measured);
            let step_ns = (controller.step_length() * 1e9) as i64;
            self.due_ns = self.due_ns.saturating_add(step_ns).max(time_ns - step_ns);
            self.solver_holds = command.hold;
            self.wire.status = status_number(Some(command.status));
            self.wire.cost = command.cost;
            self.wire.target = command.target;
            self.wire.iterations = command.iterations as u32;
            self.wire.evaluations = command.evaluations as u32;
        }
        self.wire.opening = controller.follow(measured, seconds);
        self.moved_ns = now_ns;
        if let Some((position, velocity)) = controller.reference() {
            self.wire.reference = position;
            self.wire.velocity = velocity;
        }
        self.wire.mode = Mode::Follow as u32;
        self.wire.reasons = 0;
        let openings = self.wire.opening.iter().zip(measured);
        for (stuck, (&opening, &rod)) in self.stuck.iter_mut().zip(openings) {
            self.is_stuck |= stuck.look(seconds, opening, rod);
        }
    }

    /// Closes the valves, no faster than the ramp.
    fn hold(&mut self, reasons: HoldReasons, now_ns: i64) {
        // whatever held this process up, no valve jumps
        let elapsed_ns = now_ns.saturating_sub(self.moved_ns).clamp(0, HEARTBEAT_NS);
        let reach = RAMP_RATE * elapsed_ns as f64 * 1e-9;
        for opening in &mut self.wire.opening {
            *opening -= opening.clamp(-reach, reach);
        }
        self.moved_ns = now_ns;
        let mode = if self.is_closed() {
            Mode::Hold
        } else {
            Mode::Ramp
        };
        self.wire.mode = mode as u32;
        self.wire.reasons = reasons.bits();
        self.wire.status = 0;
        self.wire.cost = f64::NAN;
        self.wire.target.fill(f64::NAN);
        self.wire.reference.fill(f64::NAN);
        self.wire.velocity.fill(f64::NAN);
        (self.wire.iterations, self.wire.evaluations) = (0, 0);
        self.solver_holds = false;
    }

    /// Why the valves are not to follow now.
    fn why(&self, now_ns: i64) -> HoldReasons {
        let mut why = HoldReasons::default();
        let is_timed = self.guard.is_timed();
        let came = self.row_ns.map(|(_, came_ns)| came_ns);
        let is_old = |came_ns: i64| is_timed && now_ns.saturating_sub(came_ns) > ROW_NS;
        why.note(HoldReason::NoRow, self.is_over || came.is_none_or(is_old));
        let has_state = self.row_is_valid && self.controller.is_some();
        why.note(HoldReason::RowInvalid, came.is_some() && !has_state);
        let fresh = self.verdict.filter(|v| v.valid_until_ns >= now_ns);
        why.note(HoldReason::NoVerdict, fresh.is_none());
        why.note(HoldReason::Verdict, fresh.is_some_and(|v| !v.is_fit));
        let conditions = self.guard.conditions();
        why.note(HoldReason::Input, !conditions.faults.is_empty());
        why.note(HoldReason::NoSolution, self.solver_holds);
        why.note(HoldReason::NotFollowing, self.is_stuck);
        why.note(HoldReason::Late, self.late >= MOST_LATE);
        why
    }

    /// After all messages that waited: closes the valves where something has run out since the last row, and
    /// says now and then what stands.
    pub fn tick(&mut self, now_ns: i64, send: &mut Send<'_>) {
        self.guard.check_freshness(now_ns);
        let why = self.why(now_ns);
        let was = (self.wire.mode, self.wire.reasons);
        if !why.is_empty() {
            self.good_rows = 0;
            self.hold(why, now_ns);
        }
        let is_new = was != (self.wire.mode, self.wire.reasons);
        let period_ns = if self.wire.mode == Mode::Ramp as u32 {
            RAMP_PERIOD_NS
        } else {
            HEARTBEAT_NS
        };
        if is_new || now_ns.saturating_sub(self.published_ns) >= period_ns {
            self.wire.event = EVENT_BETWEEN;
            self.publish(send);
        }
    }

    fn publish(&mut self, send: &mut Send<'_>) {
        self.published_ns = send(&mut self.wire);
    }

    fn note_lateness(&mut self) {
        let delay_ns = self
            .published_ns
            .saturating_sub(self.wire.sample_published_ns);
        let is_late = self.guard.is_timed() && delay_ns > DEADLINE_NS;
        self.late = if is_late {
            self.late.saturating_add(1)
        } else {
            0
        };
    }

    fn is_following(&self) -> bool {
        self.wire.mode == Mode::Follow as u32
    }

    fn is_closed(&self) -> bool {
        self.wire.opening.iter().all(|&opening| opening == 0.0)
    }
}

impl Stuck {
    /// Whether the rod has not moved though its valve has been open for so long, in all, that it should.
    fn look(&mut self, seconds: f64, opening: f64, rod: f64) -> bool {
        if !((rod - self.from).abs() < STILL) {
            *self = Self {
                from: rod,
                open_s: 0.0,
            };
        }
        if opening.abs() >= OPEN {
            self.open_s += seconds;
        }
        self.open_s > STILL_S
    }
}
