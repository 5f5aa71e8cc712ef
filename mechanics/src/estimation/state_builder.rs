//! One Kalman filter for each measured quantity, and the machine state assembled from their estimates.

use nalgebra::Vector3;

use super::adaptation::Adaptation;
use super::alone::Alone;
use super::faster;
use super::followed::Followed;
use super::judged;
use super::kalman_filter::{FilterModel, KalmanFilter};
use super::reading::{FilterStatus, Reading};
use super::shaken::{Motion as ShakenMotion, Shaken};
use super::shown_noise::ShownNoise;
use super::turns::Turns;
use super::white_jerk::{Channel, Matrix};
use crate::estimation::plausibility::{Judgement, RowEffect, Treatment};
use crate::geometry::coordinate::Motion;
use crate::machine::Machine;
use crate::state::{
    AccelerometerBias, BaseState, JetCovariance, NumberKind, Reason, Reasons, Sample, SampleError,
    Sensor, Sensors, SignalNoise, State, tilt_is_measured, up_of,
};

/// The filters of a set of sensors.
#[derive(Debug, Clone)]
pub(super) struct Filters {
    pub(super) list: Vec<(Followed, KalmanFilter)>,
    sensors: Sensors,
    turns: Turns,
    /// Joints that may be measured at other instants than the rest of their message; none where a smoother divided the messages.
    alone: Vec<Alone>,
    /// Removes periodic vibration of the IMU; `None` where a smoother averages it out.
    shaken: Option<Shaken>,
    /// Whether an orientation has measured a tilt: until then, an orientation without tilt counts as planar, its inclination as
    /// unknown.
    pub(super) has_tilt: bool,
}

impl Filters {
    pub(super) fn new(machine: &Machine, sensors: &Sensors, keeps_history: bool) -> Self {
        let e = machine.estimator();
        let max_gap_ns = (e.max_gap * 1e9) as i64;
        let model = |noise: f64, rate_noise: f64, process_noise: f64| FilterModel {
            value_variance: noise * noise,
            rate_variance: rate_noise * rate_noise,
            density: process_noise * process_noise,
            max_gap_ns,
        };
        let joints = model(e.joint_position_noise, e.joint_rate_noise, e.joint_agility);
        let gyro = model(e.gyro_noise, 0.0, e.gyro_agility);
        let accelerometer = model(e.accelerometer_noise, 0.0, e.accelerometer_agility);
        let attitude = model(e.attitude_noise, 0.0, e.attitude_agility);
        let odometry = model(e.odometry_noise, 0.0, e.odometry_agility);
        let tool = model(e.tool_force_noise, 0.0, e.tool_force_agility);
        let (mut list, mut alone) = (Vec::new(), Vec::new());
        let weighing = |filter: KalmanFilter, counts: &dyn Fn(usize) -> bool| {
            // A smoother averages out most of what shakes a sensor.
            match keeps_history {
                true => filter,
                false => {
                    let channels = 0..filter.channels();
                    filter.weighing_misfit(channels.map(counts))
                }
            }
        };
        let filter = |model, channels| {
            weighing(KalmanFilter::new(model, channels, keeps_history), &|_| true)
        };
        for (stream, spec) in sensors.joints.iter().enumerate() {
            // How fast wheels spin and are steered says nothing of the arm, and hardly acts on loads.
            let is_of_arm = |&joint: &usize| {
                machine.joints()[joint].spins_wheel.is_none() && !machine.is_steering(joint)
            };
            let of_joints = |own: &[usize]| {
                let filter = KalmanFilter::new(joints, own.len(), keeps_history);
                match e.noise_from_log {
                    true => {
                        let filter = filter.adapting(Adaptation::new(own.iter().map(is_of_arm)));
                        match keeps_history {
                            true => filter,
                            false => filter.weighing_onsets(own.iter().map(is_of_arm)),
                        }
                    }
                    false => weighing(filter, &|channel| is_of_arm(&own[channel])),
                }
            };
            list.push((Followed::Joints(stream), of_joints(&spec.joints)));
            let channels = (0..spec.joints.len()).filter(|_| !keeps_history);
            alone.extend(channels.map(|channel| {
                let own = [spec.joints[channel]];
                Alone::new(stream, channel, is_of_arm(&own[0]), of_joints(&own))
            }));
        }
        let of_imu = |model| match keeps_history {
            true => filter(model, 3),
            false => filter(model, 3).beside_faster(),
        };
        if sensors.imu {
            list.push((Followed::SpecificForce, of_imu(accelerometer)));
            list.push((Followed::AngularVelocity, of_imu(gyro)));
        } else if sensors.odometry {
            list.push((Followed::AngularVelocity, filter(gyro, 3)));
        }
        if sensors.imu || sensors.odometry {
            list.push((Followed::Up, filter(attitude, 3)));
        }
        if sensors.odometry {
            list.push((Followed::Velocity, filter(odometry, 3)));
        }
        if sensors.tool_wrench {
            list.push((Followed::ToolWrench, filter(tool, 6)));
        }
        for (k, signal) in sensors.actuators.iter().enumerate() {
            // Each of several signals gets a sigma that makes the sum as uncertain as the force is stated to be.
            let joint = &machine.contact.actuated_joints[signal.joint];
            let unit = joint.signals[signal.signal].abs();
            let noise = joint.force_sigma.max(1.0) / (unit * (joint.signals.len() as f64).sqrt());
            let force = model(noise, 0.0, e.actuator_force_agility / unit);
            // What is stated is the error of a force, friction included, of which noise is the least part.
            list.push((Followed::Actuator(k), filter(force, 1)));
        }
        Self {
            list,
            turns: Turns::new(machine, sensors),
            alone,
            shaken: (!keeps_history).then(|| Shaken::new(e.accelerometer_noise, max_gap_ns)),
            sensors: sensors.clone(),
            has_tilt: false,
        }
    }

    pub(super) fn get(&self, followed: Followed) -> Option<&KalmanFilter> {
        self.list
            .iter()
            .find(|(f, _)| *f == followed)
            .map(|(_, filter)| filter)
    }

    /// The joints of a stream that are measured at instants of their own.
    pub(super) fn alone(&self, followed: Followed) -> impl Iterator<Item = &Alone> {
        let alone = self.alone.iter().filter(|alone| alone.is_used());
        alone.filter(move |alone| followed == Followed::Joints(alone.stream()))
    }

    /// Returns the share of the [`faster`] filters in the estimates of the platform's motion at a stamp (0 to 1), the same for
    /// all of them.
    pub(super) fn share_of_faster(&self, stamp_ns: i64) -> f64 {
        let force = self.get(Followed::SpecificForce);
        let turning = self.get(Followed::AngularVelocity);
        let force = force.and_then(|filter| filter.distance_of_faster::<0>(stamp_ns));
        let turning = turning.and_then(|filter| filter.distance_of_faster::<1>(stamp_ns));
        (force.zip(turning)).map_or(0.0, |(a, b)| faster::share(0.5 * (a + b)))
    }

    /// The filters that samples of a sensor update, in a fixed order.
    pub(super) fn fed_by(
        &mut self,
        sensor: Sensor,
    ) -> impl Iterator<Item = &mut (Followed, KalmanFilter)> {
        let imu = self.sensors.imu;
        let all = self.list.iter_mut();
        all.filter(move |(followed, _)| followed.is_fed_by(sensor, imu))
    }

    /// The noise that the samples of a sensor show; none before the first samples, and where it stays as stated.
    pub(super) fn shown_noise(&self, machine: &Machine, sensor: Sensor) -> Vec<ShownNoise> {
        let imu = self.sensors.imu;
        let fed = self.list.iter().filter(|(f, _)| f.is_fed_by(sensor, imu));
        fed.filter_map(|(followed, filter)| {
            let factors = filter.shown_noise()?;
            Some(ShownNoise::of(
                *followed,
                sensor,
                machine.estimator(),
                factors,
            ))
        })
        .flatten()
        .collect()
    }

    fn push_to(
        &mut self,
        followed: Followed,
        stamp_ns: i64,
        values: &[f64],
        rates: Option<&[f64]>,
        treatment: &Treatment,
    ) -> Result<(), SampleError> {
        let mut filters = self.list.iter_mut();
        let (_, filter) =
            (filters.find(|(f, _)| *f == followed)).ok_or(SampleError::UnknownSensor)?;
        judged::push(filter, stamp_ns, values, rates, treatment)
    }

    /// Passes the parts of a sample to their filters, as the plausibility check judged them. Joints that only `repeat` their last
    /// value, by place, are measured at instants of their own.
    pub(super) fn push(
        &mut self,
        sample: &Sample<'_>,
        judgement: &Judgement,
        repeat: &[bool],
    ) -> Result<(), SampleError> {
        if self.sensors.value_count(sample.sensor) != Some(sample.values.len()) {
            return Err(SampleError::UnknownSensor);
        }
        let (t, values, [first, second, third]) =
            (sample.stamp_ns, sample.values, &judgement.parts);
        match sample.sensor {
            Sensor::Joints(stream) => {
                let (positions, rates) = values.split_at(values.len() / 2);
                let followed = Followed::Joints(stream);
                let filter = self.list.iter().find(|(f, _)| *f == followed);
                let mut turns = std::mem::take(&mut self.turns);
                let positions = match filter {
                    Some((_, filter)) => turns.counted(stream, t, positions, filter),
                    None => positions,
                };
                let taken = self.push_to(followed, t, positions, Some(rates), first);
                let taken = taken.and_then(|()| {
                    let sample = (t, positions, rates);
                    self.push_alone(stream, sample, first, repeat)
                });
                self.turns = turns;
                taken
            }
            Sensor::Imu => {
                let (at_ns, motion) = self.unshaken(t, values, first, second);
                let force = self.get(Followed::SpecificForce);
                // a mean that became longer goes back
                let is_later =
                    (force.and_then(KalmanFilter::last_ns)).is_none_or(|last| at_ns > last);
                if is_later || at_ns == t {
                    self.push_to(Followed::SpecificForce, at_ns, &motion[..3], None, first)?;
                    self.push_to(Followed::AngularVelocity, at_ns, &motion[3..], None, second)?;
                }
                self.push_up(t, &values[6..], third);
                Ok(())
            }
            Sensor::Odometry => {
                self.push_to(Followed::Velocity, t, &values[..3], None, first)?;
                if !self.sensors.imu {
                    self.push_to(Followed::AngularVelocity, t, &values[3..6], None, second)?;
                    self.push_up(t, &values[6..], third);
                }
                Ok(())
            }
            Sensor::ToolWrench => self.push_to(Followed::ToolWrench, t, values, None, first),
            Sensor::Number(NumberKind::Actuator, k) => {
                self.push_to(Followed::Actuator(k), t, values, None, first)
            }
            // the state is the same on whichever supports
            Sensor::Number(..) => Ok(()),
        }
    }

    /// Passes joints that are measured at instants of their own to their filters.
    fn push_alone(
        &mut self,
        stream: usize,
        (stamp_ns, positions, rates): (i64, &[f64], &[f64]),
        treatment: &Treatment,
        repeat: &[bool],
    ) -> Result<(), SampleError> {
        let with = self.list.iter_mut();
        let mut with = with.filter(|(followed, _)| *followed == Followed::Joints(stream));
        let Some((_, with)) = with.next() else {
            return Ok(());
        };
        let alone = self.alone.iter_mut();
        for alone in alone.filter(|alone| alone.stream() == stream) {
            let channel = alone.channel();
            let repeats = repeat.get(channel) == Some(&true);
            let jet = [positions[channel], rates[channel]];
            alone.push(stamp_ns, jet, treatment, repeats, with)?;
        }
        Ok(())
    }

    /// Returns specific force and angular velocity of a sample without the vibration of the IMU, and their stamp (ns).
    fn unshaken(
        &mut self,
        stamp_ns: i64,
        values: &[f64],
        force: &Treatment,
        turning: &Treatment,
    ) -> (i64, ShakenMotion) {
        let motion: ShakenMotion = std::array::from_fn(|k| values[k]);
        let Some(shaken) = &mut self.shaken else {
            return (stamp_ns, motion);
        };
        let is_doubted = |of: &Treatment| of.left_out || of.value_variance > 0.0;
        let is_finite = motion.iter().all(|value| value.is_finite());
        if is_finite && !is_doubted(force) && !is_doubted(turning) {
            return shaken.take(stamp_ns, motion);
        }
        // as if it had been lost
        (stamp_ns, motion)
    }

    /// Updates the up direction in the sensor frame from an orientation; does nothing where it is unknown.
    fn push_up(&mut self, stamp_ns: i64, xyzw: &[f64], treatment: &Treatment) {
        self.has_tilt |= tilt_is_measured(xyzw);
        if !self.has_tilt {
            return;
        }
        if let Some(up) = up_of(xyzw) {
            // A useless orientation only leaves a gap in a filter whose estimate rows do not require.
            let _ = self.push_to(Followed::Up, stamp_ns, up.as_slice(), None, treatment);
        }
    }
}

/// Assembles states from the filters' estimates.
#[derive(Debug, Clone)]
pub(super) struct StateBuilder {
    sensors: Sensors,
    rolling: Vec<RollingWheel>,
    channels: Vec<Channel>,
}

/// Writes a filter's channels and returns their validity.
pub(super) type Read<'a> = dyn FnMut(Followed, &mut [Channel]) -> Reading + 'a;

/// A wheel without a joint state: its velocity follows from rolling without slip.
#[derive(Debug, Clone)]
struct RollingWheel {
    joint: usize,
    /// Direction of motion of the wheel's centre for a positive joint velocity, base axes.
    forward: Vector3<f64>,
    centre: Vector3<f64>,
    radius: f64,
}

impl StateBuilder {
    pub(super) fn new(machine: &Machine, sensors: &Sensors) -> Self {
        let rolling = machine
            .joints()
            .iter()
            .enumerate()
            .filter(|(_, j)| !j.logged && j.constant.is_none())
            .filter_map(|(joint, spec)| {
                let wheel = &machine.wheels()[spec.spins_wheel?];
                let axis = machine.axis_at_zero(wheel.body);
                let forward = axis.cross(&Vector3::z()).try_normalize(1e-9)?;
                Some(RollingWheel {
                    joint,
                    forward,
                    centre: wheel.centre_at_zero,
                    radius: wheel.radius,
                })
            });
        Self {
            sensors: sensors.clone(),
            rolling: rolling.collect(),
            channels: vec![Channel::default(); machine.joints().len().max(6)],
        }
    }

    /// Fills `state` by `read`, which writes a filter's channels and returns their validity. `elapsed_s` is
    /// the time since the first row, `effect` the effect of implausible samples on this row, `bias` that of
    /// the accelerometer. Returns the reasons why the row is invalid.
    pub(super) fn assemble(
        &mut self,
        machine: &Machine,
        elapsed_s: f64,
        effect: &RowEffect,
        bias: &AccelerometerBias<f64>,
        read: &mut Read<'_>,
        state: &mut State<f64>,
    ) -> Reasons {
        // Quantities without a sensor must return to zero after a row that was unknown.
        state.for_each_value(|value| *value = 0.0);
        state.base = BaseState::unknown();
        let mut reasons = Reasons::NONE;
        if !(self.sensors.imu || self.sensors.odometry) {
            reasons.add(Reason::ImuGap);
        }
        for (stream, spec) in self.sensors.joints.iter().enumerate() {
            let channels = &mut self.channels[..spec.joints.len()];
            let reading = read(Followed::Joints(stream), channels);
            note(
                &mut reasons,
                Followed::Joints(stream),
                reading.standing,
                self.sensors.imu,
            );
            state.noise.allow_for_joints(&reading.covariance);
            for (&joint, channel) in spec.joints.iter().zip(channels.iter()) {
                let [position, rate, acceleration] = channel.jet;
                state.joints[joint] = Motion {
                    position,
                    rate,
                    acceleration,
                };
                state.lag.joints[joint] = channel.lag[2];
            }
        }
        let imu = self.sensors.imu;
        let mut triple = |followed| vectors(followed, read, &mut reasons, imu);
        let velocity = if self.sensors.odometry {
            triple(Followed::Velocity)
        } else {
            None
        };
        let (turning, up) = if imu || self.sensors.odometry {
            (
                triple(Followed::AngularVelocity),
                triple(Followed::Up).and_then(|up| up.value.try_normalize(0.5)),
            )
        } else {
            (None, None)
        };
        let up_in_base = if imu {
            up.and_then(|up| up_in_base(machine, &up))
        } else {
            up
        };
        let turning = turning.unwrap_or_default();
        let (mut w, alpha) = (turning.value, turning.rate);
        if imu {
            w = machine.correct_angular_velocity(&w);
        }
        state.imu.angular_velocity = w;
        state.imu.angular_acceleration = alpha;
        state.noise.turning = turning.value_and_rate_covariance();
        [state.lag.angular_velocity, state.lag.angular_acceleration] = turning.lag;
        if let Some(up) = up_in_base {
            state.base.up = up;
        }
        if let Some(base_velocity) = &velocity {
            state.base.velocity = base_velocity.value;
            state.base.velocity_rate = base_velocity.rate;
        }
        if imu {
            let measured = triple(Followed::SpecificForce).unwrap_or_default();
            state.imu.specific_force =
                machine.correct_specific_force(&measured.value) - bias.removed;
            state.noise.specific_force = measured.covariance[0][0];
            state.lag.specific_force = measured.lag[0];
            state.noise.accelerometer_bias = *bias;
        } else if let Some(base_velocity) = &velocity {
            // f = dv/dt + w x v + g up
            let up = up_in_base.unwrap_or_else(|| {
                // the slope is needed here, and unknown is not level
                reasons.add(Reason::OdometryGap);
                Vector3::repeat(f64::NAN)
            });
            state.imu.specific_force =
                base_velocity.rate + w.cross(&base_velocity.value) + up * machine.gravity();
            state.noise.specific_force = base_velocity.covariance[1][1];
            state.lag.specific_force = base_velocity.lag[1];
        }
        if self.sensors.tool_wrench {
            let channels = &mut self.channels[..6];
            let reading = read(Followed::ToolWrench, channels);
            note(&mut reasons, Followed::ToolWrench, reading.standing, imu);
            state.noise.tool_wrench = reading.covariance[0][0];
            let value = |k: usize| channels[k].jet[0];
            state.tool_wrench.force = Vector3::new(value(0), value(1), value(2));
            state.tool_wrench.moment = Vector3::new(value(3), value(4), value(5));
        }
        self.read_actuators(machine, read, state);
        for (joint, spec) in machine.joints().iter().enumerate() {
            if let Some(position) = spec.constant {
                state.joints[joint].position = position;
            }
        }
        machine.correct_joints(&mut state.joints);
        for wheel in &self.rolling {
            state.joints[wheel.joint] = wheel.motion(velocity.as_ref(), &w, &alpha);
        }
        for (share, payload) in state.payload_share.iter_mut().zip(machine.payloads()) {
            let [from, to] = payload.window_s;
            *share = if !payload.is_by_row && (from..to).contains(&elapsed_s) {
                1.0
            } else {
                0.0
            };
        }
        reasons.add_all(effect.reasons);
        effect.enlarge(&mut state.noise);
        if reasons.leave_state_unknown() {
            state.for_each_value(|value| *value = f64::NAN);
        }
        reasons
    }
}

impl StateBuilder {
    /// Assembles the forces of actuated joints whose signals are all available.
    fn read_actuators(&self, machine: &Machine, read: &mut Read<'_>, state: &mut State<f64>) {
        let joints = machine.contact.actuated_joints.iter().enumerate();
        for ((joint, spec), force) in joints.zip(&mut state.actuator_force) {
            let (mut sum, mut found) = (0.0, 0);
            for (k, signal) in self.sensors.actuators.iter().enumerate() {
                let mut channels = [Channel::default()];
                if signal.joint == joint
                    && read(Followed::Actuator(k), &mut channels).standing != FilterStatus::Unknown
                {
                    sum += spec.signals[signal.signal] * channels[0].jet[0];
                    found += 1;
                }
            }
            *force = if found == spec.signals.len() {
                sum
            } else {
                f64::NAN
            };
        }
    }
}

impl SignalNoise<f64> {
    /// Merges the covariance of a joint stream: keeps the one with the larger acceleration variance, to which
    /// the loads are most sensitive.
    fn allow_for_joints(&mut self, covariance: &Matrix) {
        let [[p00, p01, p02], [_, p11, p12], [_, _, p22]] = *covariance;
        if p22 >= self.joint.second {
            self.joint = JetCovariance {
                value: [p00, p01, p02],
                first: [p11, p12],
                second: p22,
            };
        }
    }
}

impl RollingWheel {
    /// Velocity and acceleration of a rolling wheel: speed of its centre over its radius; zero where the
    /// speed is unknown. The angle of a round wheel has no effect.
    fn motion(
        &self,
        base_velocity: Option<&Triple>,
        w: &Vector3<f64>,
        alpha: &Vector3<f64>,
    ) -> Motion<f64> {
        let Some(base_velocity) = base_velocity else {
            return Motion::zero();
        };
        let along = |v: &Vector3<f64>, w: &Vector3<f64>| {
            self.forward.dot(&(v + w.cross(&self.centre))) / self.radius
        };
        Motion {
            position: 0.0,
            rate: along(&base_velocity.value, w),
            acceleration: along(&base_velocity.rate, alpha),
        }
    }
}

fn note(reasons: &mut Reasons, followed: Followed, standing: FilterStatus, imu: bool) {
    let Some(gap) = followed.gap(imu) else { return };
    match standing {
        FilterStatus::Known => {}
        FilterStatus::Settling => reasons.add(Reason::Settling),
        FilterStatus::Unknown => reasons.add(gap),
    }
}

/// A filter's three channels as vectors.
#[derive(Debug, Clone, Copy, Default)]
struct Triple {
    value: Vector3<f64>,
    rate: Vector3<f64>,
    covariance: Matrix,
    /// Lag of the values and of the rates behind a motion that changes fast.
    lag: [Vector3<f64>; 2],
}

impl Triple {
    fn value_and_rate_covariance(&self) -> [f64; 3] {
        let p = &self.covariance;
        [p[0][0], p[0][1], p[1][1]]
    }
}

fn vectors(
    followed: Followed,
    read: &mut Read<'_>,
    reasons: &mut Reasons,
    imu: bool,
) -> Option<Triple> {
    let mut channels = [Channel::default(); 3];
    let reading = read(followed, &mut channels);
    note(reasons, followed, reading.standing, imu);
    let [x, y, z] = channels.map(|channel| channel.jet);
    (reading.standing != FilterStatus::Unknown).then(|| Triple {
        value: Vector3::new(x[0], y[0], z[0]),
        rate: Vector3::new(x[1], y[1], z[1]),
        covariance: reading.covariance,
        lag: [0, 1].map(|i| Vector3::from(channels.map(|channel| channel.lag[i]))),
    })
}

/// Up in base axes from up in sensor axes; unknown where the IMU is not mounted on the base.
fn up_in_base(machine: &Machine, up_in_imu: &Vector3<f64>) -> Option<Vector3<f64>> {
    (machine.imu().body == 0).then(|| machine.imu().rotation_in_body() * up_in_imu)
}

impl Machine {
    /// Axis of the joint that carries `body`, in base axes at zero joint positions.
    fn axis_at_zero(&self, mut body: usize) -> Vector3<f64> {
        let mut axis = Vector3::z();
        while body != 0 {
            axis = self.bodies[body].parent_from_joint * axis;
            body = self.bodies[body].parent;
        }
        axis
    }
}
