//! Verdicts on one session. It does not know where messages come from or go to.

use tipwatch_mechanics::Machine;
use tipwatch_mechanics::estimation::plausibility::{
    Excitation, Inherited, KnownPosition, SignalDoubt,
};
use tipwatch_mechanics::estimation::support_configuration::GroundGap;
use tipwatch_mechanics::geometry::coordinate::Motion;
use tipwatch_mechanics::machine::{Commissioned, Proof, Proofs, SessionProofs};
use tipwatch_mechanics::prediction::PacedPredictor;
use tipwatch_mechanics::state::Sensors;
use tipwatch_mechanics::studies::measured_forces::ForceWatch;
use tipwatch_mechanics::studies::measured_loads::LoadWatch;
use tipwatch_mechanics::studies::needed_proofs::NeededProofs;
use tipwatch_mechanics::verdict::{Conditions, InputFault, Judge, Latch, RowFacts, Verdict};

use super::ground::Ground;
use crate::guard::{CheckedEstimator, CompletedRow, Step};
use crate::safety_limits::{HEARTBEAT_NS, PERSISTENT_LATE};
use crate::wire::sample::SampleCounts;
use crate::wire::session::{Progress, Session};
use crate::wire::topics::{ALARM_BEGINS, EVENT_BETWEEN, WireSample, WireVerdict};

/// Follows one session. Nothing allocates but a change to other supports, and the comparison of measured loads and forces.
#[derive(Debug)]
pub struct Monitor {
    session: u64,
    is_replay: bool,
    machine: Machine,
    input: CheckedEstimator,
    ground: Ground,
    /// `None` for a machine whose loads are not measured.
    loads: Option<LoadWatch>,
    /// `None` for a machine without measured forces of the arm by which nothing is computed.
    forces: Option<ForceWatch>,
    judge: Judge,
    predictor: PacedPredictor,
    /// Excitation by the motion of the session: the sensor errors that it would have shown.
    excitation: Excitation,
    /// Proofs that the loads depend on, and those that a commissioning has given.
    needed: NeededProofs,
    commissioned: Commissioned,
    /// The joints and the signals of an IMU that this session measures.
    measured: Proofs,
    is_acknowledged: bool,
    /// The signals that were acknowledged since the last row, and those that are not trusted in spite of it.
    trusted: Proofs,
    not_trusted: Proofs,
    /// Number of alarms raised up to the last verdict published.
    alarms: u64,
    timeliness: Timeliness,
    /// Consecutive cycles with late verdicts.
    late_cycles: u32,
    /// The last verdict published, and when (ns).
    published: Verdict,
    published_ns: i64,
    /// The message to publish: the numbers of the last row are repeated between rows. Nothing is read
    /// back from it.
    message: WireVerdict,
}

/// Seals and publishes a verdict; returns its publication time (ns).
pub type Publish<'a> = dyn FnMut(&mut WireVerdict) -> i64 + 'a;

/// Verdicts on rows since the last tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Timeliness {
    NoRow,
    InTime,
    Late,
}

impl Monitor {
    /// A monitor that has seen nothing. `now_ns` is the time of CLOCK_MONOTONIC, here and everywhere.
    #[must_use]
    pub fn new(machine: Machine, sensors: &Sensors, session: &Session, now_ns: i64) -> Self {
        let input = CheckedEstimator::new(session, &machine, sensors, now_ns);
        let mut message = WireVerdict::unknown();
        message.session = session.id;
        message.untimed = u32::from(!input.guard.is_timed());
        Self {
            needed: machine.needed_proofs(sensors),
            commissioned: Commissioned::NONE,
            session: session.id,
            is_replay: session.total_samples != 0,
            ground: Ground::new(&machine, &mut message),
            loads: LoadWatch::new(&machine),
            forces: ForceWatch::new(&machine),
            judge: Judge::new(machine.limits()),
            predictor: PacedPredictor::new(&machine),
            excitation: Excitation::new(&machine),
            input,
            machine,
            measured: measured(sensors),
            is_acknowledged: false,
            trusted: Proofs::NONE,
            not_trusted: Proofs::NONE,
            alarms: 0,
            timeliness: Timeliness::NoRow,
            late_cycles: 0,
            published: Verdict::default(),
            published_ns: i64::MIN,
            message,
        }
    }

    /// A commissioning has proven this.
    #[must_use]
    pub fn commissioned(mut self, proven: Commissioned) -> Self {
        self.commissioned = proven;
        self
    }

    /// Returns the proofs that a commissioning has given, with the joint positions for which they hold.
    #[must_use]
    pub fn commissioning(&self) -> &Commissioned {
        &self.commissioned
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

    /// The machine.
    #[must_use]
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// The last verdict published.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.published
    }

    /// States which errors of sensors the motion of the session would not have shown; `None` if there are none.
    #[must_use]
    pub fn untested(&self) -> Option<String> {
        self.excitation.statement(&self.machine, "this session")
    }

    /// The latched alarm.
    #[must_use]
    pub fn latch(&self) -> Latch {
        let mut latch = self.judge.latch();
        if self.is_acknowledged {
            latch.acknowledge();
        }
        latch
    }

    /// Takes over a latched alarm before the first row: from the session before, or from the disk.
    pub fn resume(&mut self, latch: Latch) {
        self.judge.resume(latch);
        self.message.inherited_alarm = latch.level.map_or(0, |level| level as u32);
        self.message.inherited_acknowledged = latch.is_acknowledged.into();
    }

    /// Whether the mounting, a sign, the order or a scale of a sensor was contradicted in this session.
    #[must_use]
    pub fn has_found_contradiction(&self) -> bool {
        self.input.plausibility().has_found_contradiction()
    }

    /// Notes that a sensor was contradicted in a session before, and that the machine was not commissioned since.
    pub fn remember_contradiction(&mut self) {
        self.input.remember_contradiction();
        self.message.inherited_contradiction = 1;
    }

    /// The signals that are doubted since they failed visibly, in this session or before.
    pub fn doubts(&self) -> impl Iterator<Item = SignalDoubt> {
        self.input.doubts()
    }

    /// Takes over doubts and positions from a session before: those signals are doubted from the first sample on.
    pub fn inherit(&mut self, from: &Inherited) {
        self.input.inherit(from);
    }

    /// Returns the known positions of the joints, see [`CheckedEstimator::known_positions`].
    pub fn known_positions(&self) -> impl Iterator<Item = (i64, KnownPosition)> {
        self.input.known_positions()
    }

    /// Whether the session replays a log: its number of samples is known.
    #[must_use]
    pub fn is_replay(&self) -> bool {
        self.is_replay
    }

    /// The joints and the signals of an IMU that this session measures.
    #[must_use]
    pub fn measured(&self) -> Proofs {
        self.measured
    }

    /// An operator trusts these signals as they are now.
    pub fn trust(&mut self, signals: Proofs) {
        self.trusted = self.trusted.with(signals);
    }

    /// The signals that somebody has acknowledged since this was asked last, and that stay doubted in spite of it: they still repeat
    /// one value.
    pub fn take_not_trusted(&mut self) -> Proofs {
        std::mem::replace(&mut self.not_trusted, Proofs::NONE)
    }

    /// An operator has acknowledged the latched alarm.
    pub fn acknowledge(&mut self) {
        self.is_acknowledged = true;
    }

    /// Adds a caution that only the program can find.
    pub fn caution(&mut self, fault: InputFault) {
        self.input.guard.caution(fault);
    }

    /// Adds a fault that only the reader of the shared memory can find.
    pub fn note(&mut self, fault: InputFault) {
        self.input.guard.note(fault);
    }

    /// Takes a message; `publish` is called with the verdict on the row that it completes.
    pub fn take(&mut self, wire: &WireSample, now_ns: i64, publish: &mut Publish<'_>) -> Progress {
        match self.input.take(&self.machine, wire, now_ns) {
            Step::Pending => {}
            Step::Row(row) => self.row(&row, publish),
            Step::Ended => return Progress::Ended,
        }
        Progress::Running
    }

    fn row(&mut self, row: &CompletedRow, publish: &mut Publish<'_>) {
        let stands_on = self.input.estimate().stands_on;
        (self.ground).follow(&self.machine, stands_on, &mut self.message);
        if let Some(loads) = &mut self.loads {
            loads.row(&self.machine, self.input.estimate_mut());
            self.message.set_load_doubt(loads.doubt());
        }
        if let Some(forces) = &mut self.forces {
            forces.row(&self.machine, self.input.estimate_mut());
            self.message.set_force_doubt(forces.doubt());
        }
        let estimate = self.input.estimate();
        let time_ns = estimate.time_ns;
        let unproven = self.unproven(estimate.shown, &estimate.state.joints);
        let loads = (self.ground).row(time_ns, &estimate.state, estimate.reasons);
        let (outcome, reasons) = (loads.outcome, loads.reasons);
        let utilisation = outcome.map_or(f64::NAN, |outcome| outcome.uncertainty.utilisation);
        if !estimate.reasons.leave_state_unknown() {
            self.excitation.take(time_ns, &estimate.state);
        }
        let is_acknowledged = std::mem::take(&mut self.is_acknowledged);
        let verdict = self.judge.row(&RowFacts {
            time_ns,
            reasons,
            utilisation,
            is_wheel_unloaded: outcome.is_some_and(|of| of.otf.iter().any(|otf| *otf <= 0.0)),
            rotates: estimate.rotates,
            takes_support: stands_on == Some(Err(GroundGap::Taken)),
            unproven,
            conditions: row.conditions,
            is_acknowledged,
        });
        let next = loads.next.filter(|_| verdict.level.announces_lift_off());
        self.message.acknowledged = is_acknowledged.into();
        self.message.sample_sequence = row.sample_sequence;
        self.message.sample_published_ns = row.sample_published_ns;
        self.message
            .set_row(time_ns, reasons, outcome, utilisation, next);
        let state = &estimate.state;
        self.message.set_payloads(&self.machine, state);
        let level = verdict.level;
        self.predictor.set_commands(&estimate.commands);
        self.message.set_commanded(&estimate.commands);
        let prediction = (self.predictor).row(&self.machine, time_ns, state, reasons, level);
        self.message.set_prediction(prediction);
        // from the next sample on, as offline
        let acknowledged = std::mem::replace(&mut self.trusted, Proofs::NONE);
        let trusted = self.input.trust(acknowledged);
        self.message.acknowledged_signals = trusted.bits();
        self.not_trusted = self.not_trusted.with(acknowledged.without(trusted));
        self.publish(verdict, row.conditions, publish);
        let guard = &self.input.guard;
        self.timeliness = self.timeliness.max(
            if guard.is_late(row.sample_published_ns, self.published_ns) {
                Timeliness::Late
            } else {
                Timeliness::InTime
            },
        );
    }

    /// Returns the proofs that the loads depend on and that are still missing. Joints that share a place all count as unproven:
    /// it is not known which of them was proven.
    fn unproven(&self, shown: SessionProofs, joints: &[Motion<f64>]) -> Proofs {
        let shared = of_shared_places(self.machine.joints().len());
        let needed = self.needed.on(self.ground.stands_on());
        let unproven = shown.unproven(needed, self.commissioned.at(joints));
        unproven.with(needed.shared_with(shared))
    }

    /// Ends a cycle, after all samples that waited: publishes a verdict that has become worse, and at least
    /// every [`HEARTBEAT_NS`] the last one again.
    pub fn tick(&mut self, now_ns: i64, publish: &mut Publish<'_>) {
        self.end_cycle();
        let conditions = self.input.guard.between_rows(now_ns);
        let verdict = self
            .judge
            .between_rows(conditions, self.input.rotates(now_ns));
        let is_due = now_ns.saturating_sub(self.published_ns) >= HEARTBEAT_NS;
        if verdict != self.published || is_due {
            self.message.event = EVENT_BETWEEN;
            self.publish(verdict, conditions, publish);
        }
    }

    fn publish(&mut self, verdict: Verdict, conditions: Conditions, publish: &mut Publish<'_>) {
        let counts = self.counts();
        self.message.set_verdict(verdict, conditions, counts);
        self.message.set_alarm(self.latch());
        let doubted: Proofs = self.doubts().map(|doubt| doubt.signal).collect();
        self.message.doubted = doubted.bits();
        if std::mem::replace(&mut self.alarms, self.judge.alarms()) != self.judge.alarms() {
            self.message.alarm_sequence = ALARM_BEGINS;
        }
        self.published = verdict;
        self.published_ns = publish(&mut self.message);
    }

    /// Late verdicts of one cycle have one cause and count once.
    fn end_cycle(&mut self) {
        match std::mem::replace(&mut self.timeliness, Timeliness::NoRow) {
            Timeliness::NoRow => {}
            Timeliness::InTime => self.late_cycles = 0,
            Timeliness::Late => self.late_cycles += 1,
        }
        if self.late_cycles >= PERSISTENT_LATE {
            self.note(InputFault::VerdictLate);
        }
    }
}

/// The joints of a machine with so many of them that share one place in sets of proofs: none of them counts as proven.
pub(super) fn of_shared_places(joints: usize) -> Proofs {
    let last = joints.checked_sub(1).map(Proof::Joint);
    let before = joints.checked_sub(2).map(Proof::Joint);
    let is_shared = last.map(Proof::place) == before.map(Proof::place);
    last.filter(|_| is_shared).into_iter().collect()
}

/// The joints and the signals of an IMU that the sensors of a session measure.
pub(super) fn measured(sensors: &Sensors) -> Proofs {
    let joints = sensors.joints.iter().flat_map(|stream| &stream.joints);
    let joints = joints.map(|&joint| Proof::Joint(joint));
    let of_imu = Proof::OF_IMU.into_iter().filter(|_| sensors.imu);
    joints.chain(of_imu).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    // requirement: TW-VERDICT-28
    #[test]
    fn joints_that_share_a_place_are_found() {
        let places = 56;
        assert!((0..=places).all(|joints| of_shared_places(joints).is_empty()));
        let shared = of_shared_places(places + 1);
        assert!(shared.has(Proof::Joint(places)) && shared.has(Proof::Joint(places - 1)));
        assert!(!shared.has(Proof::Joint(places - 2)));
    }
}
