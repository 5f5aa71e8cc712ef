//! The causal estimator: it uses past samples only, live and to reproduce a live run offline.

use super::bias::BiasEstimator;
use super::filled_velocities::FilledVelocities;
use super::followed::Followed;
use super::held_values::Repeats;
use super::obedience::Obedience;
use super::reading::Reading;
use super::rotation::{PlatformRotation, RotationSpell};
use super::rows::{Estimate, RowClock, regular_index, regular_row};
use super::shown_noise::ShownNoise;
use super::state_builder::{Filters, StateBuilder};
use super::white_jerk::{Channel, seconds};
use crate::estimation::plausibility::{Finding, Inherited, Plausibility, RowEffect, SignalDoubt};
use crate::estimation::support_configuration::SupportWatch;
use crate::machine::{Machine, PayloadQuantity, Proofs};
use crate::state::{
    Credible, NumberKind, Reason, Sample, SampleError, Sensor, Sensors, StreamCounts,
};

/// Takes samples in order of arrival and emits a row at each sample of the first stream of joint states,
/// or at a regular rate.
///
/// The same samples in the same order give identical bits, offline and live. A step never allocates.
#[derive(Debug, Clone)]
pub struct CausalEstimator {
    filters: Filters,
    bias: BiasEstimator,
    state_builder: StateBuilder,
    sensors: Sensors,
    plausibility: Plausibility,
    /// By stream of joint states.
    filled_velocities: Vec<FilledVelocities>,
    /// A sample of joint states without the velocities that are filled in.
    measured: Vec<f64>,
    /// By sensor, in their order; a repeat is no sample.
    repeats: Vec<(Sensor, Repeats)>,
    /// The same by stream of joint states and joint.
    joint_repeats: Vec<Vec<Repeats>>,
    /// Which joints of the last message only repeat, by their places; others are new in it.
    repeat: Vec<bool>,
    is_repeat: bool,
    /// Sees every sample that is no repeat as it was measured, those that are implausible or not later, too.
    rotation: PlatformRotation,
    /// `None` for a machine that is always on the same supports.
    supports: Option<SupportWatch>,
    /// By load sensor: stamp (ns) and value (N) of its last sample.
    loads: Vec<LastSample>,
    /// The same by command: the rate that is asked of a joint (rad/s or m/s).
    commands: Vec<LastSample>,
    obedience: Obedience,
    /// The same by signal of payloads.
    payload_signals: Vec<LastSample>,
    /// The same by signal of a force by which nothing is computed.
    force_signals: Vec<LastSample>,
    /// Effect of each sensor's last sample on rows.
    standing: Vec<(Sensor, RowEffect)>,
    counts: Vec<(Sensor, StreamCounts)>,
    clock: RowClock,
    first_row_ns: Option<i64>,
    rows_given: u64,
    settle_ns: i64,
    max_gap_ns: i64,
    estimate: Estimate,
}

impl CausalEstimator {
    /// An estimator without samples.
    #[must_use]
    pub fn new(machine: &Machine, sensors: &Sensors, clock: RowClock) -> Self {
        let max_gap_ns = (machine.estimator().max_gap * 1e9) as i64;
        let streams = sensors.joints.iter();
        let most_joints = streams.map(|stream| stream.joints.len()).max().unwrap_or(0);
        Self {
            filters: Filters::new(machine, sensors, false),
            bias: BiasEstimator::new(machine, sensors, false),
            state_builder: StateBuilder::new(machine, sensors),
            sensors: sensors.clone(),
            plausibility: Plausibility::new(machine, sensors),
            filled_velocities: (sensors.joints.iter())
                .map(|stream| FilledVelocities::new(stream.joints.len()))
                .collect(),
            measured: Vec::with_capacity(2 * most_joints),
            repeats: (sensors.all())
                .filter(|sensor| !tells_what_is_asked(*sensor))
                .filter_map(|sensor| {
                    let is_of_joints = matches!(sensor, Sensor::Joints(_));
                    let assumed_ns = if is_of_joints { max_gap_ns } else { 0 };
                    let values = sensors.value_count(sensor)?;
                    Some((sensor, Repeats::new(values, assumed_ns)))
                })
                .collect(),
            joint_repeats: (sensors.joints.iter())
                // a clone of one has no room
                .map(|stream| (stream.joints.iter()).map(|_| Repeats::of_joint(max_gap_ns)))
                .map(Iterator::collect)
                .collect(),
            repeat: Vec::with_capacity(most_joints),
            is_repeat: false,
            rotation: PlatformRotation::new(machine, sensors),
            supports: SupportWatch::new(machine, sensors),
            loads: vec![LastSample::default(); sensors.loads],
            commands: vec![LastSample::default(); sensors.commands],
            obedience: Obedience::new(machine),
            payload_signals: vec![LastSample::default(); machine.payload_signals().len()],
            force_signals: vec![LastSample::default(); sensors.forces],
            standing: sensors
                .iter()
                .map(|sensor| (sensor, RowEffect::default()))
                .collect(),
            counts: sensors
                .iter()
                .map(|sensor| (sensor, StreamCounts::default()))
                .collect(),
            clock,
            first_row_ns: None,
            rows_given: 0,
            settle_ns: (machine.estimator().settle * 1e9) as i64,
            max_gap_ns,
            estimate: Estimate::unknown(machine),
        }
    }

    /// The sensors it expects.
    #[must_use]
    pub fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    /// The stamp from which the spans of time count in which supports are set or raised (ns): the first of the log.
    pub fn count_spans_from(&mut self, start_ns: i64) {
        if let Some(supports) = &mut self.supports {
            supports.count_spans_from(start_ns);
        }
    }

    /// Number of samples used and not used, by sensor.
    #[must_use]
    pub fn counts(&self) -> &[(Sensor, StreamCounts)] {
        &self.counts
    }

    /// Implausibilities found in the last sample.
    #[must_use]
    pub fn findings(&self) -> &[Finding] {
        self.plausibility.findings()
    }

    /// Whether the last sample only repeated the one before, because its sensor measures less often.
    #[must_use]
    pub fn is_repeat(&self) -> bool {
        self.is_repeat
    }

    /// The noise that the samples so far show, beside the stated one.
    #[must_use]
    pub fn shown_noise(&self, machine: &Machine) -> Vec<ShownNoise> {
        let sensors = self.sensors.iter();
        sensors
            .flat_map(|sensor| self.filters.shown_noise(machine, sensor))
            .collect()
    }

    /// The rotation of the platform about an edge that stands, by gyro and attitude alone.
    #[must_use]
    pub fn rotation(&self) -> Option<&RotationSpell> {
        self.rotation.spell()
    }

    /// Whether the platform falls, by gyro and attitude alone, as far as they are still measured at this stamp.
    #[must_use]
    pub fn falls(&self, now_ns: i64) -> bool {
        self.rotation.falls(now_ns)
    }

    /// The checks of the samples so far: contradictions, doubts and positions of the joints.
    #[must_use]
    pub fn plausibility(&self) -> &Plausibility {
        &self.plausibility
    }

    /// A sensor was contradicted in a session before, and the machine was not commissioned since.
    pub fn remember_contradiction(&mut self) {
        self.plausibility.remember_contradiction();
    }

    /// The signals that are doubted since they failed visibly, see [`Plausibility::doubts`], and the joints that do not show what their
    /// controller asks.
    pub fn doubts(&self) -> impl Iterator<Item = SignalDoubt> {
        self.plausibility.doubts().chain(self.obedience.doubts())
    }

    /// Takes over from a session before, see [`Plausibility::inherit`].
    pub fn inherit(&mut self, from: &Inherited) {
        self.plausibility.inherit(from);
        self.obedience.inherit(&from.doubts);
    }

    /// A person trusts these signals as they are now: rows do not doubt them from the next samples on. Returns those that are trusted,
    /// see [`Plausibility::trust`].
    pub fn trust(&mut self, signals: Proofs) -> Proofs {
        let trusted = self.plausibility.trust(signals);
        self.obedience.trust(trusted);
        trusted
    }

    /// The last row emitted.
    #[must_use]
    pub fn last(&self) -> &Estimate {
        &self.estimate
    }

    /// The same, for what others find in it. The next row begins anew.
    pub fn last_mut(&mut self) -> &mut Estimate {
        &mut self.estimate
    }

    /// Takes a sample and calls `row` with each row that it completes.
    ///
    /// # Errors
    /// [`SampleError`] where the sample is not used; it is counted, and the estimator continues. A joint
    /// sample with a non-finite value still completes its row, marked invalid.
    pub fn push(
        &mut self,
        machine: &Machine,
        sample: &Sample<'_>,
        row: &mut dyn FnMut(&Estimate),
    ) -> Result<(), SampleError> {
        let told = match &mut self.supports {
            Some(supports) => supports.take(machine, sample),
            None => Ok(()),
        };
        if matches!(sample.sensor, Sensor::Number(NumberKind::Switch, _)) {
            self.plausibility.forget_findings();
            return match self.sensors.value_count(sample.sensor) {
                Some(count) if count == sample.values.len() => told,
                _ => Err(SampleError::UnknownSensor),
            };
        }
        let beside = match sample.sensor {
            Sensor::Number(NumberKind::Load, load) => Some(self.loads.get_mut(load)),
            Sensor::Number(NumberKind::Command, command) => Some(self.commands.get_mut(command)),
            Sensor::Number(NumberKind::Payload, signal) => {
                Some(self.payload_signals.get_mut(signal))
            }
            Sensor::Number(NumberKind::Force, signal) => Some(self.force_signals.get_mut(signal)),
            _ => None,
        };
        self.is_repeat = false;
        if let Some(last) = beside {
            self.plausibility.forget_findings();
            let last = last.ok_or(SampleError::UnknownSensor)?;
            last.take(sample)?;
            let of_sensor = (self.repeats.iter_mut()).find(|(sensor, _)| *sensor == sample.sensor);
            if let Some((_, repeats)) = of_sensor {
                self.is_repeat = repeats.take(sample.stamp_ns, sample.values);
                if !self.is_repeat {
                    let is_sound = self.plausibility.step_number(sample);
                    repeats.judge(is_sound);
                    if !is_sound {
                        last.forget_value();
                    }
                }
            }
            return Ok(());
        }
        let mut measured = std::mem::take(&mut self.measured);
        let sample = self.as_measured(sample, &mut measured);
        let result = self.push_measured(machine, &sample, row);
        self.measured = measured;
        result
    }

    /// The sample without velocities that a driver fills in; `values` holds what changes.
    fn as_measured<'a>(&mut self, sample: &Sample<'a>, values: &'a mut Vec<f64>) -> Sample<'a> {
        let Sensor::Joints(stream) = sample.sensor else {
            return *sample;
        };
        let filled = self.filled_velocities.get_mut(stream);
        let is_of_stream = self.sensors.value_count(sample.sensor) == Some(sample.values.len());
        let Some(filled) = filled.filter(|it| is_of_stream && !it.are_all_measured()) else {
            return *sample;
        };
        values.clear();
        values.extend_from_slice(sample.values);
        filled.mark(values);
        Sample { values, ..*sample }
    }

    fn push_measured(
        &mut self,
        machine: &Machine,
        sample: &Sample<'_>,
        row: &mut dyn FnMut(&Estimate),
    ) -> Result<(), SampleError> {
        let of_sensor = (self.repeats.iter_mut()).position(|(sensor, _)| *sensor == sample.sensor);
        let repeats = of_sensor.map(|place| &mut self.repeats[place].1);
        self.is_repeat =
            repeats.is_some_and(|repeats| repeats.take(sample.stamp_ns, sample.values));
        let is_held = of_sensor.is_some_and(|place| self.repeats[place].1.are_held());
        self.find_repeating_joints(sample, is_held);
        let result = match self.is_repeat {
            true => {
                self.plausibility.forget_findings();
                Ok(Credible(true))
            }
            false => self.take(machine, sample),
        };
        if let Some(place) = of_sensor {
            let is_sound = result == Ok(Credible(true));
            self.repeats[place].1.judge(is_sound);
            if let Sensor::Joints(stream) = sample.sensor {
                let joints = self.joint_repeats[stream].iter_mut();
                joints.for_each(|repeats| repeats.judge(is_sound));
            }
        }
        let mut counts = self.counts.iter_mut();
        if !self.is_repeat
            && let Some((_, counts)) = counts.find(|(sensor, _)| *sensor == sample.sensor)
        {
            counts.count(result);
        }
        if !matches!(result, Ok(_) | Err(SampleError::NotFinite)) {
            return result.map(|_| ());
        }
        if sample.sensor != Sensor::Joints(0) {
            return result.map(|_| ());
        }
        let first = *self.first_row_ns.get_or_insert(sample.stamp_ns);
        match self.clock {
            RowClock::JointStates => self.give_row(machine, sample.stamp_ns, row),
            RowClock::Rate(hz) => {
                let behind = sample.stamp_ns.saturating_sub(self.max_gap_ns);
                // One wrong stamp may be years away.
                self.rows_given = self.rows_given.max(regular_index(first, behind, hz));
                while let Some(stamp) = regular_row(first, self.rows_given, hz, sample.stamp_ns) {
                    // A long gap gets no rows, the same as at the joints' own stamps.
                    if stamp >= behind {
                        self.give_row(machine, stamp, row);
                    }
                    self.rows_given += 1;
                }
            }
        }
        result.map(|_| ())
    }

    /// Finds which joints of a message only repeat their last measurement. Where the whole message is held that is told of it, but
    /// for joints that are measured at instants of their own already.
    fn find_repeating_joints(&mut self, sample: &Sample<'_>, is_held: bool) {
        self.repeat.clear();
        let Sensor::Joints(stream) = sample.sensor else {
            return;
        };
        let (positions, rates) = sample.values.split_at(sample.values.len() / 2);
        let joints = self.joint_repeats.get_mut(stream).into_iter().flatten();
        let followed = Followed::Joints(stream);
        let values = positions.iter().zip(rates).enumerate();
        for (repeats, (channel, (&position, &rate))) in joints.zip(values) {
            let repeats = repeats.take(sample.stamp_ns, &[position, rate]);
            let is_alone = || (self.filters.alone(followed)).any(|it| it.channel() == channel);
            self.repeat.push(repeats && (!is_held || is_alone()));
        }
    }

    /// Judges a sample and passes it to the filters.
    fn take(&mut self, machine: &Machine, sample: &Sample<'_>) -> Result<Credible, SampleError> {
        self.rotation.step(sample);
        let judgement = self.plausibility.step_partly(sample, &self.repeat)?;
        if let Some((_, standing)) = self
            .standing
            .iter_mut()
            .find(|(sensor, _)| *sensor == sample.sensor)
        {
            *standing = self.plausibility.row_effect(machine);
        }
        self.bias.push(sample, &judgement);
        self.filters.push(sample, &judgement, &self.repeat)?;
        if self.plausibility.lacks_a_value() {
            return Err(SampleError::NotFinite);
        }
        Ok(Credible(judgement.is_clean()))
    }

    fn give_row(&mut self, machine: &Machine, time_ns: i64, row: &mut dyn FnMut(&Estimate)) {
        let (filters, settle_ns, max_gap_ns) = (&self.filters, self.settle_ns, self.max_gap_ns);
        let share = filters.share_of_faster(time_ns);
        let mut read = |followed: Followed, channels: &mut [Channel]| {
            let Some(filter) = filters.get(followed) else {
                return Reading::NOTHING;
            };
            if !filter.is_near(time_ns, max_gap_ns) {
                return Reading::NOTHING;
            }
            let mut reading = Reading {
                standing: filter.status(time_ns, settle_ns),
                covariance: filter.read(time_ns, share, channels),
            };
            for alone in filters.alone(followed) {
                if !alone.is_near(time_ns, max_gap_ns) {
                    return Reading::NOTHING;
                }
                alone.read_into(time_ns, settle_ns, channels, &mut reading);
            }
            reading
        };
        let elapsed_s = seconds(time_ns.saturating_sub(self.first_row_ns.unwrap_or(time_ns)));
        let mut effect = RowEffect::default();
        for (_, standing) in &self.standing {
            effect.merge(standing);
        }
        self.estimate.time_ns = time_ns;
        self.estimate.reasons = self.state_builder.assemble(
            machine,
            elapsed_s,
            &effect,
            self.bias.estimate(),
            &mut read,
            &mut self.estimate.state,
        );
        self.leave_out_what_says_nothing(machine);
        if self.plausibility.is_contradicted() {
            self.estimate.reasons.add(Reason::Contradiction);
        }
        self.estimate.rotates = self.rotation.falls(time_ns);
        let supports = self.supports.as_mut();
        self.estimate.stands_on = supports.map(|supports| supports.at(machine, time_ns));
        let stands_on = self.estimate.stands_on.and_then(Result::ok);
        let is_idle = |signal: usize| {
            let on = stands_on.zip(self.supports.as_ref());
            on.is_some_and(|(set, supports)| supports.is_idle(machine, signal, set))
        };
        self.estimate.shown = self.plausibility.shown(&is_idle);
        for (value, last) in self.estimate.measured_loads.iter_mut().zip(&self.loads) {
            *value = last.near(time_ns, max_gap_ns);
        }
        for (command, last) in machine.joint_commands().iter().zip(&self.commands) {
            self.estimate.commands[command.joint] = last.near(time_ns, max_gap_ns);
        }
        let joints = &self.estimate.state.joints;
        (self.obedience).row(time_ns, &self.estimate.commands, joints);
        let disputed = &mut self.estimate.shown.disputed;
        for doubt in self.obedience.doubts() {
            *disputed = disputed.with(doubt.disputed());
        }
        let forces = self.estimate.arm_forces.iter_mut();
        for (value, force) in forces.zip(machine.arm_forces()) {
            *value = force_of(&force.signals, &self.force_signals, time_ns, max_gap_ns);
        }
        if self.estimate.rotates && self.rotation.spell().is_some() {
            self.estimate.reasons.add(Reason::Tipping);
        }
        self.weigh_by_signals(machine, elapsed_s);
        row(&self.estimate);
    }

    /// A force that nothing shows to be measured splits no load: a jack that has stopped would hide that its foot is in the air. The
    /// force that tells the mass of a payload stays, because without it there are no loads; it is not proven.
    fn leave_out_what_says_nothing(&mut self, machine: &Machine) {
        for (k, signal) in self.sensors.actuators.iter().enumerate() {
            let mut lifts = machine.payloads().iter().filter_map(|it| it.lift.as_ref());
            if self.plausibility.says_nothing(k)
                && !lifts.any(|lift| lift.joint == Some(signal.joint))
            {
                self.estimate.state.actuator_force[signal.joint] = f64::NAN;
            }
        }
    }

    /// Gives the row the masses that signals state, and the forces by which others are estimated: these are unknown here. Without
    /// a mass the loads are unknown.
    fn weigh_by_signals(&mut self, machine: &Machine, elapsed_s: f64) {
        let (estimate, max_gap_ns) = (&mut self.estimate, self.max_gap_ns);
        let time_ns = estimate.time_ns;
        for (index, payload) in machine.payloads().iter().enumerate() {
            if let Some(lift) = &payload.lift {
                let in_state = lift.joint.map(|joint| estimate.state.actuator_force[joint]);
                estimate.lift_forces[index] = in_state.unwrap_or_else(|| {
                    force_of(&lift.signals, &self.payload_signals, time_ns, max_gap_ns)
                });
            }
            if !payload.is_by_row {
                continue;
            }
            let [from_s, to_s] = payload.window_s;
            let mass = match &payload.signal {
                _ if !(from_s..to_s).contains(&elapsed_s) => 0.0,
                None => f64::NAN,
                Some(signal) => {
                    let mut signals = machine.payload_signals().iter();
                    let place = signals.position(|it| it.quantity == PayloadQuantity::Mass(index));
                    let last = place.and_then(|place| self.payload_signals.get(place));
                    let mass = last.map(|it| it.near(time_ns, signal.max_age_ns()));
                    mass.map_or(f64::NAN, |mass| machine.plausible_payload(mass))
                }
            };
            let share = &mut estimate.state.payload_share[index];
            // what is unknown stays unknown
            *share = *share * 0.0 + mass;
            if share.is_nan() && payload.signal.is_some() {
                estimate.reasons.add(Reason::ToolWrenchGap);
            }
        }
    }
}

/// The force (N) that some signals, each with its coefficient, show at about this time; NaN without one of them.
fn force_of(signals: &[(usize, f64)], last: &[LastSample], time_ns: i64, max_gap_ns: i64) -> f64 {
    let of_signal = |&(signal, coefficient): &(usize, f64)| {
        let last = last.get(signal);
        coefficient * last.map_or(f64::NAN, |last| last.near(time_ns, max_gap_ns))
    };
    signals.iter().map(of_signal).sum()
}

/// Whether a sensor tells a state or a command, which nothing but a person changes.
fn tells_what_is_asked(sensor: Sensor) -> bool {
    let kinds = [NumberKind::Switch, NumberKind::Command];
    matches!(sensor, Sensor::Number(kind, _) if kinds.contains(&kind))
}

/// The last sample of a number: its stamp (ns) and value.
#[derive(Debug, Clone, Copy, Default)]
struct LastSample(Option<(i64, f64)>);

impl LastSample {
    /// Takes a sample. A command may be that nothing is asked for.
    ///
    /// # Errors
    /// It is not later than the one before, not finite, or has not one value.
    fn take(&mut self, sample: &Sample<'_>) -> Result<(), SampleError> {
        let &[value] = sample.values else {
            return Err(SampleError::UnknownSensor);
        };
        if self
            .0
            .is_some_and(|(last_ns, _)| sample.stamp_ns <= last_ns)
        {
            return Err(SampleError::NotLater);
        }
        self.0 = Some((sample.stamp_ns, value));
        let asks_nothing =
            matches!(sample.sensor, Sensor::Number(NumberKind::Command, _)) && value.is_nan();
        match value.is_finite() || asks_nothing {
            true => Ok(()),
            false => Err(SampleError::NotFinite),
        }
    }

    /// Its value is not used.
    fn forget_value(&mut self) {
        self.0 = self.0.map(|(stamp_ns, _)| (stamp_ns, f64::NAN));
    }

    /// Its finite value, if it is of about this time; else NaN.
    fn near(self, time_ns: i64, max_gap_ns: i64) -> f64 {
        let is_near = |(stamp_ns, value): &(i64, f64)| {
            time_ns.abs_diff(*stamp_ns) <= max_gap_ns.unsigned_abs() && value.is_finite()
        };
        self.0.filter(is_near).map_or(f64::NAN, |(_, value)| value)
    }
}
