//! All checks of every sensor, sample by sample.

use super::explanation::Explanation;
use super::fault::{Finding, Part};
use super::notice::{Note, Rules};
use super::relations::Relations;
use super::signal_doubt::{Inherited, KnownPosition, SignalDoubt};
use super::signals::SignalChecks;
use super::treatment::{Judgement, RowEffect};
use super::weight::WeightWatch;
use crate::machine::{FaultKind, Machine, Policy, Proof, Proofs, SessionProofs};
use crate::state::{Sample, SampleError, Sensor, Sensors};

/// Checks samples, each sensor's in stamp order.
#[derive(Debug, Clone)]
pub struct Plausibility {
    signals: SignalChecks,
    relations: Relations,
    weight: WeightWatch,
    rules: Rules,
    has_imu: bool,
    findings: Vec<Finding>,
    /// Signals that a person trusts, and those that the motion had proven before the person trusted them.
    trusted: Proofs,
    proven_before_trust: Proofs,
    /// Whether a lasting contradiction was found in the samples taken, and whether one is remembered from an earlier session.
    has_found_contradiction: bool,
    remembers_contradiction: bool,
}

impl Plausibility {
    /// Checks before their first sample.
    #[must_use]
    pub fn new(machine: &Machine, sensors: &Sensors) -> Self {
        Self {
            signals: SignalChecks::new(machine, sensors),
            relations: Relations::new(machine, sensors),
            weight: WeightWatch::new(machine.gravity()),
            rules: Rules::of(machine),
            has_imu: sensors.imu,
            findings: room_for_findings(sensors),
            trusted: Proofs::NONE,
            proven_before_trust: Proofs::NONE,
            has_found_contradiction: false,
            remembers_contradiction: false,
        }
    }

    /// The faults of the last sample.
    #[must_use]
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// Whether the mounting, a sign, the order or a scale was ever contradicted: a fault of that kind does not heal by itself.
    #[must_use]
    pub fn is_contradicted(&self) -> bool {
        self.has_found_contradiction || self.remembers_contradiction
    }

    /// Whether the samples taken have contradicted the mounting, a sign, the order or a scale.
    #[must_use]
    pub fn has_found_contradiction(&self) -> bool {
        self.has_found_contradiction
    }

    /// Remembers a contradiction that was found in an earlier session.
    pub fn remember_contradiction(&mut self) {
        self.remembers_contradiction = true;
    }

    /// The signals that are doubted since they failed visibly, in this session or before, unless the machine file wants such
    /// faults reported only. A joint whose standstill the lean has contradicted has that doubt beside another one.
    pub fn doubts(&self) -> impl Iterator<Item = SignalDoubt> {
        let counts = |kind: FaultKind| self.rules.policies[kind as usize] != Policy::Report;
        let length = (self.weight.beyond()).map(SignalDoubt::of_length);
        // a joint that jumps again, or stops, stays doubted by what is known
        let is_known = |doubt: &SignalDoubt| {
            let mut offsets = self.relations.offsets();
            offsets.any(|offset| offset.signal == doubt.signal)
        };
        let frozen = self.signals.frozen();
        let is_frozen = |jump: &SignalDoubt| {
            let mut frozen = self.signals.frozen();
            frozen.any(|doubt| doubt.signal == jump.signal)
        };
        let jumps = self.signals.jumps().filter(move |jump| !is_frozen(jump));
        let more = frozen.chain(jumps).filter(move |doubt| !is_known(doubt));
        // what else it does, and whether that ends, says nothing of its zero
        let once = self.relations.had_stopped();
        let joints = self.relations.offsets().chain(more).chain(once);
        let joints = joints.filter(move |doubt| match doubt.is_frozen() {
            true => counts(FaultKind::Frozen),
            false => counts(FaultKind::Contradiction),
        });
        let of_imu = [self.relations.force_step(), self.signals.turned()];
        let of_imu = of_imu.into_iter().flatten();
        let of_imu = of_imu.filter(move |_| counts(FaultKind::Contradiction));
        let length = length.filter(|_| counts(FaultKind::OutOfRange));
        joints.chain(of_imu).chain(length)
    }

    /// Takes over from an earlier session, before the first sample, which signals failed visibly and where the joints were. A joint
    /// that cannot have moved from there to its first position is off.
    pub fn inherit(&mut self, from: &Inherited) {
        for doubt in &from.doubts {
            self.remember_doubt(doubt);
        }
        for at in &from.positions {
            self.signals.remember_position(at);
        }
    }

    fn remember_doubt(&mut self, doubt: &SignalDoubt) {
        match doubt.signal {
            // who knows what is asked remembers that
            Proof::Joint(_) if doubt.disobeys() => {}
            Proof::Joint(joint) if doubt.has_stopped_once() => {
                self.relations.remember_stopped(joint);
            }
            Proof::Joint(joint) if doubt.is_frozen() => {
                self.signals.remember_frozen(joint, doubt.moved);
            }
            Proof::Joint(joint) => self.relations.remember_offset(joint, doubt.by, doubt.moved),
            Proof::SpecificForce if doubt.is_of_length() => self.weight.remember(doubt.by),
            Proof::SpecificForce => self.relations.remember_force_step(doubt.by),
            Proof::AngularVelocity => self.signals.remember_turned(doubt.by),
            // nothing else fails like that
            _ => {}
        }
    }

    /// Returns the last known positions of the joints.
    pub fn known_positions(&self) -> impl Iterator<Item = KnownPosition> {
        self.signals.known_positions()
    }

    /// Trusts the present values of these signals, as a person says; returns those that are trusted. A joint that is frozen and
    /// still repeats itself is not among them and stays doubted: it is not mended. A signal that a person alone trusts is not
    /// proven before the motion shows it.
    pub fn trust(&mut self, signals: Proofs) -> Proofs {
        let signals = signals.without(self.signals.repeating());
        // what a person says again takes nothing back, unless the signal has failed since
        let failed: Proofs = self.doubts().map(|doubt| doubt.signal).collect();
        let anew = signals.without(self.trusted.without(failed));
        self.trusted = self.trusted.with(signals);
        let before = self.proven_before_trust.without(anew);
        let proven = self.relations.proven().shared_with(anew);
        self.proven_before_trust = before.with(proven);
        self.signals.trust(signals);
        self.relations.trust(signals);
        if signals.has(Proof::SpecificForce) {
            self.weight.trust();
        }
        signals
    }

    /// Returns the signals that a person alone trusts: the motion has not proven them since.
    fn only_trusted(&self) -> Proofs {
        let proven_since = (self.relations.proven()).without(self.proven_before_trust);
        self.trusted.without(proven_since)
    }

    /// Returns the proofs and doubts about the sensors by the samples so far. `is_idle` is true for signals of actuators on which
    /// no load depends now.
    #[must_use]
    pub fn shown(&self, is_idle: &dyn Fn(usize) -> bool) -> SessionProofs {
        let unchanged = self.signals.unchanged(is_idle);
        let disputed = self.relations.disputed().with(self.only_trusted());
        SessionProofs {
            proven: self.relations.proven(),
            unchanged: unchanged.with(self.signals.silent(is_idle)),
            disputed: disputed.with(self.signals.turned_housing()),
            at_zero: self.signals.at_zero(),
        }
    }

    /// Whether nothing shows that the signal of an actuator is measured: the signal has had one value only, or repeats one for so
    /// long that it may have stopped.
    pub(in crate::estimation) fn says_nothing(&self, actuator: usize) -> bool {
        self.signals.is_nothing(actuator)
    }

    /// Returns the probability that each joint of the arm has the other sign, by index, as the samples so far show it; none where
    /// nothing compares them.
    #[must_use]
    pub fn reversed(&self) -> Vec<(usize, f64)> {
        self.relations.reversed()
    }

    /// Whether a value that the estimate requires was not finite in the last sample.
    pub(crate) fn lacks_a_value(&self) -> bool {
        self.findings.iter().any(Finding::lacks_a_value)
    }

    /// Forgets the findings of the last sample: the next one is not checked.
    pub(in crate::estimation) fn forget_findings(&mut self) {
        self.findings.clear();
    }

    /// Checks a sample of a number whose state is not estimated; returns whether it may be used.
    pub(in crate::estimation) fn step_number(&mut self, sample: &Sample<'_>) -> bool {
        self.findings.clear();
        self.signals.check_number(sample, &mut self.findings);
        let forbids = |finding: &Finding| finding.policy == Policy::Invalid;
        !self.findings.iter().any(forbids)
    }

    /// Checks a sample; [`Self::findings`] returns the faults found.
    ///
    /// # Errors
    /// The sensor does not exist, the number of values is wrong, or the stamp is not later than the preceding one.
    pub fn step(&mut self, sample: &Sample<'_>) -> Result<Judgement, SampleError> {
        self.step_partly(sample, &[])
    }

    /// Checks a sample of joints of which some only `repeat` their last value, by place: these are not checked. The comparison of
    /// sensors takes samples without repeats only.
    pub(in crate::estimation) fn step_partly(
        &mut self,
        sample: &Sample<'_>,
        repeat: &[bool],
    ) -> Result<Judgement, SampleError> {
        self.findings.clear();
        let mut sound = self.signals.step(sample, repeat, &mut self.findings)?;
        if sample.sensor == Sensor::Imu && sound.force {
            // Which samples are wrong does not show in their mean, so it is asked for where nothing later is known.
            let Rules { limits, policies } = &self.rules;
            let mut note = Note::new(&mut self.findings, policies, sample);
            let mut found = note.of(Part::SpecificForce);
            let force = &sample.values[..3];
            sound.force = (self.weight).check(sample.stamp_ns, force, limits, &mut found);
        }
        let is_whole = !repeat.contains(&true);
        (self.relations).step(sample, sound, is_whole, &mut self.findings);
        self.has_found_contradiction |= self.findings.iter().any(|finding| {
            finding.casts_doubt(self.has_imu) && finding.explanation.is_some_and(Explanation::lasts)
        });
        Ok(Judgement::of(&self.findings))
    }

    /// Effect of the last sample's findings on rows until the sensor's next one.
    pub(crate) fn row_effect(&self, machine: &Machine) -> RowEffect {
        let mut effect = RowEffect::default();
        for finding in &self.findings {
            effect.add(finding, machine, self.has_imu);
        }
        effect
    }
}

/// Room for the faults of a sample: a step does not allocate, and notes no more.
pub(in crate::estimation) fn room_for_findings(sensors: &Sensors) -> Vec<Finding> {
    let streams = sensors.joints.iter();
    let most_joints = streams.map(|stream| stream.joints.len()).max().unwrap_or(0);
    Vec::with_capacity(6 * most_joints + 16)
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;
    use crate::estimation::noise_of_tests::Noise;
    use crate::machine::of_tests::rigid;

    /// The checks after 20 s of a machine at rest; from the tenth on its attitude is inclined by an angle (rad), and its accelerometer off.
    fn checked(inclined: f64, off: Vector3<f64>) -> Plausibility {
        let machine = rigid();
        let sensors = Sensors {
            imu: true,
            odometry: true,
            ..Sensors::default()
        };
        let mut checks = Plausibility::new(&machine, &sensors);
        let mut noise = Noise(3);
        for step in 0..2000_i64 {
            let mut scattered = |scale: f64| Vector3::from_fn(|_, _| scale * noise.next());
            let since = f64::from(u8::from(step >= 1000));
            let force = Vector3::z() * machine.gravity() + off * since + scattered(0.03);
            let (gyro, velocity, turning) = (scattered(1e-3), scattered(0.01), scattered(1e-3));
            let tilt = Vector3::x() * (inclined * since) + scattered(1e-4);
            let xyzw: [f64; 4] = UnitQuaternion::from_scaled_axis(tilt).coords.into();
            let odometry = [velocity.as_slice(), turning.as_slice(), &[f64::NAN; 4]].concat();
            let imu = [force.as_slice(), gyro.as_slice(), &xyzw].concat();
            let stamp_ns = step * 10_000_000;
            for (sensor, stamp_ns, values) in [
                (Sensor::Odometry, stamp_ns, odometry),
                (Sensor::Imu, stamp_ns + 1, imu),
            ] {
                let sample = Sample::new(sensor, stamp_ns, &values);
                checks.step(&sample).unwrap();
            }
        }
        checks
    }

    #[test]
    fn an_attitude_that_jumps_while_the_force_does_not_is_no_step_of_the_accelerometer() {
        let contradicts = |checks: &Plausibility, part: Part| {
            let mut findings = checks.findings().iter();
            findings.any(|it| it.part == part && it.kind == FaultKind::Contradiction)
        };
        let jumped = checked(0.2, Vector3::zeros());
        assert!(contradicts(&jumped, Part::Attitude));
        assert!(!contradicts(&jumped, Part::SpecificForce));
        assert_eq!(jumped.doubts().count(), 0);
        let stepped = checked(0.0, Vector3::y() * 3.0);
        assert!(!contradicts(&stepped, Part::Attitude));
        assert!(contradicts(&stepped, Part::SpecificForce));
        assert!(
            stepped
                .doubts()
                .any(|doubt| doubt.signal == Proof::SpecificForce)
        );
    }
}
