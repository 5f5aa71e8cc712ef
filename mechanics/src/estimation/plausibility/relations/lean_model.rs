//! Predicted lean of the platform by the measured motion of the joints.
//!
//! Over the point below the base origin on the ground, with the force F and the moment M of the weight and of what is measured
//! on the tool, and the momentum P and angular momentum H of every body but the wheels, the tyres carry the load
//! `W = dP_z/dt - F_z` and the moment `N = dH/dt - M`. With the tyres' vertical stiffness k at (x, y), the platform sinks by the
//! plane `z = p0 + p1 x + p2 y`:
//! ```text
//!     sum k a a' p = (W, -N_y, N_x),  a = (1, x, y),   lean by the tyres = (-p2, p1)
//! ```
//! Tyres push and cannot pull: the sum is over those that carry load, and once one has left the ground the others carry it.
//! The weight is that of all bodies and of the payloads that are attached. The specific force stands for gravity, so that F and M
//! contain the acceleration of the platform. The derivative of P and H is that of their low-pass filter:
//! `L(L(dH/dt)) = (L(H) - L(L(H))) / T`. Where wheels move on a suspension, the plane through their centres,
//! `z = s0 + s1 x + s2 y`, leans the platform by `(-s2, s1)` more. An axle on a pivot shares its load evenly, and what its angle
//! leans is measured so. At its stop it is one with the platform: which wheels carry then depends on the ground, which is unknown.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector1, Vector2, Vector3};

use super::low_pass::{LowPass, share};
use super::rolling::{Rolled, Rolling};
use crate::dynamics::kinematics::{self, BodyMotion};
use crate::geometry::coordinate::{Coordinate, Motion};
use crate::geometry::spatial::Wrench;
use crate::machine::{
    Body, Inertia, JointCoupling, LinkGroup, Machine, MeasuredJoint, Mount, Parameter, Wheel,
};
use crate::state::State;

/// Time constant of both low-pass filters (s): slower than the platform swings on its tyres.
pub(super) const SMOOTHED_S: f64 = 0.1;
/// Time constant of the up direction of a machine that travels (s), and of one that stands.
const LEVELLED_S: f64 = 3.0;
const STANDING_S: f64 = 0.05;
/// Smallest load with which a wheel carries for certain, as a share of the mean load, and least determinant of the stiffness of the
/// wheels that carry a platform without the others, as a share of that of all.
const LEAST_LOAD: f64 = 0.02;
const SOLVABLE: f64 = 1e-3;
/// Standard deviations of its zero within which an axle on a pivot may be at its stop.
const STOP_SIGMAS: f64 = 3.0;

/// The model, with its filters.
#[derive(Debug, Clone)]
pub(super) struct LeanModel {
    /// The machine, in the heap: the estimator is moved by value, and this is most of it.
    machine: Box<Machine>,
    state: State<f64>,
    coordinates: Vec<Coordinate<f64>>,
    pub(super) motions: Vec<BodyMotion<f64>>,
    /// Bodies that spin as wheels.
    spins: Vec<bool>,
    is_known: Vec<bool>,
    has_rate: Vec<bool>,
    /// Positions of the joints (rad or m), smoothed like the lean.
    smoothed: Vec<[LowPass<1>; 2]>,
    /// Room for the exact positions while the smoothed ones stand in for them.
    exact: Vec<f64>,
    rolling: Rolling,
    /// The joints of axles on a pivot that have stops, and between which positions each swings for certain (rad).
    swinging: Vec<(usize, [f64; 2])>,
    /// Whether the machine file states the stiffness of the tyres, and nothing else gives way.
    pub(super) stiffness_is_known: bool,
    /// Plane by which the platform sinks per (W, -N_y, N_x).
    sink: Matrix3<f64>,
    /// Determinant of the sum that `sink` inverts.
    determinant: f64,
    /// Stiffness of each tyre (N/m).
    stiffness: Vec<f64>,
    /// Centre of the tyres' stiffness (m): about it, a lean shifts load and adds none.
    centre: Vector2<f64>,
    /// Mean load of a wheel under the machine alone (N).
    mean_load: f64,
    /// Rotation of the tool's frame in its body.
    body_from_tool: Option<Matrix3<f64>>,
    /// Largest lean while wheels carry the machine (rad): the whole weight on the farthest wheel.
    pub(super) largest: f64,
    /// Height of the ground in the base frame (m).
    ground: f64,
    /// The body at the end of the arm.
    tip: Option<usize>,
    /// Force and moment on the tool (N, N m; in its frame), where they are measured.
    pub(super) tool_wrench: [Vector3<f64>; 2],
    slow_up: LowPass<3>,
    up: LowPass<3>,
    lean: [LowPass<2>; 2],
    momentum: [LowPass<3>; 2],
}

/// Wheels that the platform stands on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Footing {
    AllWheels,
    FewerWheels,
    /// No wheels carry the platform without the others: it tips.
    Tips,
}

/// A lean on tyres (rad).
#[derive(Debug, Clone, Copy)]
pub(super) struct Tilted {
    /// Lean (rad); of a platform that tips, the lean on tyres that pull.
    pub(super) angle: Vector2<f64>,
    pub(super) on: Footing,
}

impl Tilted {
    fn tipping(self) -> Self {
        Self {
            on: Footing::Tips,
            ..self
        }
    }
}

/// Lean of a platform on its tyres.
#[derive(Debug, Clone)]
pub struct LeanOnTyres(LeanModel);

impl LeanOnTyres {
    /// `None` where the wheels stand on one line or come and go, the IMU is not on the base, or a suspension gives way.
    #[must_use]
    pub fn of(machine: &Machine) -> Option<Self> {
        let model = LeanModel::new(machine)?;
        machine.suspension().is_none().then_some(Self(model))
    }

    /// Whether the machine file states the stiffness of the tyres, and nothing else gives way.
    #[must_use]
    pub fn stiffness_is_stated(&self) -> bool {
        self.0.stiffness_is_known
    }

    /// Lean about x and y (rad) under the wrench of the ground about the base origin, in base axes.
    #[must_use]
    pub fn lean(&self, ground: &Wrench<f64>) -> Vector2<f64> {
        self.0.lean_by_tyres(&self.load(ground))
    }

    /// The smallest load of a tyre under this wrench, as a share of the mean load under the machine alone.
    #[must_use]
    pub fn least_load(&self, ground: &Wrench<f64>) -> f64 {
        self.0.least_load(&self.load(ground), &Vector2::zeros())
    }

    fn load(&self, ground: &Wrench<f64>) -> Vector3<f64> {
        let below = Vector3::z() * self.0.ground;
        load_of(&ground.force, &(ground.moment - below.cross(&ground.force)))
    }
}

/// The lean of one sample.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lean {
    /// About x and y (rad), smoothed, but for a constant.
    pub(super) angle: Vector2<f64>,
    /// Lean by a load on the end of the arm (rad/kg); zero without an arm.
    pub(super) by_load: Vector2<f64>,
    /// Whether every wheel carries load.
    pub(super) is_on_all_wheels: bool,
    /// Whether a load of unknown mass is attached, an axle on a pivot is at its stop, or the platform tips.
    pub(super) is_beyond_model: bool,
}

impl LeanModel {
    /// `None` where the wheels stand on one line, or the IMU is not on the base.
    pub(super) fn new(machine: &Machine) -> Option<Self> {
        if machine.supports().vary() {
            // jacks and soft ground lean the platform too
            return None;
        }
        if machine.imu().body != 0 {
            return None;
        }
        let wheels = machine.wheels();
        let weight = machine.mass() * machine.gravity();
        let stiffness = Wheel::stiffnesses(wheels, weight);
        let (mut sum, mut ground) = (Matrix3::<f64>::zeros(), 0.0);
        for (wheel, stiffness) in wheels.iter().zip(&stiffness) {
            let centre = wheel.centre_at_zero;
            let a = Vector3::new(1.0, centre.x, centre.y);
            sum += a * a.transpose() * *stiffness;
            ground += (centre.z - wheel.radius) / wheels.len() as f64;
        }
        let sink = sum
            .try_inverse()
            .filter(|m| m.iter().all(|v| v.is_finite()))?;
        let centre = Vector2::new(sum[(0, 1)], sum[(0, 2)]) / sum[(0, 0)];
        let reach = wheels.iter().map(|wheel| wheel.centre_at_zero.xy().norm());
        let per_moment = sink.fixed_view::<2, 2>(1, 1).norm();
        let largest = per_moment * weight * reach.fold(0.0, f64::max);
        let spins_wheel = |joint: usize| machine.joints()[joint].spins_wheel.is_some();
        let spins = (machine.bodies.iter())
            .map(|body| matches!(body.coupling, JointCoupling::Measured(j) if spins_wheel(j)));
        let rest = BodyMotion::base(Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
        let is_given = |joint: &MeasuredJoint| joint.constant.is_some() || !joint.logged;
        Some(Self {
            mean_load: weight / wheels.len() as f64,
            body_from_tool: machine.tool().map(Mount::rotation_in_body),
            state: State::with_constants(machine),
            coordinates: vec![Coordinate::slid(0.0, 0.0, 0.0); machine.bodies.len()],
            motions: vec![rest; machine.bodies.len()],
            spins: spins.collect(),
            is_known: machine.joints().iter().map(is_given).collect(),
            has_rate: vec![false; machine.joints().len()],
            exact: vec![0.0; machine.joints().len()],
            smoothed: (machine.joints().iter())
                .map(|_| [LowPass::new(SMOOTHED_S), LowPass::new(SMOOTHED_S)])
                .collect(),
            rolling: Rolling::new(machine),
            swinging: swinging(machine),
            stiffness_is_known: Wheel::have_stiffness(wheels) && machine.suspension().is_none(),
            determinant: sum.determinant(),
            sink,
            stiffness,
            centre,
            largest,
            ground,
            tip: tip_of_arm(machine),
            tool_wrench: [Vector3::zeros(); 2],
            slow_up: LowPass::new(LEVELLED_S),
            up: LowPass::new(STANDING_S),
            lean: [LowPass::new(SMOOTHED_S), LowPass::new(SMOOTHED_S)],
            momentum: [LowPass::new(SMOOTHED_S), LowPass::new(SMOOTHED_S)],
            machine: Box::new(machine.clone()),
        })
    }

    pub(super) fn reset(&mut self) {
        self.slow_up.reset();
        self.up.reset();
        self.lean.iter_mut().for_each(LowPass::reset);
        self.momentum.iter_mut().for_each(LowPass::reset);
        (self.smoothed.iter_mut().flatten()).for_each(LowPass::reset);
    }

    /// Takes the specific force in base axes, and the degree to which the ground may rock the platform (0 to 1). Returns the
    /// specific force that stands for gravity, upwards (m/s^2).
    pub(super) fn level(&mut self, dt: f64, force: &Vector3<f64>, rocking: f64) -> Vector3<f64> {
        let slow = self.slow_up.step(dt, force);
        let slow = slow.try_normalize(1e-3).unwrap_or_else(Vector3::z);
        let fast = self.up.step(dt, force);
        fast * (1.0 - rocking) + slow * (rocking * self.machine.gravity())
    }

    /// Takes the motion of a joint. Some loggers give no velocities: then the arm's momentum is unknown, and taken as
    /// constant.
    pub(super) fn set(&mut self, joint: usize, position: f64, rate: f64) {
        self.is_known[joint] = true;
        self.has_rate[joint] = rate.is_finite();
        let rate = if rate.is_finite() { rate } else { 0.0 };
        self.state.joints[joint] = Motion {
            position,
            rate,
            acceleration: 0.0,
        };
    }

    /// Attaches and releases payloads by the time since the first sample; returns whether that changed anything.
    pub(super) fn attach(&mut self, time_s: f64) -> bool {
        let mut changed = false;
        for (share, payload) in (self.state.payload_share.iter_mut()).zip(&self.machine.payloads) {
            let [from_s, to_s] = payload.window_s;
            let now = if payload.signal.is_none() && from_s <= time_s && time_s < to_s {
                1.0
            } else {
                0.0
            };
            changed |= std::mem::replace(share, now) != now;
        }
        changed
    }

    /// The lean under gravity, turned `up`; `None` while a joint is unknown.
    pub(super) fn lean(&mut self, dt: f64, up: &Vector3<f64>) -> Option<Lean> {
        // a mass that a signal states is not known here
        let mut payloads = self.machine.payloads.iter();
        let is_signalled = payloads.any(|it| it.signal.is_some());
        if is_signalled || !self.is_known.iter().all(|known| *known) {
            return None;
        }
        let Weighed {
            mass,
            first,
            momentum,
            has_unknown_load,
        } = self.weigh_bodies();
        let carried = self.load(mass, &first, up);
        let tilted = self.lean_of(&carried);
        let mut smoothed = tilted.angle + self.plane_of_wheels();
        let share = share(dt, SMOOTHED_S);
        for filter in &mut self.lean {
            smoothed = filter.step_by(share, &smoothed);
        }
        for (filters, joint) in self.smoothed.iter_mut().zip(&self.state.joints) {
            let mut position = Vector1::new(joint.position);
            let last = filters[0].value();
            if last.is_some_and(|last| (position.x - last.x).abs() > PI) {
                // an angle that wraps has not passed through the postures between
                filters.iter_mut().for_each(LowPass::reset);
            }
            for filter in filters {
                position = filter.step_by(share, &position);
            }
        }
        let [once, twice] = &mut self.momentum;
        let once = once.step_by(share, &momentum);
        let change = (once - twice.step_by(share, &once)) / SMOOTHED_S;
        let angle = smoothed + self.lean_by_tyres(&change);
        let tip = self.tip.map_or_else(Vector3::zeros, |tip| {
            let motion = &self.motions[tip];
            motion.origin + motion.rotation * self.machine.bodies[tip].inertia.com
        });
        let by_load = match self.tip {
            Some(_) => self.lean_by_tyres(&load_of(up, &tip.cross(up))),
            None => Vector2::zeros(),
        };
        let on = self.lean_of(&(carried + change)).on;
        let is_at_stop = self.swinging.iter().any(|&(joint, [least, greatest])| {
            !(least..=greatest).contains(&self.state.joints[joint].position)
        });
        let lean = Lean {
            angle,
            by_load,
            is_on_all_wheels: on == Footing::AllWheels,
            is_beyond_model: has_unknown_load || is_at_stop || on == Footing::Tips,
        };
        angle.iter().all(|v| v.is_finite()).then_some(lean)
    }

    /// The lean of a machine at rest in the posture that is set, not smoothed.
    pub(super) fn posture_lean(&mut self, up: &Vector3<f64>) -> Vector2<f64> {
        let load = self.posture_load(up);
        self.lean_of(&load).angle + self.plane_of_wheels()
    }

    /// Whether every wheel carries load under this (W, -N_y, N_x).
    pub(super) fn is_on_all_wheels(&self, load: &Vector3<f64>) -> bool {
        self.least_load(load, &Vector2::zeros()) >= LEAST_LOAD
    }

    /// The lean (rad) with which every wheel carries load, under this (W, -N_y, N_x).
    pub(super) fn lean_on_all_wheels(&self, load: &Vector3<f64>) -> Vector2<f64> {
        self.lean_by_tyres(load) + self.plane_of_wheels()
    }

    fn lean_by_tyres(&self, load: &Vector3<f64>) -> Vector2<f64> {
        lean_by(&(self.sink * load))
    }

    /// The lean under this (W, -N_y, N_x) on tyres that push and cannot pull: those that the platform leaves are left out until
    /// the others carry it.
    pub(super) fn lean_of(&self, load: &Vector3<f64>) -> Tilted {
        let of = |sink: &Matrix3<f64>, on| {
            let plane = sink * load;
            let angle = lean_by(&plane);
            (plane, Tilted { angle, on })
        };
        let wheels = self.machine.wheels();
        let (mut plane, on_all) = of(&self.sink, Footing::AllWheels);
        if self.least_load(load, &Vector2::zeros()) >= 0.0 {
            return on_all;
        }
        let mut tilted = on_all;
        // one bit a wheel; those from the 64th on leave together
        let mut left = 0_u64;
        for _ in 0..wheels.len() {
            let (mut least, mut leaves, mut sum) = (f64::INFINITY, 0, Matrix3::zeros());
            for (place, (wheel, stiffness)) in wheels.iter().zip(&self.stiffness).enumerate() {
                let a = Vector3::new(1.0, wheel.centre_at_zero.x, wheel.centre_at_zero.y);
                let share = stiffness * a.dot(&plane) / self.mean_load;
                match left >> place.min(63) & 1 == 0 {
                    true if share < 0.0 => leaves |= 1 << place.min(63),
                    true => {
                        least = least.min(share);
                        sum += a * a.transpose() * *stiffness;
                    }
                    false => {}
                }
            }
            if leaves == 0 {
                return match least >= LEAST_LOAD {
                    true => tilted,
                    false => on_all.tipping(),
                };
            }
            left |= leaves;
            let is_solvable = sum.determinant() > SOLVABLE * self.determinant;
            let Some(sink) = sum.try_inverse().filter(|_| is_solvable) else {
                break;
            };
            (plane, tilted) = of(&sink, Footing::FewerWheels);
        }
        on_all.tipping()
    }

    /// The load (W, -N_y, N_x) on the tyres of a machine at rest in the posture that is set (N, N m).
    pub(super) fn posture_load(&mut self, up: &Vector3<f64>) -> Vector3<f64> {
        let (ground, mut mass, mut first) = (self.ground, 0.0, Vector3::zeros());
        self.move_bodies(BodyMotion::carry_at_rest, |motion, inertia, share, _| {
            mass += inertia.mass * share;
            first += place_above(ground, motion, inertia) * inertia.mass * share;
        });
        self.load(mass, &first, up)
    }

    /// Returns the load (W, -N_y, N_x) of masses at rest, by their first moment (kg m), and of the measured tool wrench.
    fn load(&self, mass: f64, first: &Vector3<f64>, up: &Vector3<f64>) -> Vector3<f64> {
        let [force, moment] = self.on_tool();
        load_of(&(up * mass - force), &(first.cross(up) - moment))
    }

    /// Takes the load of a state: its payloads and the measured tool wrench.
    pub(super) fn carry(&mut self, state: &State<f64>) {
        let shares = &mut self.state.payload_share;
        shares.copy_from_slice(&state.payload_share);
        self.tool_wrench = [state.tool_wrench.force, state.tool_wrench.moment];
    }

    /// Returns the lean at rest in the smoothed posture, as late as the smoothed lean, with other positions of some joints.
    pub(super) fn lean_with(
        &mut self,
        changed: &[(usize, f64)],
        up: &Vector3<f64>,
    ) -> Vector2<f64> {
        for joint in 0..self.smoothed.len() {
            let smoothed = self.position(joint);
            self.exact[joint] = std::mem::replace(&mut self.state.joints[joint].position, smoothed);
        }
        for &(joint, position) in changed {
            self.state.joints[joint].position = position;
        }
        let lean = self.posture_lean(up);
        for (joint, exact) in self.state.joints.iter_mut().zip(&self.exact) {
            joint.position = *exact;
        }
        lean
    }

    /// Gravity (m/s^2).
    pub(super) fn gravity(&self) -> f64 {
        self.machine.gravity()
    }

    /// Position of a joint, as late as the smoothed lean.
    pub(super) fn position(&self, joint: usize) -> f64 {
        let of_state = self.state.joints[joint].position;
        self.smoothed[joint][1].value().map_or(of_state, |it| it.x)
    }

    /// Moves all bodies and sums up their moments.
    pub(super) fn weigh_bodies(&mut self) -> Weighed {
        let (ground, mut mass) = (self.ground, 0.0);
        let (mut first, mut momentum) = (Vector3::zeros(), Vector3::zeros());
        let has_unknown_load = self.move_bodies(
            BodyMotion::carry_velocity,
            |motion, inertia, share, spins| {
                let place = place_above(ground, motion, inertia);
                mass += inertia.mass * share;
                first += place * inertia.mass * share;
                if !spins {
                    momentum += momentum_of(motion, inertia, &place) * share;
                }
            },
        );
        Weighed {
            mass,
            first,
            momentum,
            has_unknown_load,
        }
    }

    /// Moves all bodies by `carry`. `visit` receives the motion and inertia of each body and of each payload, its attached share
    /// (0 to 1), and whether it spins as a wheel. Returns whether a load of unknown mass is attached.
    #[inline(always)]
    fn move_bodies(
        &mut self,
        carry: impl Fn(&BodyMotion<f64>, &Body, &Coordinate<f64>) -> BodyMotion<f64>,
        mut visit: impl FnMut(&BodyMotion<f64>, &Inertia, f64, bool),
    ) -> bool {
        let machine = &self.machine;
        kinematics::coordinates(machine, &self.state, &mut self.coordinates);
        for (i, body) in machine.bodies.iter().enumerate() {
            if i > 0 {
                self.motions[i] = carry(&self.motions[body.parent], body, &self.coordinates[i]);
            }
            visit(&self.motions[i], &body.inertia, 1.0, self.spins[i]);
        }
        let mut has_unknown_load = false;
        for (payload, &share) in machine.payloads.iter().zip(&self.state.payload_share) {
            visit(&self.motions[payload.body], &payload.inertia, share, false);
            let is_unknown = payload.is_weighed() || payload.inertia.mass == 0.0;
            has_unknown_load |= payload.is_estimated && is_unknown && share > 0.0;
        }
        has_unknown_load
    }

    /// The motion by the wheels, in the posture of the last [`Self::lean`].
    pub(super) fn rolled(&self) -> Option<Rolled> {
        let rate = |joint: usize| match self.has_rate[joint] {
            true => self.state.joints[joint].rate,
            false => f64::NAN,
        };
        self.rolling.motion(&self.motions, rate)
    }

    /// The measured force on the tool (N), and its moment about the point on the ground (N m).
    fn on_tool(&self) -> [Vector3<f64>; 2] {
        let (Some(tool), Some(body_from_tool)) = (self.machine.tool(), &self.body_from_tool) else {
            return [Vector3::zeros(); 2];
        };
        let (motion, mount) = (&self.motions[tool.body], &tool.body_from_mount);
        let turned = motion.rotation * body_from_tool;
        let place = motion.origin + motion.rotation * mount.translation.vector;
        let [force, moment] = self.tool_wrench.map(|vector| turned * vector);
        let about_ground = (place - Vector3::z() * self.ground).cross(&force) + moment;
        [force, about_ground]
    }

    /// Lean because the wheels move on a suspension (rad).
    fn plane_of_wheels(&self) -> Vector2<f64> {
        let mut sum = Vector3::zeros();
        for (wheel, stiffness) in self.machine.wheels().iter().zip(&self.stiffness) {
            let (motion, at_zero) = (&self.motions[wheel.body], wheel.centre_at_zero);
            let centre = motion.origin + motion.rotation * wheel.centre_in_body;
            let raised = (centre.z - at_zero.z) * stiffness;
            sum += Vector3::new(1.0, at_zero.x, at_zero.y) * raised;
        }
        lean_by(&(self.sink * sum))
    }

    /// The smallest load of a tyre under this (W, -N_y, N_x) and a lean beyond that of it (rad), as a share of the mean load.
    ///
    /// ```text
    ///     z = p0 + p1 x + p2 y + l_y (x - x_c) - l_x (y - y_c),    load = k z
    /// ```
    pub(super) fn least_load(&self, load: &Vector3<f64>, more: &Vector2<f64>) -> f64 {
        let wheels = self.machine.wheels();
        let plane = self.sink * load;
        let loads = wheels
            .iter()
            .zip(&self.stiffness)
            .map(|(wheel, stiffness)| {
                let at = wheel.centre_at_zero.xy();
                let from_centre = at - self.centre;
                let sunk = plane.x + plane.y * at.x + plane.z * at.y;
                let sunk = sunk + more.y * from_centre.x - more.x * from_centre.y;
                stiffness * sunk / self.mean_load
            });
        loads.fold(f64::INFINITY, f64::min)
    }
}

/// Sums over all bodies and the payloads attached to them, about the point on the ground.
pub(super) struct Weighed {
    /// Mass (kg) and first moment (kg m).
    mass: f64,
    first: Vector3<f64>,
    /// The momentum (P_z, -H_y, H_x) of all but the wheels (N s, N m s).
    pub(super) momentum: Vector3<f64>,
    /// Whether a load of unknown mass is attached.
    pub(super) has_unknown_load: bool,
}

/// The momentum (P_z, -H_y, H_x) of a body whose centre of mass is there (N s, N m s).
fn momentum_of(motion: &BodyMotion<f64>, inertia: &Inertia, place: &Vector3<f64>) -> Vector3<f64> {
    let w = &motion.angular_velocity;
    let linear = (motion.velocity + w.cross(&(motion.rotation * inertia.com))) * inertia.mass;
    // The inertia tensor is not turned into base axes: three products with a vector cost less than two of matrices.
    let own = motion.rotation * (inertia.about_com * motion.rotation.tr_mul(w));
    load_of(&linear, &(place.cross(&linear) + own))
}

/// (W, -N_y, N_x) of a force and a moment.
fn load_of(force: &Vector3<f64>, moment: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(force.z, -moment.y, moment.x)
}

/// The lean (rad) about x and y by a plane.
fn lean_by(plane: &Vector3<f64>) -> Vector2<f64> {
    Vector2::new(-plane.z, plane.y)
}

/// Centre of mass about the point on the ground (m).
fn place_above(ground: f64, motion: &BodyMotion<f64>, inertia: &Inertia) -> Vector3<f64> {
    motion.origin + motion.rotation * inertia.com - Vector3::z() * ground
}

/// Returns the joints of axles on a pivot that have stops, and between which positions each swings for certain (rad).
fn swinging(machine: &Machine) -> Vec<(usize, [f64; 2])> {
    let axles = machine.contact().free_joints.iter();
    let measured = axles.filter_map(|axle| match machine.bodies[axle.body].coupling {
        JointCoupling::Measured(joint) => Some(joint),
        _ => None,
    });
    let between = |joint: usize| {
        let limits = machine.joints()[joint].limits;
        let [least, greatest] = limits.filter(|[least, greatest]| least < greatest)?;
        let margin = STOP_SIGMAS * Parameter::JointPosition(joint).sigma(machine);
        Some((joint, [least + margin, greatest - margin]))
    };
    measured.filter_map(between).collect()
}

/// The arm's body at the end of the longest chain of bodies.
fn tip_of_arm(machine: &Machine) -> Option<usize> {
    let mut depth = vec![0_usize; machine.bodies.len()];
    for i in 1..machine.bodies.len() {
        depth[i] = depth[machine.bodies[i].parent] + 1;
    }
    let is_arm = |i: &usize| {
        let parts = &machine.bodies[*i].parts;
        parts.iter().any(|(group, _)| *group == LinkGroup::Arm)
    };
    (0..depth.len()).filter(is_arm).max_by_key(|i| depth[*i])
}
