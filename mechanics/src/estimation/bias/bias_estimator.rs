//! Sample by sample: from the sensors to the difference filter and its division.

use nalgebra::{Matrix3, Vector3};

use super::difference_filter::DifferenceFilter;
use super::split::{Stated, between, divided};
use crate::estimation::plausibility::{Judgement, Treatment};
use crate::machine::Machine;
use crate::state::{AccelerometerBias, Sample, Sensor, Sensors, measured_up};

/// Shortest time between two velocities that are used (s): the errors of closer ones are not independent.
const LEAST_STEP_S: f64 = 0.2;
/// Standard deviation of a velocity of the odometry, whose errors are slower than its noise (m/s), and its share
/// of the speed.
const ODOMETRY_ERROR: f64 = 0.04;
const ODOMETRY_ERROR_SHARE: f64 = 0.03;
/// Speed below which a wheel or the machine counts as standing (m/s).
const STANDING: f64 = 0.02;
/// Standard deviation of the velocity of a machine on standing wheels, which rocks on its tyres (m/s).
const STANDING_ERROR: f64 = 0.02;
/// Time over which errors of the attitude in motion persist (s).
const ATTITUDE_ERROR_S: f64 = 0.1;
/// Standard deviation of the tilt where no attitude is measured (rad).
const UNKNOWN_TILT: f64 = 1.0;

/// Estimates the bias of the accelerometer from samples in order of arrival. A step never allocates, unless
/// the history is kept.
#[derive(Debug, Clone)]
pub(crate) struct BiasEstimator {
    setting: Setting,
    filter: DifferenceFilter,
    imu: Option<ImuReading>,
    /// Mean specific force of an IMU without attitude since the last velocity.
    without_attitude: Option<Levelled>,
    /// Stamp of the last velocity of the odometry, and whether the machine stood.
    odometry: Option<(i64, bool)>,
    /// Stamp at which the wheels were last seen to stand or turn.
    wheels: Option<(i64, bool)>,
    corrected_ns: Option<i64>,
    estimate: AccelerometerBias<f64>,
    history: Option<Vec<Division>>,
}

/// Constants of the estimator: mounting of the IMU, stated uncertainties, wheels.
#[derive(Debug, Clone)]
struct Setting {
    /// Whether there is an IMU on the base, and a bias to estimate.
    is_used: bool,
    /// Identified bias, to be added to the specific force (m/s^2).
    correction: Option<Vector3<f64>>,
    stated: Stated,
    attitude_variance: f64,
    accelerometer_variance: f64,
    gravity: f64,
    imu_from_base: Matrix3<f64>,
    /// Position of the IMU in the base, IMU axes (m).
    position: Vector3<f64>,
    max_gap_ns: i64,
    /// Index of each wheel in its stream of joint states, and its radius (m).
    wheels: Vec<Vec<(usize, f64)>>,
}

impl Setting {
    fn corrected(&self, force: Vector3<f64>) -> Vector3<f64> {
        self.correction.map_or(force, |by| force + by)
    }
}

/// The last sample of the IMU.
#[derive(Debug, Clone, Copy)]
struct ImuReading {
    stamp_ns: i64,
    force: Vector3<f64>,
    turning: Vector3<f64>,
    /// Up direction by the attitude.
    up: Option<Vector3<f64>>,
}

/// Sums over time while a machine stands whose attitude is unknown.
#[derive(Debug, Clone, Copy)]
struct Levelled {
    seconds: f64,
    force: Vector3<f64>,
    turning: Vector3<f64>,
}

/// Inputs for dividing a difference between accelerometer bias and other errors: its stamp, the up direction and the stated
/// uncertainties.
#[derive(Debug, Clone, Copy)]
struct Division {
    stamp_ns: i64,
    up: Vector3<f64>,
    stated: Stated,
}

impl BiasEstimator {
    pub(crate) fn new(machine: &Machine, sensors: &Sensors, keeps_history: bool) -> Self {
        let (spec, noise, imu) = (machine.uncertainty(), machine.estimator(), machine.imu());
        let imu_from_base = imu.rotation_in_body().transpose();
        let wheel = |&joint: &usize| {
            let wheel = machine.joints()[joint].spins_wheel?;
            Some(machine.wheels()[wheel].radius)
        };
        let wheels = sensors.joints.iter().map(|stream| {
            let radii = stream.joints.iter().map(wheel).enumerate();
            radii.filter_map(|(i, radius)| Some((i, radius?))).collect()
        });
        Self {
            setting: Setting {
                is_used: sensors.imu && imu.body == 0 && spec.accelerometer_bias > 0.0,
                correction: Some(machine.correct_specific_force(&Vector3::zeros()))
                    .filter(|correction| *correction != Vector3::zeros()),
                stated: Stated {
                    bias: spec.accelerometer_bias,
                    tilt: spec.attitude_bias * machine.gravity(),
                    gravity: spec.gravity,
                },
                attitude_variance: noise.attitude_noise * noise.attitude_noise,
                accelerometer_variance: noise.accelerometer_noise * noise.accelerometer_noise,
                gravity: machine.gravity(),
                position: imu_from_base * imu.body_from_mount.translation.vector,
                imu_from_base,
                max_gap_ns: (noise.max_gap * 1e9) as i64,
                wheels: wheels.collect(),
            },
            filter: DifferenceFilter::new(keeps_history),
            imu: None,
            without_attitude: None,
            odometry: None,
            wheels: None,
            corrected_ns: None,
            estimate: AccelerometerBias::unknown(),
            history: keeps_history.then(Vec::new),
        }
    }

    /// The estimate from the samples so far.
    pub(crate) fn estimate(&self) -> &AccelerometerBias<f64> {
        &self.estimate
    }

    /// Whether samples of this sensor are of use.
    pub(crate) fn uses(&self, sensor: Sensor) -> bool {
        self.setting.is_used
            && match sensor {
                Sensor::Imu | Sensor::Odometry => true,
                Sensor::Joints(stream) => {
                    (self.setting.wheels.get(stream)).is_some_and(|wheels| !wheels.is_empty())
                }
                Sensor::ToolWrench | Sensor::Number(..) => false,
            }
    }

    /// Takes a sample whose stamp is later than that of the sensor's preceding one, unless the plausibility check
    /// doubts it.
    pub(crate) fn push(&mut self, sample: &Sample<'_>, judgement: &Judgement) {
        if !self.uses(sample.sensor) {
            return;
        }
        // A bias is no more credible than the worst of its samples.
        let [first, second, third] = judgement.parts.map(|part| part != Treatment::default());
        let (stamp_ns, values) = (sample.stamp_ns, sample.values);
        match sample.sensor {
            Sensor::Imu if !first && !second => {
                let attitude = (!third).then(|| measured_up(&values[6..])).flatten();
                self.take_imu(stamp_ns, values, attitude);
            }
            Sensor::Odometry if !first => {
                let velocity = Vector3::from_column_slice(&values[..3]);
                if velocity.iter().all(|v| v.is_finite()) {
                    self.take_odometry(stamp_ns, &velocity);
                }
            }
            Sensor::Joints(stream) if !first => self.take_wheels(stamp_ns, stream, values),
            _ => {}
        }
    }

    fn take_imu(&mut self, stamp_ns: i64, values: &[f64], up: Option<Vector3<f64>>) {
        let next = ImuReading {
            stamp_ns,
            force: self
                .setting
                .corrected(Vector3::from_column_slice(&values[..3])),
            turning: Vector3::from_column_slice(&values[3..6]),
            up,
        };
        if !(next.force.iter().chain(&next.turning)).all(|v| v.is_finite()) {
            return;
        }
        let Some(last) = self.imu.replace(next) else {
            return;
        };
        let step_ns = stamp_ns.saturating_sub(last.stamp_ns);
        if step_ns > self.setting.max_gap_ns {
            self.forget_velocity();
            return;
        }
        let dt = step_ns as f64 * 1e-9;
        let force = (last.force + next.force) * 0.5;
        let turning = (last.turning + next.turning) * 0.5;
        if let (Some(before), Some(now)) = (last.up, next.up) {
            let gravity = (before + now) * (0.5 * self.setting.gravity);
            let density = self.setting.noise_density(dt);
            self.without_attitude = None;
            self.filter
                .advance(dt, &(force - gravity), &turning, density);
        } else {
            let sums = self.without_attitude.get_or_insert(Levelled::NOTHING);
            sums.seconds += dt;
            sums.force += force * dt;
            sums.turning += turning * dt;
        }
    }

    fn take_odometry(&mut self, stamp_ns: i64, velocity: &Vector3<f64>) {
        let speed = velocity.norm();
        let stands = speed < STANDING && self.wheels_stand(stamp_ns) != Some(false);
        self.odometry = Some((stamp_ns, stands));
        let error = match stands {
            true => STANDING_ERROR,
            false => (ODOMETRY_ERROR.powi(2) + (ODOMETRY_ERROR_SHARE * speed).powi(2)).sqrt(),
        };
        self.correct(stamp_ns, velocity, error, stands);
    }

    fn take_wheels(&mut self, stamp_ns: i64, stream: usize, values: &[f64]) {
        let rates = &values[values.len() / 2..];
        let mut speeds = (self.setting.wheels[stream].iter()).map(|&(i, radius)| rates[i] * radius);
        // NaN is no standstill.
        let stand = speeds.all(|speed| speed.abs() < STANDING);
        self.wheels = Some((stamp_ns, stand));
        let odometry_is_known = self
            .odometry
            .is_some_and(|(at, _)| stamp_ns.abs_diff(at) <= self.setting.max_gap_ns.unsigned_abs());
        if stand && !odometry_is_known {
            self.correct(stamp_ns, &Vector3::zeros(), STANDING_ERROR, true);
        }
    }

    /// Whether the wheels stand, as far as their joint states tell.
    fn wheels_stand(&self, stamp_ns: i64) -> Option<bool> {
        let (at, stand) = self.wheels?;
        (stamp_ns.abs_diff(at) <= self.setting.max_gap_ns.unsigned_abs()).then_some(stand)
    }

    /// Uses a velocity of the base (m/s, base axes), unless the last one is too close.
    fn correct(&mut self, stamp_ns: i64, base: &Vector3<f64>, error: f64, stands: bool) {
        let since = |from: i64| stamp_ns.saturating_sub(from) as f64 * 1e-9;
        if self
            .corrected_ns
            .is_some_and(|at| since(at).abs() < LEAST_STEP_S)
        {
            return;
        }
        let (Some(imu), setting) = (self.imu, &self.setting) else {
            return;
        };
        if stamp_ns.abs_diff(imu.stamp_ns) > setting.max_gap_ns.unsigned_abs() {
            return;
        }
        let mut tilt = setting.stated.tilt;
        let up = match (imu.up, self.without_attitude.take()) {
            (Some(up), None) => up,
            (_, Some(sums)) if stands && sums.seconds > 0.0 => {
                // A standing machine without attitude: the specific force itself points up.
                let force = sums.force / sums.seconds;
                let Some(up) = force.try_normalize(0.1 * setting.gravity) else {
                    return;
                };
                tilt = UNKNOWN_TILT * setting.gravity;
                let density = setting.noise_density(sums.seconds);
                self.filter.advance(
                    sums.seconds,
                    &(force - up * setting.gravity),
                    &(sums.turning / sums.seconds),
                    density,
                );
                up
            }
            _ => {
                self.forget_velocity();
                return;
            }
        };
        // The velocity of the sensor, at the stamp of its last sample.
        let sensor = setting.imu_from_base * base + imu.turning.cross(&setting.position);
        let gravity = up * setting.gravity;
        let rate =
            imu.force - gravity - self.filter.difference().value - imu.turning.cross(&sensor);
        let measured = sensor - rate * since(imu.stamp_ns);
        if !self.filter.correct(&measured, error * error) {
            return;
        }
        self.corrected_ns = Some(stamp_ns);
        let division = Division {
            stamp_ns,
            up,
            stated: Stated {
                tilt,
                ..setting.stated
            },
        };
        self.estimate = divided(&self.filter.difference(), &division.up, &division.stated);
        if let Some(history) = &mut self.history {
            history.push(division);
        }
    }

    fn forget_velocity(&mut self) {
        self.filter.forget_velocity();
        self.without_attitude = None;
    }

    /// The estimates of a whole log.
    pub(crate) fn smoothed(self) -> BiasHistory {
        let divisions = self.history.unwrap_or_default();
        let mut of = divisions.iter().rev();
        let mut estimates = Vec::with_capacity(divisions.len());
        self.filter.for_each_smoothed_backwards(|difference| {
            estimates.extend(of.next().map(|of| divided(&difference, &of.up, &of.stated)));
        });
        estimates.reverse();
        BiasHistory {
            stamps_ns: divisions.iter().map(|division| division.stamp_ns).collect(),
            estimates,
        }
    }
}

impl Setting {
    /// Spectral density of the errors of the acceleration, of IMU samples `dt` apart (m^2/s^3).
    fn noise_density(&self, dt: f64) -> f64 {
        let tilt = self.attitude_variance * self.gravity * self.gravity;
        2.0 * ATTITUDE_ERROR_S * tilt + self.accelerometer_variance * dt
    }
}

impl Levelled {
    const NOTHING: Self = Self {
        seconds: 0.0,
        force: Vector3::new(0.0, 0.0, 0.0),
        turning: Vector3::new(0.0, 0.0, 0.0),
    };
}

/// The smoothed estimates of a log, at the stamps of the velocities used.
#[derive(Debug, Clone)]
pub(crate) struct BiasHistory {
    stamps_ns: Vec<i64>,
    estimates: Vec<AccelerometerBias<f64>>,
}

impl BiasHistory {
    /// The estimate at a time: linear between two stamps, constant beyond the first and the last.
    pub(crate) fn at(&self, time_ns: i64) -> AccelerometerBias<f64> {
        let next = self.stamps_ns.partition_point(|&stamp| stamp <= time_ns);
        let known = |k: usize| self.estimates.get(k).copied();
        let (Some(before), Some(after)) = (next.checked_sub(1).and_then(known), known(next)) else {
            let last = self.estimates.last().copied();
            return match next {
                0 => known(0),
                _ => last,
            }
            .unwrap_or_else(AccelerometerBias::unknown);
        };
        let (from, to) = (self.stamps_ns[next - 1], self.stamps_ns[next]);
        let share = time_ns.saturating_sub(from) as f64 / to.saturating_sub(from).max(1) as f64;
        between(&before, &after, share)
    }
}
