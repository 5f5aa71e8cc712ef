//! The up direction by the integrated angular velocity, levelled by the specific force.
//!
//! In base axes a fixed direction turns against the platform, `du/dt = -(w - b) x u`. A Kalman filter corrects the tilt
//! and the bias b; its variances are the same about all axes:
//! ```text
//!     [tilt, bias]' = [[1, dt], [0, 1]] [tilt, bias],     measured tilt: u x f / |f|, and w itself of a quiet machine
//! ```
//! While a platform falls about an edge, its specific force hardly turns: only one that is quiet on standing wheels is
//! trusted, that of a machine in motion is a weak hint against drift.

use nalgebra::Vector3;

/// Angular velocities beyond this are no motion of a machine (rad/s).
const LARGEST_RATE: f64 = 6.0;
/// Time constants of the filters that show a quiet machine (s).
const FAST_S: f64 = 0.15;
const SLOW_S: f64 = 1.0;
/// Largest differences between both filters on a quiet machine: angular velocity (rad/s), direction of the specific force (rad),
/// and its length from gravity (share).
const QUIET_RATE: f64 = 0.25 * DEGREE;
const QUIET_TURN: f64 = 0.25 * DEGREE;
const QUIET_SHARE: f64 = 0.05;
/// Largest bias of a gyro (rad/s), and the largest that is not taken for a turn where nothing shows that the wheels stand.
const LARGEST_BIAS: f64 = 0.2;
const USUAL_BIAS: f64 = 0.05;
/// Share of gravity by which the length of a specific force differs from it that is no weight: a knock, an impact, a fall.
const NO_WEIGHT: f64 = 0.5;
/// Time for which a machine must be quiet (s).
const QUIET_S: f64 = 0.6;
/// Standard deviation of the tilt by the specific force, and the time in which its errors are one (rad, s): quiet, and moving.
const QUIET_TILT: (f64, f64) = (0.5 * DEGREE, 0.5);
const MOVING_TILT: (f64, f64) = (8.0 * DEGREE, 1.0);
/// Standard deviation of the bias by the angular velocity of a quiet machine, and the time in which its errors are one (rad/s,
/// s).
const QUIET_BIAS: (f64, f64) = (0.05 * DEGREE, 1.0);
/// Standard deviations at the first sample: tilt by the specific force, tilt by the attitude (rad), bias (rad/s).
const FIRST_TILT: f64 = 12.0 * DEGREE;
const FIRST_ATTITUDE: f64 = 3.0 * DEGREE;
const FIRST_BIAS: f64 = 0.02;
/// Spectral densities of the drift of the tilt (rad^2/s) and of the bias (rad^2/s^3).
const TILT_DRIFT: f64 = 3e-6;
const BIAS_DRIFT: f64 = 1e-8;
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// The up direction by the gyro.
#[derive(Debug, Clone)]
pub(super) struct UpByGyro {
    gravity: f64,
    max_gap_s: f64,
    last: Option<(i64, Vector3<f64>)>,
    /// The last two measured values, the later one first.
    measured: [Vector3<f64>; 2],
    up: Option<Vector3<f64>>,
    bias: Vector3<f64>,
    /// Variances: of the tilt, with the bias, of the bias.
    variances: [f64; 3],
    rate: [Vector3<f64>; 2],
    /// Specific force, fast and slow; the slow one is of weights alone, since this time at most (s).
    force: Option<[Vector3<f64>; 2]>,
    averaged_s: f64,
    /// Time for which the machine has been quiet (s).
    quiet_s: f64,
}

/// Up direction and angular velocity by the gyro or the attitude, after a sample.
#[derive(Debug, Clone, Copy)]
pub(super) struct UpSample {
    pub(super) dt: f64,
    pub(super) up: Vector3<f64>,
    pub(super) sigma: f64,
    /// Angular velocity (rad/s, base axes): without the bias of the gyro; by the attitude that across the up direction.
    pub(super) rate: Vector3<f64>,
    pub(super) is_quiet: bool,
}

impl UpByGyro {
    pub(super) fn new(gravity: f64, max_gap_s: f64) -> Self {
        Self {
            gravity,
            max_gap_s,
            last: None,
            measured: [Vector3::zeros(); 2],
            up: None,
            bias: Vector3::zeros(),
            variances: [0.0, 0.0, FIRST_BIAS * FIRST_BIAS],
            rate: [Vector3::zeros(); 2],
            force: None,
            averaged_s: 0.0,
            quiet_s: 0.0,
        }
    }

    /// Direction of the specific force, smoothed; `None` in free fall and without it.
    pub(super) fn force_direction(&self) -> Option<Vector3<f64>> {
        let [fast, _] = self.force?;
        fast.try_normalize(0.3 * self.gravity)
    }

    /// Returns the difference of the length of the specific force from gravity, as a share of gravity; `None` without a specific
    /// force.
    pub(super) fn weight_share(&self) -> Option<f64> {
        let [fast, _] = self.force?;
        Some(fast.norm() / self.gravity - 1.0)
    }

    /// Takes angular velocity and specific force (base axes). `speed` is that of the machine, if it is known; `attitude` the up
    /// direction by the attitude, if there is one.
    pub(super) fn step(
        &mut self,
        stamp_ns: i64,
        turning: &Vector3<f64>,
        force: Option<Vector3<f64>>,
        speed: Option<f64>,
        attitude: Option<Vector3<f64>>,
    ) -> Option<UpSample> {
        if !turning.iter().all(|w| w.abs() <= LARGEST_RATE) {
            return None;
        }
        let last = self.last.filter(|(last_ns, _)| stamp_ns > *last_ns);
        if self.last.is_some() && last.is_none() {
            return None;
        }
        let step =
            last.map(|(last_ns, before)| (stamp_ns.saturating_sub(last_ns) as f64 * 1e-9, before));
        let Some((dt, before)) = step.filter(|(dt, _)| *dt <= self.max_gap_s) else {
            self.begin(stamp_ns, turning, force, attitude);
            return None;
        };
        let [one, two] = self.measured;
        self.measured = [*turning, one];
        // a single wrong sample turns nothing
        let turning = turning.zip_zip_map(&one, &two, median);
        self.last = Some((stamp_ns, turning));
        let rate = (turning + before) * 0.5 - self.bias;
        let mut up = self.up?;
        up -= rate.cross(&up) * dt;
        self.up = Some(up.normalize());
        let [tilt, both, bias] = self.variances;
        self.variances = [
            tilt + dt * (2.0 * both + dt * bias) + TILT_DRIFT * dt,
            both + dt * bias,
            bias + BIAS_DRIFT * dt,
        ];
        let force = force.filter(|force| force.iter().all(|f| f.is_finite()));
        self.watch_quiet(dt, &turning, force.as_ref(), speed);
        self.level(dt, speed, attitude);
        Some(UpSample {
            dt,
            up: self.up?,
            sigma: self.variances[0].max(0.0).sqrt(),
            rate: turning - self.bias,
            is_quiet: self.quiet_s >= QUIET_S,
        })
    }

    fn begin(
        &mut self,
        stamp_ns: i64,
        turning: &Vector3<f64>,
        force: Option<Vector3<f64>>,
        attitude: Option<Vector3<f64>>,
    ) {
        self.last = Some((stamp_ns, *turning));
        self.measured = [*turning; 2];
        self.rate = [*turning; 2];
        let force = force.filter(|force| force.iter().all(|f| f.is_finite()));
        let weight = force.filter(|force| self.is_weight(force));
        self.force = weight.map(|force| [force; 2]);
        (self.averaged_s, self.quiet_s) = (0.0, 0.0);
        let by_force = self.force_direction().map(|up| (up, FIRST_TILT));
        let by_attitude = attitude.map(|up| (up, FIRST_ATTITUDE));
        let (up, sigma) = (by_attitude.or(by_force)).unwrap_or((Vector3::z(), 2.0 * FIRST_TILT));
        self.up = Some(up);
        self.variances = [sigma * sigma, 0.0, self.variances[2]];
    }

    fn watch_quiet(
        &mut self,
        dt: f64,
        turning: &Vector3<f64>,
        force: Option<&Vector3<f64>>,
        speed: Option<f64>,
    ) {
        let shares = [FAST_S, SLOW_S].map(|time_s| 1.0 - (-dt / time_s).exp());
        for (rate, share) in self.rate.iter_mut().zip(shares) {
            *rate += (turning - *rate) * share;
        }
        if let Some(force) = force {
            self.follow_force(dt, force, shares);
        }
        let [fast, slow] = &self.rate;
        let bias = match speed {
            Some(0.0) => LARGEST_BIAS,
            Some(_) => 0.0,
            None => USUAL_BIAS,
        };
        let is_still = (fast - slow).norm() < QUIET_RATE && slow.norm() < bias;
        let is_steady = self.force.is_some_and(|[fast, slow]| {
            let share = fast.norm() / self.gravity - 1.0;
            let turned = fast.cross(&slow).norm() / (fast.norm() * slow.norm());
            share.abs() < QUIET_SHARE && turned < QUIET_TURN
        });
        self.quiet_s = match is_still && is_steady && force.is_some() {
            true => self.quiet_s + dt,
            false => 0.0,
        };
    }

    /// Follows the specific force by a fast and a slow mean. Until the slow mean is known for long, it is that of all weights so
    /// far: none of them counts more than the others.
    fn follow_force(&mut self, dt: f64, force: &Vector3<f64>, [fast_share, slow_share]: [f64; 2]) {
        let is_weight = self.is_weight(force);
        if self.force.is_none() && !is_weight {
            return;
        }
        let [fast, slow] = self.force.get_or_insert([*force; 2]);
        *fast += (force - *fast) * fast_share;
        if is_weight {
            self.averaged_s += dt;
            *slow += (force - *slow) * slow_share.max(dt / (self.averaged_s + dt));
        }
    }

    fn is_weight(&self, force: &Vector3<f64>) -> bool {
        (force.norm() / self.gravity - 1.0).abs() <= NO_WEIGHT
    }

    /// Corrects tilt and bias.
    fn level(&mut self, dt: f64, speed: Option<f64>, attitude: Option<Vector3<f64>>) {
        let is_quiet = self.quiet_s >= QUIET_S;
        let force = self.force.map(|[fast, _]| fast);
        let is_weight = force
            .is_some_and(|force| (force.norm() / self.gravity - 1.0).abs() < 2.0 * QUIET_SHARE);
        let (sigma, time_s) = if is_quiet { QUIET_TILT } else { MOVING_TILT };
        // a platform that stands and rotates is not levelled: its specific force hides the rotation
        let moves = speed.is_none_or(|speed| speed > 0.0);
        let measured = match force {
            Some(_) => self
                .force_direction()
                .filter(|_| is_quiet || (is_weight && moves)),
            None => attitude,
        };
        if let (Some(up), Some(measured)) = (self.up, measured) {
            let apart = up.cross(&measured);
            let variance = sigma * sigma * (time_s / dt).max(1.0);
            if is_quiet && apart.norm_squared() > 9.0 * (self.variances[0] + sigma * sigma) {
                // what was integrated is wrong, by more than it could
                self.variances[0] += apart.norm_squared();
            }
            let [tilt, both, bias] = self.variances;
            let gain = [tilt, both].map(|v| v / (tilt + variance));
            self.up = (up + (apart * gain[0]).cross(&up)).try_normalize(1e-6);
            self.bias += apart * gain[1];
            self.variances = [
                tilt * (1.0 - gain[0]),
                both * (1.0 - gain[0]),
                bias - gain[1] * both,
            ];
        }
        if is_quiet {
            let (sigma, time_s) = QUIET_BIAS;
            let variance = sigma * sigma * (time_s / dt).max(1.0);
            let apart = self.rate[1] - self.bias;
            if apart.norm_squared() > 9.0 * (self.variances[2] + sigma * sigma) {
                self.variances[2] += apart.norm_squared();
            }
            let [tilt, both, bias] = self.variances;
            let gain = [both, bias].map(|v| v / (bias + variance));
            if let Some(up) = self.up {
                self.up = (up + (apart * gain[0]).cross(&up)).try_normalize(1e-6);
            }
            self.bias += apart * gain[1];
            self.variances = [
                tilt - gain[0] * both,
                both * (1.0 - gain[1]),
                bias * (1.0 - gain[1]),
            ];
        }
    }
}

fn median(a: f64, b: f64, c: f64) -> f64 {
    a.max(b).min(a.min(b).max(c))
}
