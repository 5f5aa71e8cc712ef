//! The range of every signal at a row and until the next one.

use nalgebra::Vector3;

use super::range::{Exceeded, MotionRange, Span};
use super::reach;
use super::usable::UsableSamples;
use crate::estimation::smoother::{Chunk, SampleSource, SortedSamples};
use crate::machine::{JointBounds, Machine};
use crate::state::{Sensor, Sensors, State, measured_up};

/// The motion that the samples of a log leave open. Stated greatest rates and accelerations that the log itself
/// exceeds are raised to what it shows.
#[derive(Debug)]
pub struct UnobservedMotion<S> {
    sensors: Sensors,
    samples: Vec<UsableSamples<S>>,
    max_gap_ns: i64,
    hold_ns: i64,
    gravity: f64,
    joints: Vec<Option<JointBounds>>,
    /// Greatest acceleration of a wheel, by joint (rad/s^2); `None` for other joints.
    wheels: Vec<Option<f64>>,
    limits: Vec<Option<[f64; 2]>>,
    acceleration: f64,
    rate: f64,
    angular_acceleration: f64,
    tool: [Option<f64>; 2],
    exceeded: Vec<Exceeded>,
}

/// Memory to read samples with.
#[derive(Debug, Default)]
pub struct SampleMemory {
    chunks: Vec<Chunk>,
}

/// Two consecutive samples, or the last one and its age.
struct Pair {
    from: Vec<f64>,
    to: Option<Vec<f64>>,
    /// Time between both samples, or since the only one (s).
    t: f64,
}

impl<S: SampleSource> UnobservedMotion<S> {
    /// Reads all samples once to compare them with the stated bounds.
    ///
    /// # Errors
    /// Samples cannot be read.
    pub fn new(machine: &Machine, sensors: &Sensors, sources: Vec<S>) -> Result<Self, S::Error> {
        let mut samples: Vec<UsableSamples<S>> = Vec::new();
        for source in sources.into_iter().filter(|s| sensors.need(s.sensor())) {
            let is_known = (samples.iter()).any(|known| known.sensor() == source.sensor());
            if let Some(sorted) = SortedSamples::new(source, sensors).filter(|_| !is_known) {
                samples.push(UsableSamples::new(sorted)?);
            }
        }
        let spec = machine.quasi_static();
        let joints = machine.joints().iter().enumerate();
        let mut found = Self {
            sensors: sensors.clone(),
            samples,
            max_gap_ns: (machine.estimator().max_gap * 1e9) as i64,
            hold_ns: (spec.hold * 1e9) as i64,
            gravity: machine.gravity(),
            joints: joints
                .map(|(j, joint)| joint.logged.then(|| machine.joint_bounds(j)))
                .collect(),
            wheels: (0..machine.joints().len())
                .map(|joint| {
                    let spun = machine.joints()[joint].spins_wheel;
                    spun.map(|_| machine.joint_bounds(joint).acceleration)
                })
                .collect(),
            limits: machine.joints().iter().map(|j| j.limits).collect(),
            acceleration: spec.platform_acceleration,
            rate: spec.platform_rate,
            angular_acceleration: spec.platform_angular_acceleration,
            tool: [spec.tool_force, spec.tool_moment],
            exceeded: Vec::new(),
        };
        found.raise_bounds(machine)?;
        Ok(found)
    }

    /// The stated bounds that the log exceeds.
    #[must_use]
    pub fn exceeded(&self) -> &[Exceeded] {
        &self.exceeded
    }

    /// Memory for [`Self::between`].
    #[must_use]
    pub fn memory(&self) -> SampleMemory {
        SampleMemory {
            chunks: vec![Chunk::default(); self.samples.len()],
        }
    }

    /// Sets `range` to all values that signals can have had from a row on to a later time, or at the row if both
    /// times are equal. `state` is that of the row.
    ///
    /// # Errors
    /// Samples cannot be read.
    pub fn between(
        &self,
        from_ns: i64,
        to_ns: i64,
        state: &State<f64>,
        memory: &mut SampleMemory,
        range: &mut MotionRange,
    ) -> Result<(), S::Error> {
        range.restart(state);
        for (samples, chunk) in self.samples.iter().zip(&mut memory.chunks) {
            self.add_sensor(samples, chunk, from_ns, to_ns, range)?;
        }
        if range.is_unobserved {
            // a wheel rolls with the platform, whether it is logged or not
            for (joint, by) in range.joints.iter_mut().zip(&self.wheels) {
                joint[2].add(Span::at(0.0).widened(by.unwrap_or(0.0)));
            }
        }
        Ok(())
    }

    fn add_sensor(
        &self,
        samples: &UsableSamples<S>,
        chunk: &mut Chunk,
        from_ns: i64,
        to_ns: i64,
        range: &mut MotionRange,
    ) -> Result<(), S::Error> {
        let sensor = samples.sensor();
        let next = samples.first_after(from_ns);
        let Some(first) = next.checked_sub(1) else {
            (range.is_unobserved, range.is_bounded) = (true, false);
            return Ok(());
        };
        let at = |k: usize| samples.stamp_ns(k);
        let gap_after = |k: usize| at(k + 1).zip(at(k)).map(|(b, a)| b.saturating_sub(a));
        let is_near = |gap: Option<i64>| gap.is_some_and(|gap| gap <= self.max_gap_ns);
        let first_ns = at(first).unwrap_or(from_ns);
        let is_at_sample = first_ns == from_ns;
        let was_near = first > 0 && is_near(gap_after(first - 1));
        if from_ns == to_ns && is_at_sample {
            if was_near || is_near(gap_after(first)) {
                return Ok(());
            }
            // the motion at an isolated sample follows from the pair after it, else from the one before
            let pair = match gap_after(first) {
                Some(_) => self.pair(samples, chunk, first)?,
                None if first > 0 => self.pair(samples, chunk, first - 1)?,
                None => self.single(samples, chunk, first, 0.0)?,
            };
            range.is_unobserved = true;
            self.add_motion_at_sample(sensor, &pair, range);
            return Ok(());
        }
        range.held_s = match is_near(gap_after(first)) {
            true => range.held_s,
            false => range
                .held_s
                .max((from_ns.saturating_sub(first_ns)) as f64 * 1e-9),
        };
        let mut k = first;
        while let Some(start_ns) = at(k).filter(|&start| start < to_ns || k == first) {
            let Some(gap_ns) = gap_after(k) else {
                let age_ns = to_ns.saturating_sub(start_ns);
                if age_ns > 0 {
                    let is_known = age_ns <= self.hold_ns;
                    range.is_unobserved |= age_ns > self.max_gap_ns / 2;
                    range.is_bounded &= is_known;
                    let pair = self.single(samples, chunk, k, age_ns as f64 * 1e-9)?;
                    self.add_pair(sensor, &pair, range);
                }
                return Ok(());
            };
            let pair = self.pair(samples, chunk, k)?;
            if gap_ns <= self.max_gap_ns {
                if to_ns > from_ns {
                    self.add_dense(sensor, &pair, to_ns.saturating_sub(from_ns), range);
                }
            } else {
                range.is_unobserved = true;
                range.is_bounded &= gap_ns <= self.hold_ns;
                self.add_pair(sensor, &pair, range);
            }
            k += 1;
        }
        Ok(())
    }

    fn single(
        &self,
        samples: &UsableSamples<S>,
        chunk: &mut Chunk,
        k: usize,
        t: f64,
    ) -> Result<Pair, S::Error> {
        let from = samples.sample(k, chunk)?.map(|s| s.values.to_vec());
        Ok(Pair {
            from: from.unwrap_or_else(|| {
                let width = self.sensors.value_count(samples.sensor()).unwrap_or(0);
                vec![f64::NAN; width]
            }),
            to: None,
            t,
        })
    }

    fn pair(
        &self,
        samples: &UsableSamples<S>,
        chunk: &mut Chunk,
        k: usize,
    ) -> Result<Pair, S::Error> {
        let Pair { from, .. } = self.single(samples, chunk, k, 0.0)?;
        let to = samples.sample(k + 1, chunk)?.map(|s| s.values.to_vec());
        let ns = samples.stamp_ns(k).zip(samples.stamp_ns(k + 1));
        let t = ns.map_or(0.0, |(a, b)| b.saturating_sub(a) as f64 * 1e-9);
        Ok(Pair { from, to, t })
    }

    /// Velocity and acceleration at an isolated sample.
    fn add_motion_at_sample(&self, sensor: Sensor, pair: &Pair, range: &mut MotionRange) {
        match sensor {
            Sensor::Joints(stream) => {
                self.for_joints(stream, pair, |joint, bounds, x, rates| {
                    let into = &mut range.joints[joint];
                    into[2].add(Span::at(0.0).widened(bounds.acceleration));
                    if !rates[0].is_finite() {
                        into[1].add(unmeasured_rate(x, pair.t, bounds));
                    }
                });
            }
            Sensor::Imu | Sensor::Odometry => {
                for axis in &mut range.angular_acceleration {
                    axis.add(Span::at(0.0).widened(self.angular_acceleration));
                }
                if sensor == Sensor::Odometry {
                    // the acceleration itself is not measured
                    for axis in &mut range.specific_force {
                        *axis = axis.widened(self.acceleration);
                    }
                }
            }
            Sensor::ToolWrench | Sensor::Number(..) => {}
        }
    }

    /// Adds the possible motion between two samples that are far apart, or after the last one, to `range`.
    fn add_pair(&self, sensor: Sensor, pair: &Pair, range: &mut MotionRange) {
        match sensor {
            Sensor::Joints(stream) => {
                self.for_joints(stream, pair, |joint, bounds, x, rates| {
                    let into = &mut range.joints[joint];
                    if self.wheels[joint].is_none() {
                        into[0].add(self.positions(joint, x, pair.t, bounds));
                    }
                    into[1].add(rate_between(x, rates, pair.t, bounds));
                    into[2].add(Span::at(0.0).widened(bounds.acceleration));
                });
            }
            Sensor::Imu | Sensor::Odometry => self.add_platform(sensor, pair, range),
            Sensor::ToolWrench => self.add_tool(pair, range),
            Sensor::Number(..) => {}
        }
    }

    /// Adds the values of two samples that are close to each other to `range`. `lasts_ns` is the time that the range covers.
    fn add_dense(&self, sensor: Sensor, pair: &Pair, lasts_ns: i64, range: &mut MotionRange) {
        let both = [Some(&pair.from), pair.to.as_ref()];
        for values in both.into_iter().flatten() {
            let add = |spans: &mut [Span], values: &[f64]| {
                for (span, &value) in spans.iter_mut().zip(values) {
                    span.add(Span::at(value));
                }
            };
            match sensor {
                Sensor::Joints(stream) => {
                    for (k, &joint) in self.sensors.joints[stream].joints.iter().enumerate() {
                        if self.wheels[joint].is_none() {
                            range.joints[joint][0].add(Span::at(values[k]));
                        }
                    }
                }
                Sensor::Imu => {
                    add(&mut range.specific_force, &values[..3]);
                    add(&mut range.angular_velocity, &values[3..6]);
                }
                Sensor::Odometry => add(&mut range.angular_velocity, &values[3..6]),
                Sensor::ToolWrench => add(&mut range.tool, values),
                Sensor::Number(..) => {}
            }
        }
        let is_platform = matches!(sensor, Sensor::Imu | Sensor::Odometry);
        if is_platform && lasts_ns > self.max_gap_ns {
            for axis in &mut range.angular_acceleration {
                axis.add(Span::at(0.0).widened(self.angular_acceleration));
            }
        }
    }

    /// Positions within the limits of the URDF, as far as the samples keep them.
    fn positions(&self, joint: usize, x: [f64; 2], t: f64, bounds: JointBounds) -> Span {
        let reach = match x[1].is_finite() {
            true => reach::positions(x, t, bounds.rate, bounds.acceleration),
            false => Span::at(x[0]).widened(bounds.rate * t),
        };
        let Some([low, high]) = self.limits[joint] else {
            return reach;
        };
        let samples = [x[0], if x[1].is_finite() { x[1] } else { x[0] }];
        Span {
            low: reach.low.max(low.min(samples[0]).min(samples[1])),
            high: reach.high.min(high.max(samples[0]).max(samples[1])),
        }
    }

    /// Specific force f = a + g up: the direction turns away from that of the samples, and the platform accelerates.
    /// Where the attitude is not measured, the samples themselves may hold an acceleration.
    fn add_platform(&self, sensor: Sensor, pair: &Pair, range: &mut MotionRange) {
        let t = pair.t;
        let turned = match pair.to {
            Some(_) => reach::turn(t, self.rate, self.angular_acceleration),
            None => self.rate * t,
        };
        let samples = [Some(&pair.from), pair.to.as_ref()];
        for values in samples.into_iter().flatten() {
            let up = measured_up(&values[6..]);
            let (centre, acceleration) = match (up, sensor) {
                (Some(up), _) => (up * self.gravity, self.acceleration),
                (None, Sensor::Imu) => (
                    Vector3::new(values[0], values[1], values[2]),
                    2.0 * self.acceleration,
                ),
                (None, _) => {
                    range.is_bounded = false;
                    return;
                }
            };
            let direction = centre / centre.norm().max(f64::MIN_POSITIVE);
            for axis in 0..3 {
                // a rotation by t moves a component u of a unit vector by at most t sqrt(1 - u^2) + t^2 / 2
                let across = (1.0 - direction[axis].powi(2)).max(0.0).sqrt();
                let by = self.gravity * (turned * across + 0.5 * turned * turned);
                range.specific_force[axis].add(Span::at(centre[axis]).widened(by + acceleration));
                if sensor == Sensor::Imu {
                    range.specific_force[axis].add(Span::at(values[axis]));
                }
            }
        }
        for axis in 0..3 {
            let from = pair.from[3 + axis];
            let reach = match &pair.to {
                Some(to) => reach::values([from, to[3 + axis]], t, self.angular_acceleration),
                None => Span::at(from).widened(self.angular_acceleration * t),
            };
            let most = self.rate.max(from.abs());
            range.angular_velocity[axis].add(Span {
                low: reach.low.max(-most),
                high: reach.high.min(most),
            });
            range.angular_acceleration[axis].add(Span::at(0.0).widened(self.angular_acceleration));
        }
    }

    fn add_tool(&self, pair: &Pair, range: &mut MotionRange) {
        for (axis, span) in range.tool.iter_mut().enumerate() {
            let Some(by) = self.tool[axis / 3] else {
                range.is_bounded = false;
                return;
            };
            for values in [Some(&pair.from), pair.to.as_ref()].into_iter().flatten() {
                span.add(Span::at(values[axis]).widened(by));
            }
        }
    }

    /// Calls `visit` with each joint of a stream: its bounds, the positions and the velocities of both samples, NaN
    /// where there is none.
    fn for_joints(
        &self,
        stream: usize,
        pair: &Pair,
        mut visit: impl FnMut(usize, JointBounds, [f64; 2], [f64; 2]),
    ) {
        let joints = &self.sensors.joints[stream].joints;
        let of = |values: Option<&Vec<f64>>, k: usize| {
            values.and_then(|v| v.get(k)).copied().unwrap_or(f64::NAN)
        };
        for (k, &joint) in joints.iter().enumerate() {
            let Some(bounds) = self.joints[joint] else {
                continue;
            };
            let at = |k: usize| [of(Some(&pair.from), k), of(pair.to.as_ref(), k)];
            let (x, rates) = (at(k), at(joints.len() + k));
            if x[0].is_finite() {
                visit(joint, bounds, x, rates);
            }
        }
    }

    /// Compares the samples with the stated bounds, and raises those that they exceed.
    fn raise_bounds(&mut self, machine: &Machine) -> Result<(), S::Error> {
        let mut shown = Shown {
            joints: vec![[0.0; 2]; machine.joints().len()],
            platform: [0.0; 3],
        };
        for samples in &self.samples {
            let mut chunk = Chunk::default();
            let mut before: Option<Pair> = None;
            for k in 0..samples.len().saturating_sub(1) {
                let pair = self.pair(samples, &mut chunk, k)?;
                let is_sparse = (pair.t * 1e9) as i64 > self.max_gap_ns;
                if is_sparse {
                    self.look(samples.sensor(), &pair, before.as_ref(), &mut shown);
                }
                before = is_sparse.then_some(pair);
            }
        }
        for (joint, [rate, acceleration]) in shown.joints.into_iter().enumerate() {
            let name = &machine.joints()[joint].name;
            let Some(bounds) = &mut self.joints[joint] else {
                continue;
            };
            if self.wheels[joint].is_some() {
                continue;
            }
            let numbers = [
                ("rate", &mut bounds.rate, rate),
                ("acceleration", &mut bounds.acceleration, acceleration),
            ];
            for (key, stated, observed) in numbers {
                raise(
                    &mut self.exceeded,
                    format!("joints.{name}.{key}"),
                    stated,
                    observed,
                );
            }
        }
        let [acceleration, rate, angular_acceleration] = shown.platform;
        for (key, stated, observed) in [
            (
                "platform_acceleration",
                &mut self.acceleration,
                acceleration,
            ),
            ("platform_rate", &mut self.rate, rate),
            (
                "platform_angular_acceleration",
                &mut self.angular_acceleration,
                angular_acceleration,
            ),
        ] {
            raise(&mut self.exceeded, key.into(), stated, observed);
        }
        Ok(())
    }

    fn look(&self, sensor: Sensor, pair: &Pair, before: Option<&Pair>, shown: &mut Shown) {
        match sensor {
            Sensor::Joints(stream) => {
                let mut slopes = vec![f64::NAN; shown.joints.len()];
                if let Some(before) = before {
                    self.for_joints(stream, before, |joint, _, x, _| {
                        slopes[joint] = (x[1] - x[0]) / before.t;
                    });
                }
                let before_s = before.map_or(f64::NAN, |before| before.t);
                self.for_joints(stream, pair, |joint, _, x, rates| {
                    let slope = (x[1] - x[0]) / pair.t;
                    let [rate, acceleration] = &mut shown.joints[joint];
                    *rate = rate
                        .max(slope.abs())
                        .max(rates[0].abs())
                        .max(rates[1].abs());
                    // the mean value theorem twice
                    let by_slopes = 2.0 * (slope - slopes[joint]).abs() / (pair.t + before_s);
                    let by_rates = (rates[1] - rates[0]).abs() / pair.t;
                    *acceleration = acceleration.max(by_slopes).max(by_rates);
                });
            }
            Sensor::Imu => {
                for values in [Some(&pair.from), pair.to.as_ref()].into_iter().flatten() {
                    let f = Vector3::new(values[0], values[1], values[2]);
                    let by_length = (f.norm() - self.gravity).abs();
                    let by_up = |up: Vector3<f64>| (f - up * self.gravity).amax();
                    let a = measured_up(&values[6..]).map_or(by_length, by_up);
                    let w = Vector3::new(values[3], values[4], values[5]).amax();
                    shown.platform[0] = shown.platform[0].max(a);
                    shown.platform[1] = shown.platform[1].max(w);
                }
            }
            _ => {}
        }
    }
}

/// Least rates and accelerations that explain the samples.
struct Shown {
    /// Velocity and acceleration, by joint.
    joints: Vec<[f64; 2]>,
    /// Acceleration, angular velocity and angular acceleration.
    platform: [f64; 3],
}

fn raise(exceeded: &mut Vec<Exceeded>, key: String, stated: &mut f64, observed: f64) {
    if observed.is_finite() && observed > *stated {
        exceeded.push(Exceeded {
            key,
            stated: *stated,
            observed,
        });
        *stated = observed;
    }
}

/// Velocity between two samples, by the measured ones if there are some.
fn rate_between(x: [f64; 2], rates: [f64; 2], t: f64, bounds: JointBounds) -> Span {
    let JointBounds { rate, acceleration } = bounds;
    let reach = match (rates[0].is_finite(), rates[1].is_finite()) {
        (true, true) => reach::values(rates, t, acceleration),
        (true, false) => Span::at(rates[0]).widened(acceleration * t),
        (false, _) => return unmeasured_rate(x, t, bounds),
    };
    Span {
        low: reach.low.max(-rate),
        high: reach.high.min(rate),
    }
}

fn unmeasured_rate(x: [f64; 2], t: f64, bounds: JointBounds) -> Span {
    match x[1].is_finite() && t > 0.0 {
        true => reach::velocities(x, t, bounds.rate, bounds.acceleration),
        false => Span::at(0.0).widened(bounds.rate),
    }
}
