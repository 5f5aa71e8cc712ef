//! The up direction of a platform whose IMU measures no attitude: that of the specific force at rest, carried on by the gyro.

use nalgebra::{Matrix2, UnitQuaternion, Vector2, Vector3};

/// Bias of a gyro before it was seen at rest (rad/s), and its random walk (rad/s per square root of a second).
const BIAS: f64 = 0.01;
const BIAS_DRIFT: f64 = 1e-4;
/// Share of a rotation by which a gyro errs: its scale, and axes that are not square.
const GYRO_SHARE: f64 = 0.02;
/// Inclination by which the mean specific force of a platform at rest differs from up (rad): it rocks.
const ROCKS: f64 = 0.005;
/// Rotation by the gyro of a platform at rest that has other causes than its bias (rad/s).
const STIRS: f64 = 5e-4;

/// Measurement of a window of time without acceleration: means and standard deviations of samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rest {
    /// Specific force (m/s^2, base axes).
    pub(super) force: Vector3<f64>,
    pub(super) force_scatter: f64,
    /// Angular velocity (rad/s, base axes).
    pub(super) turning: Vector3<f64>,
    pub(super) turning_scatter: f64,
}

/// The up direction and the bias of the gyro, in base axes.
///
/// Both horizontal components err alike, by e in inclination and by b in bias. At rest the specific force f shows up, and the gyro w
/// its bias:
/// ```text
///     de/dt = b,     f / |f| - u = e + noise,     w - bias = b + noise
/// ```
/// A Kalman filter follows the two.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inclination {
    up: Vector3<f64>,
    bias: Vector3<f64>,
    covariance: Matrix2<f64>,
}

impl Inclination {
    /// Returns the inclination by the measurement of a rest.
    pub(super) fn at(rest: &Rest) -> Option<Self> {
        let up = rest.force.try_normalize(1e-9)?;
        let tilt = rest.tilt_sigma();
        let mut it = Self {
            up,
            bias: Vector3::zeros(),
            covariance: Matrix2::new(tilt * tilt, 0.0, 0.0, BIAS * BIAS),
        };
        it.take_bias(rest);
        Some(it)
    }

    /// Carries the up direction on over a step by the rotation of the gyro (rad), and returns it.
    pub(super) fn turn(&mut self, by_gyro: &Vector3<f64>, dt: f64) -> Vector3<f64> {
        let turn = UnitQuaternion::from_scaled_axis(self.bias * dt - by_gyro);
        self.up = turn * self.up;
        let step = Matrix2::new(1.0, dt, 0.0, 1.0);
        self.covariance = step * self.covariance * step.transpose();
        self.covariance[(1, 1)] += BIAS_DRIFT * BIAS_DRIFT * dt;
        self.up
    }

    /// Widens the covariance by the errors of a rotation of the gyro in a window (rad), with this standard deviation by its
    /// noise.
    pub(super) fn doubt(&mut self, turned: &Vector3<f64>, noise: f64) {
        let share = GYRO_SHARE * turned.norm();
        self.covariance[(0, 0)] += share * share + noise * noise;
    }

    /// The up direction.
    pub(super) fn up(&self) -> Vector3<f64> {
        self.up
    }

    /// Standard deviation of the inclination (rad).
    pub(super) fn sigma(&self) -> f64 {
        self.covariance[(0, 0)].sqrt()
    }

    /// Takes a rest.
    pub(super) fn take(&mut self, rest: &Rest) {
        let Some(up) = rest.force.try_normalize(1e-9) else {
            return;
        };
        let apart = up - self.up;
        let gain = self.gain(0, rest.tilt_sigma());
        // A bias b turns up by b x up.
        self.bias += self.up.cross(&apart) * gain[1];
        self.up = (self.up + apart * gain[0]).normalize();
        self.take_bias(rest);
    }

    fn take_bias(&mut self, rest: &Rest) {
        let apart = rest.turning - self.bias;
        let gain = self.gain(1, rest.turning_scatter.hypot(STIRS));
        self.up = (self.up + apart.cross(&self.up) * gain[0]).normalize();
        self.bias += apart * gain[1];
    }

    /// Kalman gains of a measurement of one of the two with this standard deviation, and the covariance after it.
    fn gain(&mut self, measured: usize, sigma: f64) -> Vector2<f64> {
        let spread: Vector2<f64> = self.covariance.column(measured).into();
        let gain = spread / (spread[measured] + sigma * sigma);
        self.covariance -= gain * spread.transpose();
        gain
    }
}

impl Rest {
    fn tilt_sigma(&self) -> f64 {
        (self.force_scatter / self.force.norm()).hypot(ROCKS)
    }
}
