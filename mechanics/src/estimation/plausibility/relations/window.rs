//! Measurements of a window of time: the relations compare windows, whose errors are nearly independent.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::inclination::{Inclination, Rest};
use super::rolling::Rolled;
use crate::state::tilt_is_measured;

/// Length of a window (s).
pub(super) const WINDOW_S: f64 = 0.5;
/// Weight of a sample in the noise of the attitude and of the velocity.
const NOISE_WEIGHT: f64 = 1.0 / 256.0;
/// Mean speed of a machine at rest (m/s), as it creeps on a slope; the change of it in a window; and its mean turn by a gyro with a
/// bias (rad/s).
const CREEPS: f64 = 0.1;
const CREEPS_EVENLY: f64 = 0.03;
pub(super) const RESTS_TURNING: f64 = 0.04;
/// Turn of the platform in a window from which it is turned over, or thrown about (rad).
pub(super) const TURNED_OVER: f64 = 0.15;

/// The window so far.
#[derive(Debug, Clone)]
pub(super) struct Accumulated {
    base_from_imu: Matrix3<f64>,
    max_gap_ns: i64,
    imu: Imu,
    odometry: Odometry,
    wheels: Wheels,
}

/// The last velocity of the base that was measured.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShownVelocity {
    pub(super) stamp_ns: i64,
    /// Velocity (m/s, base axes), and the standard deviation of its components.
    pub(super) velocity: Vector3<f64>,
    pub(super) sigma: f64,
    pub(super) by: ShownBy,
}

/// Source of a velocity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ShownBy {
    Odometry,
    Wheels,
    /// Wheels that are steered, and do not show the velocity across.
    WheelsAlong,
    /// Neither odometry nor wheels.
    Nothing,
}

impl ShownBy {
    /// Returns 1 for each axis along which the velocity is known, else 0. A machine that stands on the ground does not slide or rise
    /// unseen; without odometry and wheels it may brake or speed up.
    pub(super) fn axes(self) -> Vector3<f64> {
        match self {
            Self::Odometry | Self::Wheels => Vector3::repeat(1.0),
            Self::WheelsAlong => Vector3::new(1.0, 0.0, 1.0),
            Self::Nothing => Vector3::new(0.0, 1.0, 1.0),
        }
    }
}

/// A window that is over.
#[derive(Debug, Clone, Copy)]
pub(super) struct Window {
    pub(super) start_ns: i64,
    pub(super) duration_s: f64,
    /// Rotation by the gyro (rad, base axes), without holes.
    pub(super) turned: Option<Vector3<f64>>,
    /// Standard deviation of that rotation, as the samples of the gyro scatter (rad).
    pub(super) turned_noise: f64,
    /// Angular velocity at both ends (rad/s, base axes).
    pub(super) turning: [Vector3<f64>; 2],
    /// Attitude of the base at both ends; its up direction is measured.
    pub(super) attitude: Option<[UnitQuaternion<f64>; 2]>,
    /// Standard deviation of an attitude, as its samples scatter (rad).
    pub(super) attitude_noise: f64,
    /// Mean specific force and up direction (base axes), and the standard deviation of the former's mean as its samples
    /// scatter (m/s^2).
    pub(super) force: Option<Vector3<f64>>,
    pub(super) up: Option<Vector3<f64>>,
    /// Standard deviation of an up direction that was carried on by the gyro (rad); `None` where the attitude measures it.
    pub(super) carried: Option<f64>,
    pub(super) force_scatter: Vector3<f64>,
    /// Velocity by the odometry at both ends (m/s), and its turn about z (rad), if the odometry measures that.
    pub(super) velocity: Option<[Vector3<f64>; 2]>,
    /// Standard deviation of the difference of those velocities in each component, as the samples scatter (m/s).
    pub(super) velocity_noise: f64,
    pub(super) odometry_turned: Option<f64>,
    /// Distance by the odometry (m).
    pub(super) travelled: Option<f64>,
    /// Motion by the wheels at both ends, their rolled distance (m), and the turn of the machine by them (rad).
    pub(super) rolled: Option<[Rolled; 2]>,
    pub(super) distance: f64,
    pub(super) by_speeds: Option<f64>,
    pub(super) by_steering: Option<f64>,
    /// Contradiction between the speeds of the wheels (m/s).
    pub(super) slip: f64,
}

#[derive(Debug, Clone, Default)]
struct Imu {
    last_ns: Option<i64>,
    is_broken: bool,
    rotation: UnitQuaternion<f64>,
    first: Option<Reading>,
    last: Option<Reading>,
    force: Vector3<f64>,
    squares: Vector3<f64>,
    up: Vector3<f64>,
    has_attitude: bool,
    count: f64,
    /// Rotation by the attitude beyond that by the gyro in the last step, and its variance.
    beyond: Option<Vector3<f64>>,
    noise: f64,
    /// Sum of squares of the differences between neighbouring angular velocities.
    scatter: f64,
    /// Sums of the angular velocity and of its square.
    turning: Vector3<f64>,
    turning_squares: f64,
    /// Whether the IMU has ever measured an attitude: only without an attitude the gyro carries its up direction on.
    measures_attitude: bool,
    inclination: Option<Inclination>,
}

#[derive(Debug, Clone, Copy)]
struct Reading {
    turning: Vector3<f64>,
    attitude: Option<UnitQuaternion<f64>>,
}

#[derive(Debug, Clone, Default)]
struct Odometry {
    last: Option<(i64, Vector3<f64>)>,
    before: Option<(i64, Vector3<f64>)>,
    turning: Option<f64>,
    turned: f64,
    has_turned: bool,
    way: f64,
    is_broken: bool,
    first: Option<Vector3<f64>>,
    /// Variance of a velocity, and that of the first one of the window.
    noise: f64,
    first_variance: f64,
}

#[derive(Debug, Clone, Default)]
struct Wheels {
    last: Option<(i64, Rolled)>,
    first: Option<Rolled>,
    distance: f64,
    turned: [Option<f64>; 2],
    slip: f64,
    is_broken: bool,
}

impl Accumulated {
    pub(super) fn new(base_from_imu: Matrix3<f64>, max_gap_s: f64) -> Self {
        Self {
            base_from_imu,
            max_gap_ns: (max_gap_s * 1e9) as i64,
            imu: Imu::new(),
            odometry: Odometry::default(),
            wheels: Wheels::default(),
        }
    }

    /// Takes a sample of the IMU that is sound: specific force, angular velocity and attitude, if it has one.
    pub(super) fn take_imu(
        &mut self,
        stamp_ns: i64,
        [force, turning]: [&Vector3<f64>; 2],
        xyzw: Option<&[f64]>,
    ) {
        let it = &mut self.imu;
        let (force, turning) = (self.base_from_imu * force, self.base_from_imu * turning);
        let attitude = xyzw.filter(|xyzw| tilt_is_measured(xyzw)).and_then(|xyzw| {
            let &[x, y, z, w] = xyzw else { return None };
            let of_imu = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 0.1)?;
            let imu_from_base = UnitQuaternion::from_matrix(&self.base_from_imu.transpose());
            Some(of_imu * imu_from_base)
        });
        it.measures_attitude |= attitude.is_some();
        let reading = Reading { turning, attitude };
        let step_ns = it
            .last_ns
            .replace(stamp_ns)
            .map(|last| stamp_ns.saturating_sub(last));
        it.is_broken |= step_ns.is_some_and(|step| step > self.max_gap_ns);
        if let (Some(last), Some(step_ns)) = (it.last, step_ns) {
            let mean = (last.turning + turning) * (0.5e-9 * step_ns as f64);
            it.rotation *= UnitQuaternion::from_scaled_axis(mean);
            it.scatter += (turning - last.turning).norm_squared();
            if let Some(inclination) = &mut it.inclination {
                it.up += inclination.turn(&mean, 1e-9 * step_ns as f64);
            }
            if let (Some(before), Some(now)) = (last.attitude, attitude) {
                let beyond = (before.inverse() * now).scaled_axis() - mean;
                if let Some(before) = it.beyond.replace(beyond) {
                    note_noise(&mut it.noise, &(beyond - before));
                }
            }
        }
        it.first.get_or_insert(reading);
        it.last = Some(reading);
        it.has_attitude &= attitude.is_some();
        if let Some(attitude) = attitude {
            it.up += attitude.inverse_transform_vector(&Vector3::z());
        }
        it.turning += turning;
        it.turning_squares += turning.norm_squared();
        it.force += force;
        it.squares += force.component_mul(&force);
        it.count += 1.0;
    }

    /// A sample of the IMU is missing or faulty.
    pub(super) fn break_imu(&mut self) {
        self.imu.is_broken = true;
    }

    /// Takes velocity (m/s, base axes) and angular velocity about z (rad/s, NaN: not measured) of the odometry.
    pub(super) fn take_odometry(&mut self, stamp_ns: i64, velocity: Vector3<f64>, turning: f64) {
        let it = &mut self.odometry;
        if let Some((last_ns, last)) = it.last {
            let step_ns = stamp_ns.saturating_sub(last_ns);
            it.is_broken |= step_ns > self.max_gap_ns;
            let step_s = step_ns as f64 * 1e-9;
            it.way += 0.5 * (last.x + velocity.x) * step_s;
            match it.turning {
                Some(before) if turning.is_finite() => {
                    it.turned += 0.5 * (before + turning) * step_s;
                }
                _ => it.has_turned = false,
            }
            if let Some((_, before)) = it.before {
                note_noise(&mut it.noise, &(velocity - 2.0 * last + before));
            }
            it.before = it.last;
        }
        it.turning = Some(turning).filter(|turning| turning.is_finite());
        it.last = Some((stamp_ns, velocity));
    }

    pub(super) fn break_odometry(&mut self) {
        self.odometry.is_broken = true;
    }

    /// Takes the motion by the wheels; `None` if it is unknown.
    pub(super) fn take_wheels(&mut self, stamp_ns: i64, rolled: Option<Rolled>) {
        let it = &mut self.wheels;
        let Some(rolled) = rolled else {
            it.is_broken = true;
            it.last = None;
            return;
        };
        if let Some((last_ns, last)) = it.last {
            let step_ns = stamp_ns.saturating_sub(last_ns);
            it.is_broken |= step_ns > self.max_gap_ns;
            let step_s = step_ns as f64 * 1e-9;
            it.distance += 0.5 * (last.speed + rolled.speed) * step_s;
            let turns = [
                (last.by_speeds, rolled.by_speeds),
                (last.by_steering, rolled.by_steering),
            ];
            for (sum, (before, now)) in it.turned.iter_mut().zip(turns) {
                *sum = match (*sum, before, now) {
                    (Some(sum), Some(a), Some(b)) => Some(sum + 0.5 * (a + b) * step_s),
                    _ => None,
                };
            }
        }
        it.slip = it.slip.max(rolled.slip);
        it.last = Some((stamp_ns, rolled));
    }

    /// Returns the velocity of the base by the odometry or, without that, by the wheels; of this stamp and by nothing where neither is
    /// measured about it.
    pub(super) fn velocity(&self, stamp_ns: i64) -> ShownVelocity {
        let is_fresh = |at_ns: i64| stamp_ns.saturating_sub(at_ns).abs() <= self.max_gap_ns;
        let odometry = self.odometry.last.filter(|(at_ns, _)| is_fresh(*at_ns));
        let odometry = odometry.map(|(stamp_ns, velocity)| ShownVelocity {
            stamp_ns,
            velocity,
            sigma: self.odometry.noise.sqrt(),
            by: ShownBy::Odometry,
        });
        let wheels = self.wheels.last.filter(|(at_ns, _)| is_fresh(*at_ns));
        let wheels = wheels.map(|(stamp_ns, rolled)| {
            let [forward, across] = rolled
                .velocity
                .map_or([rolled.speed, 0.0], |it| [it.x, it.y]);
            ShownVelocity {
                stamp_ns,
                velocity: Vector3::new(forward, across, 0.0),
                sigma: rolled.slip,
                by: match rolled.velocity {
                    Some(_) => ShownBy::Wheels,
                    None => ShownBy::WheelsAlong,
                },
            }
        });
        odometry.or(wheels).unwrap_or(ShownVelocity {
            stamp_ns,
            velocity: Vector3::zeros(),
            sigma: 0.0,
            by: ShownBy::Nothing,
        })
    }

    /// Returns the up direction by the gyro of an IMU that measures no attitude (base axes); `None` before it has rested.
    pub(super) fn carried_up(&self) -> Option<Vector3<f64>> {
        let carried = self.imu.inclination.as_ref();
        carried
            .filter(|_| !self.imu.measures_attitude)
            .map(Inclination::up)
    }

    /// The speed of the machine by its wheels and its odometry, whichever is faster (m/s); `None` where neither is known.
    pub(super) fn speed(&self) -> Option<f64> {
        let wheels = self.wheels.last.map(|(_, rolled)| rolled.fastest);
        let odometry = self.odometry.last.map(|(_, velocity)| velocity.norm());
        wheels.into_iter().chain(odometry).reduce(f64::max)
    }

    /// Ends the window at `stamp_ns` and begins the next one.
    pub(super) fn finish(&mut self, start_ns: i64, stamp_ns: i64) -> Window {
        let is_fresh = |at_ns: i64| stamp_ns.saturating_sub(at_ns).abs() <= self.max_gap_ns;
        let imu = &mut self.imu;
        let whole = !imu.is_broken && imu.last_ns.is_some_and(is_fresh) && imu.count > 2.0;
        let ends = imu.first.zip(imu.last);
        let mean = imu.force / imu.count;
        let variance = (imu.squares / imu.count - mean.component_mul(&mean)).map(|v| v.max(0.0));
        let attitude = ends.and_then(|(a, b)| Some([a.attitude?, b.attitude?]));
        let attitude = attitude.filter(|_| whole && imu.has_attitude);
        let odometry = &mut self.odometry;
        let known = (!odometry.is_broken).then_some(odometry.last).flatten();
        let known = known.filter(|(at_ns, _)| is_fresh(*at_ns));
        let velocity = known.and_then(|(at_ns, velocity)| {
            let (before_ns, before) = odometry.before?;
            let ahead = stamp_ns.saturating_sub(at_ns) as f64;
            let steps = ahead.clamp(0.0, 5e7) / at_ns.saturating_sub(before_ns).max(1) as f64;
            let variance = odometry.noise * ((1.0 + steps).powi(2) + steps * steps);
            Some((velocity + (velocity - before) * steps, variance))
        });
        let (velocity, last_variance) =
            (velocity.map(|(v, _)| v), velocity.map_or(0.0, |(_, s)| s));
        let velocities = odometry.first.zip(velocity).map(|(a, b)| [a, b]);
        let velocity_noise = (odometry.first_variance + last_variance).sqrt();
        let wheels = &mut self.wheels;
        let rolled = (!wheels.is_broken).then_some(wheels.last).flatten();
        let rolled = rolled.filter(|(at_ns, _)| is_fresh(*at_ns));
        let duration_s = stamp_ns.saturating_sub(start_ns) as f64 * 1e-9;
        let turned = whole.then(|| imu.rotation.scaled_axis());
        let turned_noise = {
            // Neighbouring samples differ by noise: the variance of a difference is twice that.
            let of_sample = (imu.scatter / (6.0 * imu.count)).sqrt();
            of_sample * duration_s / imu.count.sqrt()
        };
        imu.inclination = (imu.inclination).filter(|_| whole && !imu.measures_attitude);
        if let (Some(inclination), Some(turned)) = (&mut imu.inclination, &turned) {
            inclination.doubt(turned, turned_noise);
        }
        let carried = imu.inclination.map(|it| it.sigma());
        let window = Window {
            start_ns,
            duration_s,
            turned,
            turned_noise,
            turning: ends.map_or([Vector3::zeros(); 2], |(a, b)| [a.turning, b.turning]),
            attitude,
            attitude_noise: imu.noise.sqrt(),
            force: whole.then_some(mean),
            up: (whole && (imu.has_attitude || carried.is_some())).then(|| imu.up / imu.count),
            carried,
            force_scatter: (variance / imu.count).map(f64::sqrt),
            velocity: velocities,
            velocity_noise,
            odometry_turned: known
                .filter(|_| odometry.has_turned)
                .map(|_| odometry.turned),
            travelled: known
                .filter(|_| odometry.first.is_some())
                .map(|_| odometry.way),
            rolled: wheels
                .first
                .zip(rolled.map(|(_, it)| it))
                .map(|(a, b)| [a, b]),
            distance: wheels.distance,
            by_speeds: wheels.turned[0],
            by_steering: wheels.turned[1],
            slip: wheels.slip,
        };
        // In the first window nothing is known of its start.
        let evenly = |way: f64, start: Option<f64>, end: f64, noise: f64| {
            let mean = way / duration_s;
            let changes = end - start.unwrap_or(mean);
            mean.abs() < CREEPS && changes.abs() < CREEPS_EVENLY.max(3.0 * noise)
        };
        let by_odometry = velocity.map(|velocity| {
            let start = odometry.first.map(|first| first.x);
            evenly(odometry.way, start, velocity.x, velocity_noise)
        });
        let by_wheels = rolled.map(|(_, it)| {
            let start = wheels.first.map(|first| first.speed);
            evenly(wheels.distance, start, it.speed, 0.0)
        });
        let known = [by_odometry, by_wheels];
        let stands = known.contains(&Some(true)) && !known.contains(&Some(false));
        let rest = (whole && !imu.measures_attitude && stands)
            .then(|| imu.rest(duration_s, turned_noise, velocity_noise))
            .flatten();
        if let Some(rest) = rest {
            match &mut imu.inclination {
                Some(inclination) => inclination.take(&rest),
                None => imu.inclination = Inclination::at(&rest),
            }
        }
        imu.begin();
        odometry.first = velocity;
        odometry.first_variance = last_variance;
        (odometry.way, odometry.turned) = (0.0, 0.0);
        odometry.has_turned = odometry.turning.is_some();
        odometry.is_broken = false;
        wheels.first = rolled.map(|(_, it)| it);
        wheels.turned = [wheels.first.map(|_| 0.0); 2];
        (wheels.distance, wheels.slip) = (0.0, 0.0);
        wheels.is_broken = false;
        window
    }
}

impl Imu {
    /// Returns the IMU's measurement of a machine at rest; `None` if the machine turned. `turned_noise`: standard deviation of
    /// the rotation in a window so long (rad).
    fn rest(&self, duration_s: f64, turned_noise: f64, velocity_noise: f64) -> Option<Rest> {
        let (force, turning) = (self.force / self.count, self.turning / self.count);
        let scatter = self.squares.sum() / self.count - force.norm_squared();
        // Of a component. What is not noise of samples is motion, whose mean is as large.
        let turns = (self.turning_squares / self.count - turning.norm_squared()) / 3.0;
        let noise = turned_noise / duration_s;
        let stirs = (turns - noise * noise * self.count).max(0.0);
        (turning.norm() < RESTS_TURNING).then(|| Rest {
            force,
            // what may have been an acceleration
            force_scatter: scatter.max(0.0).sqrt().hypot(velocity_noise / duration_s),
            turning,
            turning_scatter: stirs.sqrt().hypot(noise),
        })
    }

    fn new() -> Self {
        Self {
            has_attitude: true,
            ..Self::default()
        }
    }

    /// Begins the next window with the last reading.
    fn begin(&mut self) {
        *self = Self {
            last_ns: self.last_ns,
            first: self.last,
            last: self.last,
            noise: self.noise,
            measures_attitude: self.measures_attitude,
            inclination: self.inclination,
            ..Self::new()
        };
    }
}

/// Takes `n_i - 2 n_(i-1) + n_(i-2)` of the white noise n of a vector to the variance of its components: six times that each.
fn note_noise(variance: &mut f64, second_difference: &Vector3<f64>) {
    let seen = second_difference.norm_squared() / 18.0;
    *variance += NOISE_WEIGHT * (seen - *variance);
}
