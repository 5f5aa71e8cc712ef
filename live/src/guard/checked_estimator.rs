//! The state estimator behind the guard: the one place that takes the guard's steps, in their order.

use tipwatch_mechanics::Machine;
use tipwatch_mechanics::estimation::plausibility::{
    Inherited, KnownPosition, Plausibility, SignalDoubt,
};
use tipwatch_mechanics::estimation::{CausalEstimator, Estimate, RowClock};
use tipwatch_mechanics::machine::Proofs;
use tipwatch_mechanics::state::{SampleError, Sensor, Sensors};
use tipwatch_mechanics::studies::payload_watch::PayloadWatch;
use tipwatch_mechanics::verdict::Conditions;

use super::checks::{Admitted, Guard};
use crate::wire::session::Session;
use crate::wire::topics::WireSample;

/// Estimates the machine's state from the checked samples of one session.
#[derive(Debug)]
pub struct CheckedEstimator {
    /// The checks.
    pub guard: Guard,
    estimator: CausalEstimator,
    payloads: PayloadWatch,
    /// Whether a position or velocity of a joint was not finite since the row before.
    joints_lack_a_value: bool,
}

/// Result of taking a message.
#[derive(Debug, Clone, Copy)]
#[must_use]
pub enum Step {
    /// No row yet, or the message was refused.
    Pending,
    /// The message completed a row: [`CheckedEstimator::estimate`] is its state.
    Row(CompletedRow),
    /// The session is over.
    Ended,
}

/// A row, but for its state.
#[derive(Debug, Clone, Copy)]
pub struct CompletedRow {
    /// Problems of the input since the row before.
    pub conditions: Conditions,
    /// Sequence number of the sample that completed it.
    pub sample_sequence: u64,
    /// Publication time of that sample (ns).
    pub sample_published_ns: i64,
    /// Whether every sample of the joints since the row before had all its values: the state bridges missing values.
    pub joints_are_measured: bool,
}

impl CheckedEstimator {
    /// An estimator that has seen nothing.
    #[must_use]
    pub fn new(session: &Session, machine: &Machine, sensors: &Sensors, now_ns: i64) -> Self {
        Self {
            guard: Guard::new(session, machine, sensors, now_ns),
            estimator: CausalEstimator::new(machine, sensors, RowClock::JointStates),
            payloads: PayloadWatch::new(machine),
            joints_lack_a_value: false,
        }
    }

    /// The state of the last row.
    #[must_use]
    pub fn estimate(&self) -> &Estimate {
        self.estimator.last()
    }

    /// Returns the state of the last row, for additions by others.
    pub fn estimate_mut(&mut self) -> &mut Estimate {
        self.estimator.last_mut()
    }

    /// Whether the platform falls, by gyro and attitude alone, as far as they are still measured.
    #[must_use]
    pub fn rotates(&self, now_ns: i64) -> bool {
        (self.guard.stamp_ns(now_ns)).is_some_and(|stamp_ns| self.estimator.falls(stamp_ns))
    }

    /// The checks of the samples so far.
    #[must_use]
    pub fn plausibility(&self) -> &Plausibility {
        self.estimator.plausibility()
    }

    /// The signals that are doubted since they failed visibly, in this session or before.
    pub fn doubts(&self) -> impl Iterator<Item = SignalDoubt> {
        self.estimator.doubts()
    }

    /// Notes that the mounting, a sign, the order or a scale of a sensor was contradicted in a session before.
    pub fn remember_contradiction(&mut self) {
        self.estimator.remember_contradiction();
    }

    /// Takes over doubts and positions from a session before.
    pub fn inherit(&mut self, from: &Inherited) {
        self.estimator.inherit(from);
    }

    /// Returns the known positions of the joints, each with the time of its measurement (ns), by CLOCK_MONOTONIC; none in an
    /// untimed session.
    pub fn known_positions(&self) -> impl Iterator<Item = (i64, KnownPosition)> {
        self.plausibility().known_positions().filter_map(|at| {
            let measured_ns = self.guard.measured_ns(at.stamp_ns)?;
            Some((measured_ns, at))
        })
    }

    /// A person trusts these signals as they are now. Returns those that are trusted.
    pub fn trust(&mut self, signals: Proofs) -> Proofs {
        self.estimator.trust(signals)
    }

    /// Takes a message.
    pub fn take(&mut self, machine: &Machine, wire: &WireSample, now_ns: i64) -> Step {
        let admitted = match self.guard.admit(wire, now_ns) {
            Ok(Admitted::Sample(sample)) => sample,
            Ok(Admitted::End) => return Step::Ended,
            Err(_) => return Step::Pending,
        };
        let is_of_joints = matches!(admitted.sample().sensor, Sensor::Joints(_));
        let mut is_row = false;
        let pushed = self
            .estimator
            .push(machine, admitted.sample(), &mut |_| is_row = true);
        self.joints_lack_a_value |= is_of_joints && pushed == Err(SampleError::NotFinite);
        let findings = self.estimator.findings();
        let assessed = self.guard.assess(admitted, pushed, findings);
        if !is_row {
            return Step::Pending;
        }
        self.payloads.row(machine, self.estimator.last_mut());
        Step::Row(CompletedRow {
            conditions: self.guard.complete_row(assessed),
            sample_sequence: wire.sequence,
            sample_published_ns: wire.published_ns,
            joints_are_measured: !std::mem::take(&mut self.joints_lack_a_value),
        })
    }
}
