//! The motion of the arm compared with how the platform leans on its tyres, as the gyro measures it.
//!
//! The lean predicted from the joints, a, and the integral of the angular velocity, b, pass the same band-pass
//! filter. Two things are asked. Whether the platform leans as the arm requires: [`super::lean_difference`]. And, also
//! while the machine travels, whether it follows the arm at all. About each of the axes x and y, two statements are
//! compared: the platform follows the arm, b = a, or it does not, with the boundary where it follows by a quarter,
//! since the stiffness of tyres and ground is known roughly only.
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
//! A platform that turns farther than the tyres can give way tips over, or stands on ground that moves. Then no
//! evidence is taken: a fall must not be called a fault of the sensors.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::super::fault::{Amount, Component};
use super::super::notice::{Found, Limits, Notice};
use super::band::{BIAS_S, Band, Gyro, TurnedBand};
use super::evidence::Evidence;
use super::lean_difference::LeanDifference;
use super::lean_model::{Lean, LeanModel};
use super::low_pass::left;
use super::rolling::Rolled;
use super::standstill::Standstill;
use super::travel::{Rocking, Travel};
use crate::machine::{FaultKind, Machine, rotation_in_body};

/// Time constants of the high-pass filters (s): of whether the platform follows, and of the difference.
const FOLLOWS_S: f64 = 1.0;
pub(super) const DIFFERS_S: f64 = 2.0;
/// Time over which errors are alike (s).
const ALIKE_S: f64 = 0.25;
/// Evidence from which the two contradict each other: odds of 22,000 to 1 that the platform does not follow, of 3,000
/// to 1 that it leans otherwise, if the errors were as assumed. On the good simulated logs it stays below half of it;
/// how often it is reached in the field is not known.
const FOLLOWS_NOT: f64 = 10.0;
const DIFFERS: f64 = 8.0;
/// The same, of 20 to 1, where an encoder stands out besides, or a wheel is light by the lean alone.
const STRICT: f64 = 3.0;
/// Lean of a standing platform that has other causes (rad).
const UNEXPLAINED: f64 = 2e-4;
/// The same while it travels (rad), and how long it lasts afterwards in each band (s).
const UNEVEN: f64 = 2e-3;
const ROCKING_S: [f64; 2] = [0.7, 1.5];
/// Shares of both that count where the strict limit holds: the sums of all that the ground may do excuse too much there.
const UNEVEN_SHARE: f64 = 0.5;
const DISTURBED_SHARE: f64 = 0.2;
/// Time for which the filters remember the lean of a machine that has travelled (s).
const DISTURBED_S: f64 = 2.5;
/// Time after a gap or a faulty sample in which the filters still remember it (s).
const FORGOTTEN_S: f64 = 3.0;
/// Time before the filters have settled (s), and before they have forgotten a bias that is not known.
const WARM_UP_S: [f64; 2] = [0.5, 0.2];
const UNKNOWN_BIAS_S: f64 = 8.0;
/// Change of the predicted lean from which the bias of the gyro contains motion (rad).
const LEANS_AT_START: f64 = 1.2e-4;
/// Time after the first sample before the noise of that sample has left the prediction (s).
const SETTLED_S: f64 = 0.15;

/// State of the check.
#[derive(Debug, Clone)]
pub(in super::super) struct LeanWatch {
    base_from_imu: Matrix3<f64>,
    model: LeanModel,
    /// What stands for gravity, turned up (m/s^2); `None` before the first sample of the IMU.
    up: Option<Vector3<f64>>,
    /// Predicted lean in both bands.
    bands: [Band; 2],
    /// Predicted lean, in both bands (rad), and its stamp.
    expected: Option<(i64, Lean, [Vector2<f64>; 2])>,
    /// Motion by the wheels at the last sample of the joints.
    pub(in super::super) rolled: Option<Rolled>,
    start_ns: Option<i64>,
    joints_ns: Option<i64>,
    tool_ns: Option<i64>,
    /// No evidence is taken before this stamp.
    silent_until_ns: i64,
    gyro: Gyro,
    /// Predicted lean when the bias of the gyro began to be averaged, and whether it changed meanwhile.
    at_start: Option<Vector2<f64>>,
    leans_at_start: bool,
    turned: [TurnedBand; 2],
    last_ns: Option<i64>,
    /// How much the ground may rock the platform, in both bands.
    rocking: [Rocking; 2],
    /// Largest lean that the ground may have caused, in both bands (rad): the filters still remember it.
    disturbed: [f64; 2],
    /// That the platform does not follow the arm, about each axis.
    follows_not: [Evidence; 2],
    differs: LeanDifference,
    standstill: Standstill,
}

impl LeanWatch {
    /// `None` where the model cannot be formed: see [`LeanModel::new`].
    pub(in super::super) fn new(machine: &Machine) -> Option<Self> {
        let model = LeanModel::new(machine)?;
        Some(Self {
            base_from_imu: rotation_in_body(machine.imu()),
            differs: LeanDifference::new(model.stiffness_is_known),
            model,
            up: None,
            bands: [FOLLOWS_S, DIFFERS_S].map(Band::new),
            expected: None,
            rolled: None,
            start_ns: None,
            joints_ns: None,
            tool_ns: None,
            silent_until_ns: i64::MIN,
            gyro: Gyro::new(),
            at_start: None,
            leans_at_start: false,
            turned: [FOLLOWS_S, DIFFERS_S].map(TurnedBand::new),
            last_ns: None,
            rocking: ROCKING_S.map(Rocking::new),
            disturbed: [0.0; 2],
            follows_not: [Evidence::default(); 2],
            standstill: Standstill::new(machine),
        })
    }

    /// A sample of the joints is faulty: what it would predict proves nothing, and neither does the evidence that has
    /// just begun.
    pub(in super::super) fn distrust_joints(&mut self, stamp_ns: i64) {
        self.restart_prediction(stamp_ns);
        self.joints_ns = None;
    }

    fn restart_prediction(&mut self, stamp_ns: i64) {
        self.model.reset();
        self.bands.iter_mut().for_each(Band::reset);
        self.expected = None;
        self.rolled = None;
        self.forget(stamp_ns);
    }

    fn forget(&mut self, stamp_ns: i64) {
        self.silent_until_ns = stamp_ns.saturating_add((FORGOTTEN_S * 1e9) as i64);
        self.follows_not.iter_mut().for_each(Evidence::forget);
        self.differs.forget();
    }

    /// Takes force and moment on the tool (N, N m; in its frame).
    pub(in super::super) fn take_tool(&mut self, stamp_ns: i64, wrench: [Vector3<f64>; 2]) {
        self.model.tool_wrench = wrench;
        self.tool_ns = Some(stamp_ns);
    }

    /// Takes the joints of one sample: index, position and velocity of each.
    pub(in super::super) fn take_joints(
        &mut self,
        stamp_ns: i64,
        joints: impl Iterator<Item = (usize, f64, f64)>,
        limits: &Limits,
    ) {
        for (joint, position, rate) in joints {
            self.model.set(joint, position, rate);
            self.standstill.take(joint, position);
        }
        self.differs.expect_standstill(self.standstill.stands_out());
        let step_s = (self.joints_ns.replace(stamp_ns))
            .map_or(0.0, |last_ns| limits.elapsed_s(last_ns, stamp_ns));
        let start_ns = *self.start_ns.get_or_insert(stamp_ns);
        let is_loaded_anew = self.model.attach(limits.elapsed_s(start_ns, stamp_ns));
        let tool_is_old = |at: &i64| limits.elapsed_s(*at, stamp_ns) > limits.max_gap_s;
        let has_old_tool = self.tool_ns.as_ref().is_some_and(tool_is_old);
        if step_s > limits.max_gap_s || has_old_tool || is_loaded_anew {
            self.restart_prediction(stamp_ns);
        }
        let lean = (self.up).and_then(|up| self.model.lean(step_s, &up));
        let known_s = self.gyro.known_s();
        if let Some(lean) = lean.filter(|_| known_s > -BIAS_S + SETTLED_S && known_s <= 0.0) {
            let at_start = *self.at_start.get_or_insert(lean.angle);
            self.leans_at_start |= (lean.angle - at_start).amax() > LEANS_AT_START;
        }
        self.rolled = lean.and_then(|_| self.model.rolled());
        self.expected = lean.map(|lean| {
            let filter = |band: &mut Band| band.step(step_s, &lean.angle);
            let [follows, differs] = &mut self.bands;
            (stamp_ns, lean, [filter(follows), filter(differs)])
        });
    }

    /// Takes specific force and angular velocity (IMU axes) and reports to `found` a platform that does not lean as
    /// the arm requires.
    pub(in super::super) fn check(
        &mut self,
        stamp_ns: i64,
        [force, turning]: [&Vector3<f64>; 2],
        travel: &Travel,
        limits: &Limits,
        found: &mut Found<'_>,
    ) {
        let step_ns =
            (self.last_ns.replace(stamp_ns)).map_or(0, |last| stamp_ns.saturating_sub(last));
        let step_s = step_ns as f64 * 1e-9;
        if step_s > limits.max_gap_s {
            self.gyro = Gyro::new();
            (self.at_start, self.leans_at_start) = (None, false);
            self.turned.iter_mut().for_each(TurnedBand::reset);
            self.forget(stamp_ns);
            return;
        }
        let now = travel.rocking(stamp_ns, limits.max_gap_s);
        // What is not known yet at the start is not remembered.
        let lasts = self.gyro.known_s() > 0.0;
        let rocking = (self.rocking.each_mut()).map(|it| it.step(step_s, now, lasts));
        let force = self.base_from_imu * force;
        self.up = Some(self.model.level(step_s, &force, rocking[0]));
        let turning = self.base_from_imu * turning;
        if let Some(turning) = self.gyro.step(step_s, &turning.xy()) {
            let measured = self
                .turned
                .each_mut()
                .map(|band| band.step(step_s, &turning));
            let left = left(step_s, DISTURBED_S);
            let disturbed = self.disturbed.iter_mut().zip(measured.iter().zip(rocking));
            for (disturbed, (lean, rocking)) in disturbed {
                *disturbed = (*disturbed * left).max(rocking * lean.norm());
            }
            self.weigh(stamp_ns, step_ns, &measured, rocking, limits);
        }
        self.report(found);
    }

    fn report(&mut self, found: &mut Found<'_>) {
        let [x, y] = &mut self.follows_not;
        let [differs, standstill, light_wheel] = self.differs.evidences();
        let all = [
            (x.stands(FOLLOWS_NOT), FOLLOWS_NOT),
            (y.stands(FOLLOWS_NOT), FOLLOWS_NOT),
            (differs.stands(DIFFERS), DIFFERS),
            (standstill.stands(STRICT), STRICT),
            (light_wheel.stands(STRICT), STRICT),
        ];
        let standing = all
            .iter()
            .filter_map(|(evidence, limit)| Some(((*evidence)?, *limit)));
        if let Some((evidence, limit)) = standing.max_by(|a, b| a.0.value.total_cmp(&b.0.value)) {
            found(Notice {
                kind: FaultKind::Contradiction,
                component: Component::Value,
                since_ns: evidence.since_ns,
                measure: evidence.value,
                limit,
                amount: Amount::default(),
            });
        }
    }

    /// Adds what this sample shows.
    fn weigh(
        &mut self,
        stamp_ns: i64,
        step_ns: i64,
        measured: &[Vector2<f64>; 2],
        rocking: [f64; 2],
        limits: &Limits,
    ) {
        let is_fresh = |at: i64| limits.elapsed_s(at, stamp_ns).abs() <= limits.max_gap_s;
        let Some((_, lean, expected)) = self.expected.filter(|(at, ..)| is_fresh(*at)) else {
            return;
        };
        if stamp_ns < self.silent_until_ns {
            return;
        }
        let step_s = step_ns as f64 * 1e-9;
        let noise = |band: usize, [uneven, disturbed]: [f64; 2]| {
            let ground = UNEVEN * uneven * rocking[band] + disturbed * self.disturbed[band];
            let other = UNEXPLAINED + ground;
            other * other + self.turned[band].variance(self.gyro.noise, step_s)
        };
        let strict = noise(1, [UNEVEN_SHARE, DISTURBED_SHARE]);
        let noise = [0, 1].map(|band| noise(band, [1.0, 1.0]));
        let known_s = self.gyro.known_s();
        let bias_is_doubtful = self.leans_at_start || self.gyro.turned_at_start();
        let settled_s = if bias_is_doubtful {
            UNKNOWN_BIAS_S
        } else {
            WARM_UP_S[1]
        };
        // A platform that turns farther than its tyres give way tips over, or the ground turns it.
        let tips = (measured.iter()).any(|lean| lean.norm() > self.model.largest);
        if tips && known_s > WARM_UP_S[0] {
            self.follows_not = [Evidence::default(); 2];
            self.differs.clear();
            self.silent_until_ns = stamp_ns.saturating_add((FORGOTTEN_S * 1e9) as i64);
            return;
        }
        if known_s > WARM_UP_S[0] && self.model.stiffness_is_known {
            self.weigh_following(stamp_ns, step_s, [&expected[0], &measured[0]], noise[0]);
        }
        if known_s > settled_s {
            let leans = [&expected[1], &measured[1]];
            self.differs.weigh(
                [stamp_ns, step_ns],
                &lean,
                leans,
                [noise[1], strict],
                rocking[1],
                |more| self.model.least_load(&lean.moment, more),
            );
        }
    }

    fn weigh_following(
        &mut self,
        stamp_ns: i64,
        step_s: f64,
        [expected, measured]: [&Vector2<f64>; 2],
        noise: f64,
    ) {
        for (axis, evidence) in self.follows_not.iter_mut().enumerate() {
            let size = |axis: usize| expected[axis].powi(2) + measured[axis].powi(2);
            let variance = noise + (size(axis) + 0.25 * size(1 - axis)) / 4.0;
            let (a, b) = (expected[axis], measured[axis]);
            let gained = (a * a - 4.0 * a * b) / (2.0 * variance);
            evidence.add(stamp_ns, gained * step_s / ALIKE_S);
        }
    }
}
