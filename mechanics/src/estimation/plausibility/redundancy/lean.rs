//! The motion of the arm compared with how the platform leans on its tyres, as the gyro measures it.
//!
//! The lean predicted from the joints, a, and the integral of the angular velocity, b, pass the same band-pass
//! filter. About each of the axes x and y, two statements are compared: the platform follows the arm, b = a, or it
//! does not, with the boundary where it follows by a quarter, since the stiffness of tyres and ground is known
//! roughly only.
//! ```text
//!     d = (a^2 - 4 a b) / (2 s^2)
//!     s^2 = s0^2 + ((a^2 + b^2) + (a'^2 + b'^2) / 4) / 4
//!     S <- clamp(S + d dt / T)
//! ```
//! with the values ' about the other axis, T the time over which errors are alike, and s0 the lean that has other
//! causes: noise of the gyro, and the ground while the machine travels and shortly afterwards. S is the logarithm of a
//! likelihood ratio since the evidence began. A wrong sign of a joint or of the IMU gives b = -a, a gyro that measures
//! nothing b = 0. Without motion of the arm a is zero, and so is d.
//!
//! Conversely, where an encoder of the arm repeats itself bit for bit while another one does not, a platform that leans
//! without the arm shows that it has stopped:
//! ```text
//!     d = (b^2 - 4 a b) / (2 u^2),    u^2 = u0^2 + s0^2 + (b^2 + (a'^2 + b'^2) / 4) / 4
//! ```
//! Nothing is gained while the machine travels. A load picked up meanwhile is not told apart.
//!
//! A platform that turns farther than the tyres can give way tips over, or stands on ground that moves. Then no
//! evidence is taken: a fall must not be called a fault of the sensors.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::super::fault::{Amount, Component};
use super::super::notice::{Found, Limits, Notice};
use super::encoders::Encoders;
use super::lean_model::{LeanModel, SMOOTHED_S};
use super::low_pass::LowPass;
use super::travel::Travel;
use crate::machine::{FaultKind, Machine, rotation_in_body};

/// Time constant of both high-pass filters (s).
const BAND_S: f64 = 1.0;
/// Time over which errors are alike (s).
const ALIKE_S: f64 = 0.25;
/// Evidence from which the two contradict each other: odds of 22,000 to 1 if the errors were as assumed above. On the
/// good simulated logs it stays below; how often it is reached in the field is not known.
const CONTRADICTED: f64 = 10.0;
/// Evidence below which they no longer do.
const CLEARED: f64 = 2.0;
/// Largest evidence, so that a fault that ends can be forgotten.
const LARGEST: f64 = 24.0;
/// Lean of a standing platform that has other causes (rad).
const UNEXPLAINED: f64 = 2e-4;
/// Lean that no joint need explain (rad): people and wind move a machine too.
const UNMEASURED: f64 = 4e-4;
/// The same as [`UNEXPLAINED`] while it travels (rad), from this speed on (m/s), and how long it lasts afterwards (s).
const UNEVEN: f64 = 2e-3;
const TRAVELLING: f64 = 0.2;
const ROCKING_S: f64 = 0.7;
/// Time after a gap or a faulty sample in which the filters still remember it (s).
const FORGOTTEN_S: f64 = 3.0;
/// Time before the filters have settled (s).
const WARM_UP_S: f64 = 0.5;
/// Time over which the bias of the gyro is averaged at the start (s).
const BIAS_S: f64 = 0.4;
/// Weight of a sample in the noise of the gyro.
const NOISE_WEIGHT: f64 = 1.0 / 64.0;

/// State of the check.
#[derive(Debug, Clone)]
pub(in super::super) struct LeanWatch {
    base_from_imu: Matrix3<f64>,
    model: LeanModel,
    up: Vector3<f64>,
    predicted: Band,
    /// Predicted lean in the band (rad), and its stamp.
    expected: Option<(i64, Vector2<f64>)>,
    joints_ns: Option<i64>,
    encoders: Encoders,
    /// No evidence is taken before this stamp.
    silent_until_ns: i64,
    gyro: Gyro,
    last_ns: Option<i64>,
    /// How much the ground may rock the platform, 0 to 1.
    rocking: f64,
    /// That the platform does not follow the arm, about each axis.
    evidence: [Evidence; 2],
    /// That it leans without the arm while an encoder repeats itself, about each axis.
    unmeasured: [Evidence; 2],
}

/// Two high-pass filters.
#[derive(Debug, Clone)]
struct Band([LowPass<2>; 2]);

/// The lean measured by the gyro.
#[derive(Debug, Clone)]
struct Gyro {
    smoothed: [LowPass<2>; 2],
    last: Option<Vector2<f64>>,
    /// Variance of a sample ((rad/s)^2).
    noise: f64,
    bias: Vector2<f64>,
    known_s: f64,
    /// Integral of the angular velocity, high-passed (rad).
    turned: Vector2<f64>,
    slow: LowPass<2>,
}

/// Evidence about one axis.
#[derive(Debug, Clone, Copy, Default)]
struct Evidence {
    value: f64,
    since_ns: i64,
    stands: bool,
}

impl LeanWatch {
    /// `None` where the model cannot be formed: see [`LeanModel::new`].
    pub(in super::super) fn new(machine: &Machine) -> Option<Self> {
        Some(Self {
            base_from_imu: rotation_in_body(machine.imu()),
            model: LeanModel::new(machine)?,
            up: Vector3::z(),
            predicted: Band::new(),
            expected: None,
            joints_ns: None,
            encoders: Encoders::new(machine),
            silent_until_ns: i64::MIN,
            gyro: Gyro::new(),
            last_ns: None,
            rocking: 1.0,
            evidence: [Evidence::default(); 2],
            unmeasured: [Evidence::default(); 2],
        })
    }

    /// A sample of the joints is faulty: what it would predict proves nothing, and neither does the evidence that has
    /// just begun.
    pub(in super::super) fn distrust_joints(&mut self, stamp_ns: i64) {
        self.model.reset();
        self.predicted = Band::new();
        self.expected = None;
        self.joints_ns = None;
        self.forget(stamp_ns);
    }

    fn forget(&mut self, stamp_ns: i64) {
        self.silent_until_ns = stamp_ns.saturating_add((FORGOTTEN_S * 1e9) as i64);
        let all = self.evidence.iter_mut().chain(&mut self.unmeasured);
        all.filter(|evidence| !evidence.stands)
            .for_each(|evidence| *evidence = Evidence::default());
    }

    /// Takes the joints of one sample: index, position and velocity of each.
    pub(in super::super) fn take_joints(
        &mut self,
        stamp_ns: i64,
        joints: impl Iterator<Item = (usize, f64, f64)>,
        limits: &Limits,
    ) {
        for (joint, position, rate) in joints {
            // Some loggers give no velocities: then the arm's momentum is unknown, and taken as constant.
            let rate = if rate.is_finite() { rate } else { 0.0 };
            self.model.set(joint, position, rate);
            self.encoders.take(stamp_ns, joint, position);
        }
        let step_s = (self.joints_ns.replace(stamp_ns))
            .map_or(0.0, |last_ns| limits.elapsed_s(last_ns, stamp_ns));
        if step_s > limits.max_gap_s {
            self.model.reset();
            self.predicted = Band::new();
            self.forget(stamp_ns);
        }
        let lean = self.model.lean(step_s, &self.up);
        let filtered = lean.map(|lean| self.predicted.step(step_s, &lean));
        self.expected = filtered.map(|lean| (stamp_ns, lean));
    }

    /// Takes specific force and angular velocity (IMU axes) and reports to `found` a platform that does not follow the
    /// arm.
    pub(in super::super) fn check(
        &mut self,
        stamp_ns: i64,
        [force, turning]: [&Vector3<f64>; 2],
        travel: &Travel,
        limits: &Limits,
        found: &mut Found<'_>,
    ) {
        let step_s = (self.last_ns.replace(stamp_ns))
            .map_or(0.0, |last_ns| limits.elapsed_s(last_ns, stamp_ns));
        if step_s > limits.max_gap_s {
            self.gyro = Gyro::new();
            self.forget(stamp_ns);
            return;
        }
        self.up = self.model.level(step_s, &(self.base_from_imu * force));
        let turning = self.base_from_imu * turning;
        let measured = self.gyro.step(step_s, &Vector2::new(turning.x, turning.y));
        let speed = travel.speed(stamp_ns, limits.max_gap_s);
        let rocks = speed.map_or(1.0, |speed| (speed / TRAVELLING).min(1.0));
        self.rocking = rocks.max(self.rocking * (-step_s / ROCKING_S).exp());
        let expected = self
            .expected
            .filter(|(at, _)| limits.elapsed_s(*at, stamp_ns).abs() <= limits.max_gap_s);
        if let (Some((_, expected)), Some(measured)) = (expected, measured)
            && stamp_ns >= self.silent_until_ns
        {
            let other = UNEXPLAINED + UNEVEN * self.rocking;
            let noise = other * other + self.gyro.angle_variance(step_s);
            self.weigh(stamp_ns, step_s, &expected, &measured, noise);
        }
        let all = self.evidence.iter_mut().chain(&mut self.unmeasured);
        let strongest = all
            .filter_map(Evidence::stands)
            .max_by(|a, b| a.value.total_cmp(&b.value));
        if let Some(evidence) = strongest {
            found(Notice {
                kind: FaultKind::Contradiction,
                component: Component::Value,
                since_ns: evidence.since_ns,
                measure: evidence.value,
                limit: CONTRADICTED,
                amount: Amount::default(),
            });
        }
    }

    /// Adds what this sample shows about each axis. A platform that turns farther than its tyres give way tips over,
    /// or the ground turns it: that is no evidence about sensors.
    fn weigh(
        &mut self,
        stamp_ns: i64,
        step_s: f64,
        expected: &Vector2<f64>,
        measured: &Vector2<f64>,
        noise: f64,
    ) {
        if measured.norm() > self.model.largest {
            self.evidence = [Evidence::default(); 2];
            self.unmeasured = [Evidence::default(); 2];
            self.silent_until_ns = stamp_ns.saturating_add((FORGOTTEN_S * 1e9) as i64);
            return;
        }
        let may_stand = self.encoders.one_may_have_stopped(stamp_ns);
        for axis in 0..2 {
            let size = |axis: usize| expected[axis].powi(2) + measured[axis].powi(2);
            let variance = noise + (size(axis) + 0.25 * size(1 - axis)) / 4.0;
            let (a, b) = (expected[axis], measured[axis]);
            let gained = (a * a - 4.0 * a * b) / (2.0 * variance);
            self.evidence[axis].add(stamp_ns, gained * step_s / ALIKE_S);
            if !may_stand {
                self.unmeasured[axis] = Evidence::default();
                continue;
            }
            let own = noise + UNMEASURED.powi(2) + (b * b + 0.25 * size(1 - axis)) / 4.0;
            let gained = (b * b - 4.0 * a * b) / (2.0 * own) * (1.0 - self.rocking);
            self.unmeasured[axis].add(stamp_ns, gained * step_s / ALIKE_S);
        }
    }
}

impl Band {
    fn new() -> Self {
        Self([LowPass::new(BAND_S), LowPass::new(BAND_S)])
    }

    fn step(&mut self, dt: f64, input: &Vector2<f64>) -> Vector2<f64> {
        let mut signal = *input;
        for filter in &mut self.0 {
            signal -= filter.step(dt, &signal);
        }
        signal
    }
}

impl Gyro {
    fn new() -> Self {
        Self {
            smoothed: [LowPass::new(SMOOTHED_S), LowPass::new(SMOOTHED_S)],
            last: None,
            noise: 0.0,
            bias: Vector2::zeros(),
            known_s: 0.0,
            turned: Vector2::zeros(),
            slow: LowPass::new(BAND_S),
        }
    }

    /// The lean in the band (rad), once the filters have settled.
    fn step(&mut self, dt: f64, turning: &Vector2<f64>) -> Option<Vector2<f64>> {
        if let Some(last) = self.last.replace(*turning) {
            // Neighbouring samples of a slow motion differ by noise: the variance of the difference is twice that.
            let noise = (turning - last).norm_squared() / 4.0;
            self.noise += NOISE_WEIGHT * (noise - self.noise);
        }
        self.known_s += dt;
        if self.known_s <= BIAS_S {
            let share = if self.known_s > 0.0 {
                dt / self.known_s
            } else {
                1.0
            };
            self.bias += (turning - self.bias) * share;
            return None;
        }
        let mut signal = turning - self.bias;
        for filter in &mut self.smoothed {
            signal = filter.step(dt, &signal);
        }
        self.turned = (self.turned + signal * dt) * (-dt / BAND_S).exp();
        let lean = self.turned - self.slow.step(dt, &self.turned);
        (self.known_s > BIAS_S + WARM_UP_S).then_some(lean)
    }

    /// Variance of the lean due to noise of samples `dt` apart (rad^2).
    fn angle_variance(&self, dt: f64) -> f64 {
        self.noise * dt * BAND_S / 2.0
    }
}

impl Evidence {
    fn add(&mut self, stamp_ns: i64, gained: f64) {
        // Written so that NaN is no evidence.
        if !gained.is_finite() {
            return;
        }
        if self.value == 0.0 {
            self.since_ns = stamp_ns;
        }
        self.value = (self.value + gained).clamp(0.0, LARGEST);
    }

    /// The evidence, if it shows a contradiction.
    fn stands(&mut self) -> Option<Self> {
        self.stands = self.value > if self.stands { CLEARED } else { CONTRADICTED };
        self.stands.then_some(*self)
    }
}
