//! The motion of the arm against how the platform leans on its tyres.
//!
//! Over a window the platform leans by b, the integral of the gyro, about x and y, and by the joints it should lean by a
//! ([`super::lean_model`]):
//! ```text
//!     b = T bias + s a + m d(lean per load) + n
//! ```
//! with unknowns that are learned: the bias of the gyro, the compliance s of tyres and ground relative to that in the machine
//! file about each axis, and a small load m on the tool. An alternative predicts another a: that of the posture in which a joint
//! has the other sign, is exchanged with another or moves by another scale; or it lets a joint move that its encoder shows
//! at rest; or it lets a load be taken up. Where the machine travels or tips, and after a hole, nothing is asked.

use nalgebra::{SVector, Vector2, Vector3};

use super::super::explanation::Explanation;
use super::super::notice::Limits;
use super::gyro::Gyro;
use super::lean_model::{Lean, LeanModel};
use super::likelihood::{Evidence, Mixture, Standing, log_density_of_other, student};
use super::rolling::Rolled;
use super::unknowns::Unknowns;
use crate::machine::{Axis, Machine, Proof, Proofs};
use crate::number::normal_density;

/// Number of unknowns: bias about x and y, compliance about x and y, load, and one that is drawn anew in each window.
const UNKNOWNS: usize = 6;
/// Bias of a gyro (rad/s), and its change in a window (rad/s).
const BIAS: f64 = 0.005;
const BIAS_DRIFT: f64 = 2e-5;
/// Compliance relative to that stated, and where nothing is stated; the least of both; how fast it changes.
const STATED: f64 = 0.3;
const UNSTATED: f64 = 1.5;
const LEAST_COMPLIANCE: [f64; 2] = [0.3, 0.02];
const COMPLIANCE_DRIFT: f64 = 0.02;
/// Load on the tool, as a share of the mass of the machine: one that the stated masses do not exclude, one that nobody stated,
/// and one that is taken up in a window.
const SMALL_LOAD: f64 = 0.005;
const UNSTATED_LOAD: f64 = 0.1;
const TAKEN_UP: f64 = 0.05;
/// Motion of a joint in a window that its encoder does not show (rad or m), and the motion that shows that it works.
const UNSEEN_MOTION: f64 = 0.3;
const MOVES: f64 = 2e-3;
/// Lean in a window that has other causes (rad), and that of a machine that travels.
const UNEXPLAINED: f64 = 1e-4;
const UNEVEN: f64 = 2e-3;
/// Multiple of the lean by joints and uneven ground from which on the ground itself turns a machine that travels.
const TURNED_BY_GROUND: f64 = 4.0;
/// Shares of both leans by which the model errs, and of those about the other axis.
const MODEL: f64 = 0.08;
const ACROSS: f64 = 0.05;
/// Share of both leans by which the model errs, and lean by other causes (rad), while a wheel is off the ground: even ground
/// would let it leave later or earlier.
const MODEL_OFF: f64 = 0.3;
const UNEXPLAINED_OFF: f64 = 3e-4;
/// Probability beforehand that the sensor of a machine shows one of the alternatives: one in a hundred is wired, mounted or
/// configured so, where nobody has tested it.
pub(super) const BEFOREHAND: f64 = 0.01;
/// Probability beforehand that a machine takes up a load that nobody stated.
const LOADED_BEFOREHAND: f64 = 0.1;
/// Speed that noise shows while the machine stands (m/s), and from which it travels.
const STANDING: f64 = 0.04;
const TRAVELLING: f64 = 0.2;
/// Time in which the platform comes to rest on its tyres after it has travelled (s).
const COMES_TO_REST_S: f64 = 1.5;
/// Number of windows after a hole in which the filters still remember it.
const SETTLING: u32 = 2;
/// Log likelihood ratio that a moving encoder adds to the alternative of its standstill.
const REFUTED: f64 = -5.0;
const LEANS: Mixture = Mixture {
    outliers: 0.05,
    range: 0.02,
};
/// Share of the lean that a platform shows by chance where the loads are wrong, one standard deviation; steps of the compliance, and
/// their number.
const BY_CHANCE: f64 = 0.5;
const COMPLIANCE_STEP: f64 = 0.05;
const COMPLIANCES: u32 = 35;

/// Returns the probability that the loads of a standing machine are right, by the `share` of the lean that they cause on tyres of
/// stated stiffness which its platform shows while they change. `lean` and `rest` are the root mean squares of that lean and of what
/// the platform turns besides (rad); with the compliance c of tyres and ground,
/// ```text
///     right:  share ~ t(c, sigma),  c ~ N(1, 0.3) from 0.3 on          wrong, one time in a hundred:  share ~ N(0, 0.5^2 + sigma^2)
///     sigma^2 = model^2 (1 + share^2) / 2 + (unexplained^2 + rest^2) / lean^2
/// ```
/// `None` where the lean is not known better than the least compliance.
#[must_use]
pub fn lean_shows_loads(share: f64, [lean, rest]: [f64; 2]) -> Option<f64> {
    let by_model = MODEL * (0.5 * (1.0 + share * share)).sqrt();
    let sigma = by_model.hypot(UNEXPLAINED_OFF.hypot(rest) / lean);
    let [least, _] = LEAST_COMPLIANCE;
    if !(sigma < least) {
        return None;
    }
    // with a wheel in the air the platform leans farther
    let share = share.min(1.0);
    let (mut right, mut total) = (0.0, 0.0);
    for step in 0..COMPLIANCES {
        let compliance = least + COMPLIANCE_STEP * f64::from(step);
        let weight = (-0.5 * ((compliance - 1.0) / STATED).powi(2)).exp();
        right += weight * student(share - compliance, sigma);
        total += weight;
    }
    let right = (1.0 - BEFOREHAND) * right / total;
    let wrong = BEFOREHAND * normal_density(share, BY_CHANCE.hypot(sigma));
    Some(right / (right + wrong))
}

/// The relation.
#[derive(Debug, Clone)]
pub(super) struct LeanRelation {
    model: LeanModel,
    /// Specific force that stands for gravity, upwards (m/s^2, base axes); `None` before the first sample of the IMU.
    up: Option<Vector3<f64>>,
    /// Whether there is an IMU on the base.
    has_imu: bool,
    gyro: Gyro,
    turned: Vector2<f64>,
    turning: Vector2<f64>,
    last_ns: Option<i64>,
    joints_ns: Option<i64>,
    start_ns: Option<i64>,
    tool_ns: Option<i64>,
    /// Degree to which the ground may rock the platform (0 to 1).
    rocking: f64,
    /// Whether every sample so far shows a machine that stands still; `None` once the first window is over.
    stood: Option<bool>,
    /// State at the last sample of joints, and at the one before.
    last: Option<End>,
    before: Option<End>,
    settling: u32,
    sound: Unknowns<UNKNOWNS>,
    alternatives: Vec<Alternative>,
    threshold: f64,
    mass: f64,
    /// Joints of the arm.
    arm: Vec<usize>,
}

/// End of a window, at a sample of joints: they may be rarer than those of the IMU by far.
#[derive(Debug, Clone, Copy)]
struct End {
    stamp_ns: i64,
    turned: Vector2<f64>,
    /// Angular velocity of the platform about x and y (rad/s), smoothed.
    turning: Vector2<f64>,
    lean: Lean,
    /// Time since the sample of joints before (s).
    step_s: f64,
}

#[derive(Debug, Clone)]
struct Alternative {
    explanation: Explanation,
    unknowns: Unknowns<UNKNOWNS>,
    /// Lean of the posture beyond that of the sound one at the end of the last window (rad).
    beyond: Vector2<f64>,
    /// Position of the alternative's joint then (rad or m).
    position: f64,
    /// Offset of the alternative's joint (rad or m), where something suggests one.
    offset: Option<f64>,
    evidence: Evidence,
    /// Evidence of sound sensors against the alternative: it decides about an offset, too, once something suggests one.
    refuted: Evidence,
    /// Of an alternative "encoder stopped": whether it has ever been the best explanation of a contradiction. The encoder may
    /// have lost its zero.
    had_stopped: bool,
}

/// The joints whose motion leans a platform. Steering leans nothing: turns show it.
pub(super) fn of_arm(machine: &Machine) -> impl Iterator<Item = usize> + '_ {
    let joints = machine.joints().iter().enumerate();
    let of_arm = joints.filter(|(joint, it)| {
        it.spins_wheel.is_none() && it.logged && !machine.is_steering(*joint)
    });
    of_arm.map(|(joint, _)| joint)
}

impl LeanRelation {
    /// `None` where the model cannot be formed: see [`LeanModel::new`].
    pub(super) fn new(machine: &Machine, has_imu: bool, threshold: f64) -> Option<Self> {
        let model = LeanModel::new(machine)?;
        let spread = if model.stiffness_is_known {
            STATED
        } else {
            UNSTATED
        };
        let mass = machine.mass();
        let unknowns = |load: f64| {
            Unknowns::new(
                SVector::from([0.0, 0.0, 1.0, 1.0, 0.0, 0.0]),
                SVector::from([BIAS, BIAS, spread, spread, load * mass, 0.0]),
            )
        };
        let arm: Vec<usize> = of_arm(machine).collect();
        let mut explanations = vec![
            Explanation::Sign(Axis::X),
            Explanation::Sign(Axis::Y),
            Explanation::HalfTurn(Axis::Z),
            Explanation::Exchanged(Axis::X, Axis::Y),
            Explanation::Stopped,
            Explanation::UnstatedLoad,
            Explanation::Other,
        ];
        for (place, &joint) in arm.iter().enumerate() {
            explanations.extend([
                Explanation::JointSign(joint),
                Explanation::JointStopped(joint),
                Explanation::JointScale(joint, true),
                Explanation::JointScale(joint, false),
                Explanation::JointOffset(joint),
            ]);
            let others = arm[..place].iter();
            explanations.extend(others.map(|&other| Explanation::JointsExchanged(other, joint)));
        }
        let alternative = |explanation| Alternative {
            explanation,
            unknowns: unknowns(match explanation {
                Explanation::UnstatedLoad => UNSTATED_LOAD,
                _ => SMALL_LOAD,
            }),
            beyond: Vector2::zeros(),
            position: f64::NAN,
            offset: None,
            evidence: Evidence::default(),
            refuted: Evidence::default(),
            had_stopped: false,
        };
        Some(Self {
            model,
            up: None,
            has_imu,
            gyro: Gyro::new(),
            turned: Vector2::zeros(),
            turning: Vector2::zeros(),
            last_ns: None,
            joints_ns: None,
            start_ns: None,
            tool_ns: None,
            rocking: 1.0,
            stood: Some(true),
            last: None,
            before: None,
            settling: 1,
            sound: unknowns(SMALL_LOAD),
            alternatives: explanations.into_iter().map(alternative).collect(),
            threshold,
            mass,
            arm,
        })
    }

    /// Takes a faulty or missing sample: a prediction by it proves nothing, and neither does evidence that has just begun.
    pub(super) fn distrust(&mut self) {
        self.before = None;
        self.settling = SETTLING;
        for it in &mut self.alternatives {
            it.evidence.forget();
            it.refuted.forget();
        }
    }

    /// Weighs from now on the alternative that a joint is off by `offset` (rad or m); `None`: no longer.
    pub(super) fn suppose_offset(&mut self, joint: usize, offset: Option<f64>) {
        let of_joint = Explanation::JointOffset(joint);
        let alternatives = self.alternatives.iter_mut();
        for it in alternatives.filter(|it| it.explanation == of_joint) {
            it.offset = offset;
            it.unknowns = self.sound;
            (it.evidence, it.refuted) = (Evidence::default(), Evidence::default());
            // its posture is not the one noted at the beginning of the window
            self.before = None;
        }
    }

    /// Trusts the present positions of these joints, as a person says.
    pub(super) fn trust(&mut self, signals: Proofs) {
        for it in self.alternatives.iter_mut().filter(|it| it.had_stopped) {
            if let Explanation::JointStopped(joint) = it.explanation
                && signals.has(Proof::Joint(joint))
            {
                (it.had_stopped, it.evidence) = (false, Evidence::default());
            }
        }
    }

    /// The joints whose encoder had stopped, as a contradiction has shown.
    pub(super) fn had_stopped(&self) -> impl Iterator<Item = usize> {
        let alternatives = self.alternatives.iter().filter(|it| it.had_stopped);
        alternatives.filter_map(|it| match it.explanation {
            Explanation::JointStopped(joint) => Some(joint),
            _ => None,
        })
    }

    /// The encoder of a joint had stopped in a session before, or before a restart. Returns whether the lean tells of that joint.
    pub(super) fn remember_stopped(&mut self, joint: usize) -> bool {
        let stopped = Explanation::JointStopped(joint);
        let mut alternatives = self.alternatives.iter_mut();
        let it = alternatives.find(|it| it.explanation == stopped);
        it.map(|it| it.had_stopped = true).is_some()
    }

    /// Whether the lean of the platform agrees with this joint's position, and refutes the offset that was supposed for it.
    pub(super) fn refutes_offset(&self, joint: usize) -> bool {
        let mut alternatives = self.alternatives.iter();
        alternatives
            .any(|it| it.explanation == Explanation::JointOffset(joint) && it.refuted.stands())
    }

    /// Takes force and moment on the tool (N, N m; in its frame).
    pub(super) fn take_tool(&mut self, stamp_ns: i64, wrench: [Vector3<f64>; 2]) {
        self.model.tool_wrench = wrench;
        self.tool_ns = Some(stamp_ns);
    }

    /// Takes the joints of one sample: index, position and velocity of each; returns the motion by the wheels.
    pub(super) fn take_joints(
        &mut self,
        stamp_ns: i64,
        joints: impl Iterator<Item = (usize, f64, f64)>,
        limits: &Limits,
    ) -> Option<Rolled> {
        for (joint, position, rate) in joints {
            self.model.set(joint, position, rate);
        }
        let step_s = (self.joints_ns.replace(stamp_ns))
            .map_or(0.0, |last_ns| limits.elapsed_s(last_ns, stamp_ns));
        let start_ns = *self.start_ns.get_or_insert(stamp_ns);
        let is_loaded_anew = self.model.attach(limits.elapsed_s(start_ns, stamp_ns));
        let tool_is_old = |at: &i64| limits.elapsed_s(*at, stamp_ns) > limits.max_gap_s;
        let has_old_tool = self.tool_ns.as_ref().is_some_and(tool_is_old);
        if step_s > limits.max_gap_s || has_old_tool || is_loaded_anew {
            self.model.reset();
            self.distrust();
        }
        let up = self
            .up
            .unwrap_or_else(|| Vector3::z() * self.model.gravity());
        let lean = self.model.lean(step_s, &up);
        self.last = lean.map(|lean| End {
            stamp_ns,
            turned: self.turned,
            turning: self.turning,
            lean,
            step_s,
        });
        lean.and_then(|_| self.model.rolled())
    }

    /// Takes specific force and angular velocity (base axes), and the speed of the machine (m/s) if it is known.
    pub(super) fn take_imu(
        &mut self,
        stamp_ns: i64,
        [force, turning]: [&Vector3<f64>; 2],
        speed: Option<f64>,
    ) {
        let step_s = (self.last_ns.replace(stamp_ns))
            .map_or(0.0, |last| stamp_ns.saturating_sub(last) as f64 * 1e-9);
        let now = speed.map_or(1.0, |speed| {
            ((speed - STANDING) / TRAVELLING).clamp(0.0, 1.0)
        });
        self.rocking = now.max(self.rocking * (-step_s / COMES_TO_REST_S).exp());
        self.up = Some(self.model.level(step_s, force, self.rocking));
        self.turning = self.gyro.step(step_s, &turning.xy());
        if let Some(stood) = &mut self.stood {
            *stood &= now == 0.0 && self.turning.norm() < BIAS;
        }
        self.turned += self.turning * step_s;
    }

    /// Weighs the windows up to `stamp_ns`.
    pub(super) fn weigh(&mut self, start_ns: i64, stamp_ns: i64) {
        let (Some(now), Some(up), true) = (self.last, self.up, self.has_imu) else {
            return;
        };
        // a platform that turns no more than a gyro's bias shows does not rock, whatever the machine did before the log
        if self.stood.take() == Some(true) {
            self.rocking = 0.0;
        }
        let End { lean, turned, .. } = now;
        let is_old = stamp_ns.saturating_sub(now.stamp_ns) > stamp_ns.saturating_sub(start_ns);
        if is_old || lean.is_beyond_model {
            self.distrust();
            return;
        }
        if self.settling > 0 {
            self.settling -= 1;
            return;
        }
        let Some(before) = self.before else {
            self.before = Some(now);
            self.note_postures(&up);
            return;
        };
        self.before = Some(now);
        let window_s = now.stamp_ns.saturating_sub(before.stamp_ns) as f64 * 1e-9;
        let (a, b) = (lean.angle - before.lean.angle, turned - before.turned);
        // A platform that turns farther than its tyres give way tips over, or the ground turns it.
        if b.norm() > self.model.largest {
            self.distrust();
            return;
        }
        // So does a ramp under a machine that travels: what turns it by so much more than its joints do is not its joints.
        if b.norm() > TURNED_BY_GROUND * (UNEVEN * self.rocking + a.norm()) && self.rocking > 0.5 {
            return;
        }
        let are_all_on = before.lean.is_on_all_wheels && lean.is_on_all_wheels;
        // the smoothed motion of the joints is late or early by up to half a step of theirs
        let late = (now.turning - before.turning) * (0.5 * now.step_s);
        let compared = Compared {
            start_ns: before.stamp_ns,
            window_s,
            are_all_on,
            sigma: (self.sigma(&a, &b, window_s, are_all_on)).zip_map(&late, f64::hypot),
            measured: b,
            per_load: lean.by_load - before.lean.by_load,
            by_load: lean.by_load,
            least_compliance: LEAST_COMPLIANCE[usize::from(!self.model.stiffness_is_known)],
        };
        self.weigh_window(&compared, &a, &up);
    }

    /// Standard deviation of the lean about x and y in a window.
    fn sigma(
        &self,
        a: &Vector2<f64>,
        b: &Vector2<f64>,
        window_s: f64,
        are_all_on: bool,
    ) -> Vector2<f64> {
        let [model, unexplained] = match are_all_on {
            true => [MODEL, UNEXPLAINED],
            false => [MODEL_OFF, UNEXPLAINED_OFF],
        };
        let noise = self.gyro.noise * self.gyro.step_s * window_s;
        let ground = UNEVEN * self.rocking;
        let other = unexplained * unexplained + ground * ground + noise;
        let squares = (a.component_mul(a) + b.component_mul(b)) / 2.0;
        (squares * (model * model) + squares.yx() * (ACROSS * ACROSS))
            .map(|model| (model + other).sqrt())
    }

    fn weigh_window(&mut self, compared: &Compared, a: &Vector2<f64>, up: &Vector3<f64>) {
        let drift = SVector::from([
            BIAS_DRIFT,
            BIAS_DRIFT,
            COMPLIANCE_DRIFT,
            COMPLIANCE_DRIFT,
            0.0,
            0.0,
        ]);
        let (threshold, mass) = (self.threshold, self.mass);
        let before = self.sound;
        self.sound.drift(drift);
        let sound = compared.take(&mut self.sound, &compared.measured, a, Vector2::zeros());
        let at_rest = self.model.lean_with(&[], up);
        for it in &mut self.alternatives {
            if it.is_asleep() {
                continue;
            }
            it.unknowns.drift(drift);
            let beyond = it.beyond(&mut self.model, up, &at_rest);
            let predicted = a + beyond - it.beyond;
            it.beyond = beyond;
            let measured = compared.measured;
            let unknowns = &mut it.unknowns;
            let density = match it.explanation {
                Explanation::Other => {
                    let residual = compared.residual(&before, a);
                    let axes = residual.iter().zip(compared.sigma.iter());
                    axes.map(|(r, sigma)| log_density_of_other(*r, *sigma))
                        .sum()
                }
                Explanation::UnstatedLoad => {
                    unknowns.draw(5, TAKEN_UP * mass);
                    compared.take(unknowns, &measured, a, compared.by_load)
                }
                Explanation::JointStopped(joint) => {
                    let position = self.model.position(joint);
                    let moved = (position - it.position).abs();
                    it.position = position;
                    if moved > MOVES {
                        it.evidence.add(compared.start_ns, REFUTED, threshold);
                        continue;
                    }
                    unknowns.draw(5, UNSEEN_MOTION);
                    let step = 1e-3;
                    let moved = self.model.lean_with(&[(joint, position + step)], up);
                    compared.take(unknowns, &measured, a, (moved - at_rest) / step)
                }
                Explanation::Sign(Axis::X) => {
                    let measured = Vector2::new(-measured.x, measured.y);
                    compared.take(unknowns, &measured, a, Vector2::zeros())
                }
                Explanation::Sign(_) => {
                    let measured = Vector2::new(measured.x, -measured.y);
                    compared.take(unknowns, &measured, a, Vector2::zeros())
                }
                Explanation::HalfTurn(_) => {
                    compared.take(unknowns, &-measured, a, Vector2::zeros())
                }
                Explanation::Exchanged(..) => {
                    compared.take(unknowns, &measured.yx(), a, Vector2::zeros())
                }
                Explanation::Stopped => {
                    compared.take(unknowns, &measured, &Vector2::zeros(), Vector2::zeros())
                }
                _ => compared.take(unknowns, &measured, &predicted, Vector2::zeros()),
            };
            // which wheels carry the platform without one depends on the ground
            let add = match compared.are_all_on {
                true => Evidence::add,
                false => Evidence::add_unproven,
            };
            add(
                &mut it.evidence,
                compared.start_ns,
                density - sound,
                threshold,
            );
            if it.offset.is_some() {
                it.refuted
                    .add(compared.start_ns, sound - density, threshold);
                continue;
            }
            if it.evidence.value == 0.0 && it.explanation != Explanation::UnstatedLoad {
                it.unknowns = self.sound;
            }
        }
        // That it moves again says nothing of where it was. Less evidence is a gust, or a person who steps on the platform.
        if let Some((stopped @ Explanation::JointStopped(_), ..)) = self.standing(|_| 0.0) {
            let mut alternatives = self.alternatives.iter_mut();
            if let Some(it) = alternatives.find(|it| it.explanation == stopped) {
                it.had_stopped = true;
            }
        }
    }

    /// Notes the postures of the alternatives at the beginning of a window.
    fn note_postures(&mut self, up: &Vector3<f64>) {
        let at_rest = self.model.lean_with(&[], up);
        for it in &mut self.alternatives {
            if it.is_asleep() {
                continue;
            }
            it.beyond = it.beyond(&mut self.model, up, &at_rest);
            if let Explanation::JointStopped(joint) = it.explanation {
                it.position = self.model.position(joint);
            }
        }
    }

    /// Returns the signals that the motion on all wheels has proven: every alternative about them is refuted.
    pub(super) fn proven(&self) -> Proofs {
        let open = self.alternatives.iter().filter(|it| {
            // what else there may be is no error of one signal, and an offset is weighed where something suggests it
            let is_asked = !matches!(
                it.explanation,
                Explanation::Other | Explanation::JointOffset(_)
            );
            is_asked && !it.evidence.is_refuted()
        });
        let open = open.map(|it| self.signals_of(it.explanation));
        open.fold(self.signals_of(Explanation::Other), Proofs::without)
    }

    /// Returns the signals of each alternative that is more likely than sound sensors by now, with its prior probability (see
    /// [`BEFOREHAND`]), or that was a contradiction about an encoder that moves again.
    pub(super) fn disputed(&self) -> Proofs {
        let likely = self.alternatives.iter().filter(|it| {
            let beforehand = match it.explanation {
                Explanation::UnstatedLoad => LOADED_BEFOREHAND,
                _ => BEFOREHAND,
            };
            it.had_stopped || it.evidence.disputes(beforehand)
        });
        let signals = likely.map(|it| self.signals_of(it.explanation));
        signals.fold(Proofs::NONE, Proofs::with)
    }

    /// Returns the signals that an alternative is about.
    fn signals_of(&self, explanation: Explanation) -> Proofs {
        let joints = |joints: &[usize]| joints.iter().copied().map(Proof::Joint).collect();
        let mut signals: Proofs = match explanation {
            Explanation::JointSign(joint)
            | Explanation::JointStopped(joint)
            | Explanation::JointScale(joint, _)
            | Explanation::JointOffset(joint) => joints(&[joint]),
            Explanation::JointsExchanged(a, b) => joints(&[a, b]),
            Explanation::Other => joints(&self.arm),
            _ => Proofs::NONE,
        };
        match explanation {
            Explanation::UnstatedLoad => signals.add(Proof::Payload),
            Explanation::Sign(_)
            | Explanation::HalfTurn(_)
            | Explanation::Exchanged(..)
            | Explanation::Stopped
            | Explanation::Other => signals.add(Proof::AngularVelocity),
            _ => {}
        }
        signals
    }

    /// The best of the alternatives that stand. A load explains as well as a sensor: the sensor is named only where it explains
    /// more. `refuted` is the evidence of another relation against that of the gyro.
    pub(super) fn standing(&self, refuted: impl Fn(Explanation) -> f64) -> Standing {
        let standing = self.alternatives.iter().filter(|it| it.evidence.stands());
        let lead = |it: &&Alternative| it.evidence.sum - refuted(it.explanation);
        let best = standing.max_by(|a, b| lead(a).total_cmp(&lead(b)))?;
        Some((best.explanation, best.evidence, self.threshold))
    }

    /// The probability that each joint has the other sign, by all windows, against sound sensors, a gyro that shows otherwise and
    /// a load that nobody stated; `refuted` as above.
    pub(super) fn reversed(&self, refuted: impl Fn(Explanation) -> f64) -> Vec<(usize, f64)> {
        let odds = |it: &Alternative| {
            let share = match it.explanation {
                Explanation::JointSign(_) => BEFOREHAND,
                Explanation::Sign(_)
                | Explanation::HalfTurn(_)
                | Explanation::Exchanged(..)
                | Explanation::Stopped => BEFOREHAND / 5.0,
                Explanation::UnstatedLoad => LOADED_BEFOREHAND,
                _ => return None,
            };
            let log = it.evidence.total - refuted(it.explanation);
            Some((it.explanation, share.ln() + log))
        };
        let all: Vec<(Explanation, f64)> = self.alternatives.iter().filter_map(odds).collect();
        // sound sensors have the logarithm 0
        let largest = all.iter().map(|(_, log)| *log).fold(0.0, f64::max);
        let logs = all.iter().map(|(_, log)| *log).chain([0.0]);
        let total: f64 = logs.map(|log| (log - largest).exp()).sum();
        let of_joint = |(explanation, log): &(Explanation, f64)| match explanation {
            Explanation::JointSign(joint) => Some((*joint, (log - largest).exp() / total)),
            _ => None,
        };
        all.iter().filter_map(of_joint).collect()
    }
}

/// Measured lean of a window, and its sensitivities to the unknowns.
struct Compared {
    start_ns: i64,
    /// Whether every wheel carries load.
    are_all_on: bool,
    window_s: f64,
    sigma: Vector2<f64>,
    measured: Vector2<f64>,
    per_load: Vector2<f64>,
    by_load: Vector2<f64>,
    least_compliance: f64,
}

impl Compared {
    /// The row of the unknowns about an axis.
    fn row(&self, axis: usize, a: &Vector2<f64>, drawn: &Vector2<f64>) -> SVector<f64, UNKNOWNS> {
        let mut row = SVector::zeros();
        row[axis] = self.window_s;
        row[2 + axis] = a[axis];
        row[4] = self.per_load[axis];
        row[5] = drawn[axis];
        row
    }

    /// Returns the log density of the measured lean, and updates the unknowns by it.
    fn take(
        &self,
        unknowns: &mut Unknowns<UNKNOWNS>,
        measured: &Vector2<f64>,
        a: &Vector2<f64>,
        drawn: Vector2<f64>,
    ) -> f64 {
        let mut sum = 0.0;
        for axis in 0..2 {
            let row = self.row(axis, a, &drawn);
            sum += unknowns.take(&row, measured[axis], self.sigma[axis], LEANS);
        }
        for compliance in 2..4 {
            unknowns.mean[compliance] = unknowns.mean[compliance].max(self.least_compliance);
        }
        sum
    }

    fn residual(&self, unknowns: &Unknowns<UNKNOWNS>, a: &Vector2<f64>) -> Vector2<f64> {
        let of = |axis: usize| {
            let row = self.row(axis, a, &Vector2::zeros());
            self.measured[axis] - row.dot(&unknowns.mean)
        };
        Vector2::new(of(0), of(1))
    }
}

impl Alternative {
    /// Whether the alternative is an offset that nothing suggests.
    fn is_asleep(&self) -> bool {
        matches!(self.explanation, Explanation::JointOffset(_)) && self.offset.is_none()
    }

    /// Lean of its posture beyond that of the posture as measured (rad).
    fn beyond(
        &self,
        model: &mut LeanModel,
        up: &Vector3<f64>,
        at_rest: &Vector2<f64>,
    ) -> Vector2<f64> {
        let changed = match self.explanation {
            Explanation::JointSign(joint) => [(joint, -model.position(joint)); 2],
            Explanation::JointScale(joint, double) => {
                let factor = if double { 2.0 } else { 0.5 };
                [(joint, factor * model.position(joint)); 2]
            }
            Explanation::JointsExchanged(a, b) => [(a, model.position(b)), (b, model.position(a))],
            Explanation::JointOffset(joint) => {
                let offset = self.offset.unwrap_or(0.0);
                [(joint, model.position(joint) - offset); 2]
            }
            _ => return Vector2::zeros(),
        };
        model.lean_with(&changed, up) - at_rest
    }
}
