//! Valve commands for one session. It does not know where messages come from or go to.
//!
//! ```text
//!     samples -> guard -> estimator -> optimiser, once per step -> valve law, every row -> openings
//!     verdicts ----------------------> may valves follow? no: close them slowly and hold
//! ```
//! Valves follow only while rows are valid, the verdict is fresh, without a fault, neither unknown nor doubted, and the
//! rods obey. On any doubt the valves close at [`CLOSING_RATE`] and stay closed: with counterbalance
//! valves that holds the platform. Danger does not stop the control: that is when it helps. Nor does Assumed: nothing speaks
//! against the sensors then, and the load guard leaves every wheel at least what locked rods would leave it.
//!
//! A caution about the alarm's file is no doubt about the measurements.
//!
//! [`CLOSING_RATE`]: crate::safety_limits::CLOSING_RATE

use anyhow::{Context, Result, bail};
use tipwatch_mechanics::machine::{Proofs, SuspensionControl};
use tipwatch_mechanics::state::Sensors;
use tipwatch_mechanics::verdict::{Basis, Conditions, InputFault, Level, Verdict};
use tipwatch_mechanics::{Machine, standing_posture};
use tipwatch_suspension::{Controller, MAX_ACTUATORS, Replay, RodFault};

use super::valve_command::{Solution, ValveCommand};
use crate::guard::{CheckedEstimator, CompletedRow, Step};
use crate::safety_limits::{
    CLOSING_PERIOD_NS, GOOD_ROWS, HEARTBEAT_NS, MAX_ROW_AGE_NS, PERSISTENT_LATE,
};
use crate::wire::command::{HoldReason, HoldReasons, Mode};
use crate::wire::sample::SampleCounts;
use crate::wire::session::{Progress, Session};
use crate::wire::topics::{EVENT_BETWEEN, EVENT_ROW, Wire, WireCommand, WireSample, WireVerdict};

/// Follows one session. After the first valid row nothing allocates.
#[derive(Debug)]
pub struct Control {
    session: u64,
    machine_hash: u64,
    machine: Machine,
    input: CheckedEstimator,
    rods: Replay,
    settings: SuspensionControl,
    controller: Option<Controller>,
    verdict: Option<SeenVerdict>,
    /// Time of the last row, and when it was received (ns).
    row_ns: Option<(i64, i64)>,
    row_is_valid: bool,
    steps: StepClock,
    good_rows: u32,
    /// Consecutive rows with late commands.
    late_rows: u32,
    solver_holds: bool,
    is_outside_stroke: bool,
    /// A rod that does not obey its valve, until somebody acknowledges.
    rod_fault: Option<RodFault>,
    is_over: bool,
    valves: ValveCommand,
    published_ns: i64,
    /// The message to publish. Nothing is read back from it.
    message: WireCommand,
}

/// Part of a verdict that the control needs.
#[derive(Debug, Clone, Copy)]
struct SeenVerdict {
    permits_motion: bool,
    valid_until_ns: i64,
}

/// Seals and publishes a command; returns its publication time (ns).
pub type Publish<'a> = dyn FnMut(&mut WireCommand) -> i64 + 'a;

impl Control {
    /// A control that has seen nothing. `now_ns` is the time of CLOCK_MONOTONIC, here and everywhere.
    ///
    /// # Errors
    /// The machine has no active suspension.
    pub fn new(
        machine: Machine,
        sensors: &Sensors,
        session: &Session,
        now_ns: i64,
    ) -> Result<Self> {
        if let Some(which) = machine.supports().not_constant() {
            bail!(
                "{which}: expected supports that are always on the ground for the control of a suspension, found one that comes and goes or whose load is measured"
            );
        }
        let rods = Replay::new(&machine)?;
        let suspension = machine.suspension().context("expected [suspension]")?;
        let mut message = WireCommand::closed();
        message.session = session.id;
        message.actuator_count = rods.actuators() as u32;
        Ok(Self {
            session: session.id,
            machine_hash: session.machine_hash,
            input: CheckedEstimator::new(session, &machine, sensors, now_ns),
            settings: suspension.control.clone(),
            machine,
            rods,
            controller: None,
            verdict: None,
            row_ns: None,
            row_is_valid: false,
            steps: StepClock::default(),
            good_rows: 0,
            late_rows: 0,
            solver_holds: false,
            is_outside_stroke: false,
            rod_fault: None,
            is_over: false,
            valves: ValveCommand::closed(now_ns),
            published_ns: i64::MIN,
            message,
        })
    }

    /// Returns the counts of the samples so far.
    #[must_use]
    pub fn counts(&self) -> SampleCounts {
        self.input.guard.counts()
    }

    /// The session that it follows.
    #[must_use]
    pub fn session(&self) -> u64 {
        self.session
    }

    /// An operator has acknowledged that a rod does not follow. Each must prove its direction again.
    pub fn acknowledge(&mut self) {
        self.rod_fault = None;
        self.controller.iter_mut().for_each(Controller::trust_rods);
    }

    /// Takes over from the control of the session before: valves go on from where they are.
    pub fn succeed(&mut self, before: &Self) {
        self.valves.opening = before.valves.opening;
        self.valves.moved_ns = before.valves.moved_ns;
        self.rod_fault = before.rod_fault;
    }

    /// No more samples come: the valves close.
    pub fn end(&mut self) {
        self.is_over = true;
    }

    /// Whether the control was ended and the valves are closed.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.is_over && self.valves.is_closed()
    }

    /// Takes a verdict. A damaged one, or one of another session or machine, is ignored.
    pub fn verdict(&mut self, wire: &WireVerdict) {
        let is_ours = wire.session == self.session && wire.machine_hash == self.machine_hash;
        if !wire.is_whole() || !is_ours {
            return;
        }
        // somebody trusts these signals as they are now: the verdicts on the rows that follow do, too
        self.input
            .trust(Proofs::from_bits(wire.acknowledged_signals));
        let verdict = wire.verdict();
        let is_known = !matches!(verdict.level, Level::Unknown | Level::Fault);
        // Danger outranks faults of values and an unknown ground in the level, but valves do not move by them.
        let has_faults = !verdict.held.faults.is_empty();
        let is_ground_known = wire.ground_gap().is_none();
        self.verdict = Some(SeenVerdict {
            permits_motion: is_known
                && is_ground_known
                && !has_faults
                && !is_doubted(&verdict)
                && verdict.latched_level != Level::Fault,
            valid_until_ns: wire.valid_until_ns,
        });
        self.message.verdict_sequence = wire.sequence;
        self.message.level = wire.level;
    }

    /// Takes a message; `publish` is called with the command on the row that it completes.
    ///
    /// # Errors
    /// The suspension cannot be controlled from the posture of the first row.
    pub fn take(
        &mut self,
        wire: &WireSample,
        now_ns: i64,
        publish: &mut Publish<'_>,
    ) -> Result<Progress> {
        match self.input.take(&self.machine, wire, now_ns) {
            Step::Pending => {}
            Step::Row(row) => self.row(&row, now_ns, publish)?,
            Step::Ended => return Ok(Progress::Ended),
        }
        Ok(Progress::Running)
    }

    fn row(&mut self, row: &CompletedRow, now_ns: i64, publish: &mut Publish<'_>) -> Result<()> {
        let estimate = self.input.estimate();
        let time_ns = estimate.time_ns;
        // Valves move by measured rods, not by bridged ones, and by signals that nothing contradicts.
        self.row_is_valid = estimate.reasons.is_empty() && row.joints_are_measured;
        if self.controller.is_none()
            && let Some(posture) =
                standing_posture(&self.machine, &estimate.state, estimate.reasons)
        {
            let controller = Controller::new(&self.machine, &self.settings, &posture)?;
            self.controller = Some(controller);
        }
        let measured = self.rods.rods(&estimate.state).map(|rod| rod.position);
        let actuators = self.rods.actuators();
        let is_outside = |controller: &Controller| !controller.is_plausible(&measured[..actuators]);
        self.is_outside_stroke = self.controller.as_ref().is_some_and(is_outside);
        let before_ns = self.row_ns.map_or(time_ns, |(before, _)| before);
        self.row_ns = Some((time_ns, now_ns));
        let mut reasons = self.hold_reasons(row.conditions, now_ns);
        let is_good = reasons.is_empty();
        self.good_rows = if is_good {
            self.good_rows.saturating_add(1)
        } else {
            0
        };
        reasons.note(HoldReason::Starting, is_good && self.good_rows < GOOD_ROWS);
        let may_follow = self.valves.mode == Mode::Follow || self.valves.is_closed();
        if reasons.is_empty() && may_follow {
            let seconds = time_ns.saturating_sub(before_ns) as f64 * 1e-9;
            self.follow(&measured, time_ns, seconds, now_ns);
        } else {
            self.close(reasons, now_ns);
        }
        self.message.measured = measured;
        self.message.sample_sequence = row.sample_sequence;
        self.message.sample_published_ns = row.sample_published_ns;
        self.message.time_ns = time_ns;
        self.message.rows = self.counts().rows;
        self.message.event = EVENT_ROW;
        self.publish(publish);
        let guard = &self.input.guard;
        let is_late = guard.is_late(row.sample_published_ns, self.published_ns);
        self.late_rows = if is_late {
            self.late_rows.saturating_add(1)
        } else {
            0
        };
        Ok(())
    }

    /// Makes a step of the optimiser if one is due, and a step of the valve law.
    fn follow(&mut self, measured: &[f64; MAX_ACTUATORS], time_ns: i64, seconds: f64, now_ns: i64) {
        let Some(controller) = &mut self.controller else {
            return;
        };
        let measured = &measured[..self.rods.actuators()];
        let valves = &mut self.valves;
        if valves.mode != Mode::Follow {
            controller.reset();
            self.steps.restart(time_ns);
        }
        if self.steps.is_due(time_ns, controller.step_length()) {
            let command = controller.tick(&self.input.estimate().state, measured);
            self.solver_holds = command.hold;
            valves.solution = Solution {
                status: Some(command.status),
                cost: command.cost,
                target: command.target,
                iterations: command.iterations,
                evaluations: command.evaluations,
            };
        }
        let forces = self.rods.rod_forces(&self.input.estimate().state);
        valves.opening = controller.follow_loaded(measured, &forces, seconds);
        valves.moved_ns = now_ns;
        if let Some((position, velocity)) = controller.reference() {
            valves.reference = position;
            valves.velocity = velocity;
        }
        valves.mode = Mode::Follow;
        valves.reasons = HoldReasons::default();
        let fault = controller.rod_fault().map(|(_, fault)| fault);
        self.rod_fault = self.rod_fault.or(fault);
    }

    fn close(&mut self, reasons: HoldReasons, now_ns: i64) {
        self.valves.close(reasons, now_ns);
        self.solver_holds = false;
    }

    /// Returns the reasons for which the valves must not follow now; empty if they may follow.
    fn hold_reasons(&self, conditions: Conditions, now_ns: i64) -> HoldReasons {
        let mut reasons = HoldReasons::default();
        let received = self.row_ns.map(|(_, received_ns)| received_ns);
        let is_timed = self.input.guard.is_timed();
        let is_old = |at_ns: i64| is_timed && now_ns.saturating_sub(at_ns) > MAX_ROW_AGE_NS;
        reasons.note(
            HoldReason::NoRow,
            self.is_over || received.is_none_or(is_old),
        );
        let has_state = self.row_is_valid && self.controller.is_some();
        reasons.note(HoldReason::RowInvalid, received.is_some() && !has_state);
        let fresh = self.verdict.filter(|v| v.valid_until_ns >= now_ns);
        reasons.note(HoldReason::NoVerdict, fresh.is_none());
        reasons.note(
            HoldReason::Verdict,
            fresh.is_some_and(|v| !v.permits_motion),
        );
        reasons.note(HoldReason::Input, !conditions.faults.is_empty());
        reasons.note(HoldReason::NoSolution, self.solver_holds);
        let has = |fault: RodFault| self.rod_fault == Some(fault);
        reasons.note(HoldReason::NotFollowing, has(RodFault::Still));
        reasons.note(HoldReason::WrongWay, has(RodFault::WrongWay));
        reasons.note(HoldReason::OutsideStroke, self.is_outside_stroke);
        reasons.note(HoldReason::Late, self.late_rows >= PERSISTENT_LATE);
        reasons
    }

    /// Ends a cycle, after all messages that waited: closes the valves if something has expired since the
    /// last row, and publishes a changed command at once, any other from time to time.
    pub fn tick(&mut self, now_ns: i64, publish: &mut Publish<'_>) {
        let conditions = self.input.guard.between_rows(now_ns);
        let reasons = self.hold_reasons(conditions, now_ns);
        let before = (self.valves.mode, self.valves.reasons);
        if !reasons.is_empty() {
            self.good_rows = 0;
            self.close(reasons, now_ns);
        }
        let is_new = before != (self.valves.mode, self.valves.reasons);
        let period_ns = match self.valves.mode {
            Mode::Ramp => CLOSING_PERIOD_NS,
            Mode::Hold | Mode::Follow => HEARTBEAT_NS,
        };
        if is_new || now_ns.saturating_sub(self.published_ns) >= period_ns {
            self.message.event = EVENT_BETWEEN;
            self.publish(publish);
        }
    }

    fn publish(&mut self, publish: &mut Publish<'_>) {
        self.valves.write_to(&mut self.message);
        self.published_ns = publish(&mut self.message);
    }
}

/// Whether the verdict doubts the sensors by which the valves would move. A caution about the alarm's file alone is no such
/// doubt.
fn is_doubted(verdict: &Verdict) -> bool {
    let held = verdict.held;
    let mut cautions = held.cautions.iter();
    let is_of_the_file = !held.cautions.is_empty()
        && cautions.all(|caution| caution == InputFault::AlarmUnsaved)
        && held.reasons.is_empty();
    verdict.basis == Basis::Doubted && !is_of_the_file
}

/// Steps of equal length in the time of rows, which do not come in step with it.
#[derive(Debug, Clone, Copy, Default)]
struct StepClock {
    /// Time of the row at which the next step is due (ns).
    due_ns: i64,
}

impl StepClock {
    /// The next step is due with this row.
    fn restart(&mut self, time_ns: i64) {
        self.due_ns = time_ns;
    }

    /// Whether a step of this length (s) is due with this row. A late row does not delay the steps after it; of many
    /// missed steps two are made up for.
    fn is_due(&mut self, time_ns: i64, length_s: f64) -> bool {
        if time_ns < self.due_ns {
            return false;
        }
        let length_ns = (length_s * 1e9) as i64;
        let earliest_ns = time_ns.saturating_sub(length_ns);
        self.due_ns = self.due_ns.saturating_add(length_ns).max(earliest_ns);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rows (ms) with which a step of 20 ms is due.
    fn due(rows_ms: &[i64]) -> Vec<i64> {
        let mut clock = StepClock::default();
        clock.restart(rows_ms[0] * 1_000_000);
        let is_due = |ms: &i64| clock.is_due(ms * 1_000_000, 0.02);
        rows_ms.iter().copied().filter(is_due).collect()
    }

    #[test]
    fn steps_keep_their_length_whenever_rows_come() {
        assert_eq!(due(&[0, 10, 20, 30, 40, 50]), [0, 20, 40]);
        assert_eq!(due(&[0, 19, 21, 39, 40, 59]), [0, 21, 40]);
        // from the row that it was started with
        assert_eq!(due(&[1000, 1001, 1002, 1019, 1020]), [1000, 1020]);
        // rows slower than the steps
        assert_eq!(due(&[0, 40, 80, 120]), [0, 40, 80, 120]);
    }

    #[test]
    fn two_missed_steps_are_made_up_for() {
        let after_a_gap = [0, 80, 81, 82, 83, 100, 101];
        assert_eq!(due(&after_a_gap), [0, 80, 81, 82, 100]);
    }
}
