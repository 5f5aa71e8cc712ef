//! The assumed motion of the joints.

use super::decay::Decay;
use super::instant::Instant;
use super::law::Law;
use super::platform::Course;
use crate::geometry::coordinate::Motion;
use crate::machine::{JointCoupling, LinkGroup, Machine};

/// Role of a joint, as far as its assumed motion depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    /// Spins a wheel and rolls with the platform.
    Wheel,
    /// Passive, like the pivot of a bogie: the ground moves it, and the next ground is unknown.
    Passive,
    /// Moves the arm.
    Arm,
    /// Moves anything else: steering, a suspension.
    Other,
}

/// Assumed motion of one joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct JointLaw {
    role: Role,
    limits: [f64; 2],
    /// Deceleration of the joint if the arm stops now (rad/s^2 or m/s^2).
    deceleration: f64,
    /// Greatest rate (rad/s or m/s): no joint is asked for more.
    rate: f64,
}

impl JointLaw {
    /// The laws of all joints.
    pub(super) fn all(machine: &Machine) -> Vec<Self> {
        let spec = &machine.prediction;
        let joints = machine.joints.iter().enumerate();
        let laws = joints.map(|(joint, measured)| {
            let by_kind = match machine.joint_slides(joint) {
                true => spec.joint_deceleration_linear,
                false => spec.joint_deceleration,
            };
            let stated = spec.joints.get(&measured.name).copied().unwrap_or_default();
            Self {
                role: role(machine, joint),
                limits: measured
                    .limits
                    .unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
                deceleration: stated.deceleration.unwrap_or(by_kind),
                rate: machine.joint_bounds(joint).rate,
            }
        });
        laws.collect()
    }

    pub(super) fn moves_arm(&self) -> bool {
        self.role == Role::Arm
    }

    /// The motion of the joint at an instant, from its present one; `command` is the rate that is asked of it, NaN if none is.
    pub(super) fn at(
        &self,
        law: Law,
        now: &Motion<f64>,
        command: f64,
        instant: &Instant,
        course: &Course,
        stop_time_s: f64,
    ) -> Motion<f64> {
        match (self.role, course.speed_ratio) {
            (Role::Wheel, Some([ratio, rate])) => Motion {
                position: now.position,
                rate: now.rate * ratio,
                acceleration: now.rate * rate,
            },
            (Role::Passive, _) => Motion {
                position: now.position + now.rate * instant.shake.i,
                rate: now.rate * instant.shake.e,
                acceleration: now.acceleration * instant.shake.e,
            },
            (Role::Arm, _) if law == Law::StopArm => self.within(
                now,
                stopped(now, self.deceleration, stop_time_s, instant.time_s),
            ),
            _ if command.is_finite() => {
                let command = command.clamp(-self.rate, self.rate);
                self.within(now, commanded(now, command, instant))
            }
            _ => self.within(now, gone_on(now, instant)),
        }
    }

    /// A joint stops at its limits. One that is beyond them now stays at most as far beyond.
    fn within(&self, now: &Motion<f64>, then: Motion<f64>) -> Motion<f64> {
        let [low, high] = self.limits;
        let (low, high) = (low.min(now.position), high.max(now.position));
        if then.position > high || then.position < low {
            Motion::at_rest(then.position.clamp(low, high))
        } else {
            then
        }
    }
}

/// The acceleration dies away. A joint that slows down comes to rest and does not turn back.
fn gone_on(now: &Motion<f64>, instant: &Instant) -> Motion<f64> {
    let Motion {
        position,
        rate,
        acceleration,
    } = *now;
    let at = |time_s: f64, decay: &Decay| position + rate * time_s + acceleration * decay.d;
    let later = rate + acceleration * instant.joint.i;
    if rate * acceleration < 0.0 && rate * later <= 0.0 {
        // v + a T (1 - exp(-t / T)) = 0
        let constant_s = instant.joint_decay_s;
        let rest_s = -constant_s * (1.0 + rate / (acceleration * constant_s)).ln();
        return Motion::at_rest(at(rest_s, &Decay::after(rest_s, constant_s)));
    }
    Motion {
        position: at(instant.time_s, &instant.joint),
        rate: later,
        acceleration: acceleration * instant.joint.e,
    }
}

/// The rate comes to what is asked for, c, as a lag of first order, with the time constant of a joint's acceleration:
/// ```text
///     v(t) = c + (v - c) exp(-t / T)
/// ```
fn commanded(now: &Motion<f64>, command: f64, instant: &Instant) -> Motion<f64> {
    let behind = now.rate - command;
    Motion {
        position: now.position + command * instant.time_s + behind * instant.joint.i,
        rate: command + behind * instant.joint.e,
        acceleration: -behind * instant.joint.e / instant.joint_decay_s,
    }
}

/// Constant deceleration to rest: at least the present one, and not faster than in the shortest time.
fn stopped(now: &Motion<f64>, deceleration: f64, stop_time_s: f64, time_s: f64) -> Motion<f64> {
    let (speed, sign) = (now.rate.abs(), now.rate.signum());
    let deceleration = deceleration
        .max(-now.acceleration * sign)
        .min(speed / stop_time_s);
    let rest_s = if speed > 0.0 {
        speed / deceleration
    } else {
        0.0
    };
    if time_s >= rest_s {
        return Motion::at_rest(now.position + 0.5 * now.rate * rest_s);
    }
    Motion {
        position: now.position + now.rate * time_s - 0.5 * sign * deceleration * time_s * time_s,
        rate: now.rate - sign * deceleration * time_s,
        acceleration: -sign * deceleration,
    }
}

fn role(machine: &Machine, joint: usize) -> Role {
    if machine.joints[joint].spins_wheel.is_some() {
        return Role::Wheel;
    }
    let moves = |body: usize| match machine.bodies[body].coupling {
        JointCoupling::Root => false,
        JointCoupling::Measured(measured) => measured == joint,
        JointCoupling::Mimic {
            joint: measured, ..
        } => measured == joint,
        JointCoupling::Pivot(linkage)
        | JointCoupling::Cylinder(linkage)
        | JointCoupling::Rod(linkage) => machine.linkages[linkage].measured_joint == joint,
    };
    let free = &machine.contact.free_joints;
    if free.iter().any(|free| moves(free.body)) {
        return Role::Passive;
    }
    let arm = machine
        .links
        .iter()
        .filter(|link| link.group == LinkGroup::Arm);
    if arm.into_iter().any(|link| moves(link.body)) {
        return Role::Arm;
    }
    Role::Other
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};
    use proptest::prelude::*;

    use super::super::instant::SHAKE_S;
    use super::*;
    use crate::dynamics::kinematics::BodyMotion;
    use crate::state::BaseState;

    const STOP_S: f64 = 0.2;

    fn instant(time_s: f64) -> Instant {
        Instant {
            time_s,
            joint_decay_s: 0.3,
            joint: Decay::after(time_s, 0.3),
            platform: Decay::after(time_s, 1.0),
            shake: Decay::after(time_s, SHAKE_S),
        }
    }

    /// Euler steps of a velocity by an acceleration, which is another way than the closed form.
    fn integrated(start: &Motion<f64>, time_s: f64, at: impl Fn(f64) -> Motion<f64>) -> f64 {
        let steps = 20_000;
        let step = time_s / f64::from(steps);
        (0..steps).fold(start.position, |position, k| {
            position + step * at((f64::from(k) + 0.5) * step).rate
        })
    }

    proptest! {
        #[test]
        fn position_is_the_integral_of_the_rate(
            rate in -0.6..0.6, acceleration in -2.0..2.0, time_s in 0.05..2.0, stops: bool,
        ) {
            let now = Motion { position: 0.4, rate, acceleration };
            let at = |time_s: f64| match stops {
                true => stopped(&now, 1.5, STOP_S, time_s),
                false => gone_on(&now, &instant(time_s)),
            };
            let then = at(time_s);
            prop_assert!((then.position - integrated(&now, time_s, at)).abs() < 1e-4);
            // it never turns back on its way to rest
            if stops || rate * acceleration < 0.0 {
                prop_assert!(then.rate * rate >= 0.0 && then.rate.abs() <= rate.abs() + 1e-12);
            }
        }

        #[test]
        fn the_present_motion_is_the_start_of_going_on(rate in -1.0..1.0, acceleration in -3.0..3.0) {
            let now = Motion { position: -0.2, rate, acceleration };
            let then = gone_on(&now, &instant(0.0));
            // a joint at rest stays there until it is known to move
            prop_assert!((then.position - now.position).abs() < 1e-12);
            prop_assert!((then.rate - rate).abs() < 1e-12);
        }
    }

    #[test]
    fn joints_stop_at_their_limits_and_not_where_they_are_beyond_them() {
        let law = JointLaw {
            role: Role::Other,
            limits: [-1.0, 1.0],
            deceleration: 2.0,
            rate: 1.0,
        };
        let at = |position: f64, rate: f64| {
            let now = Motion {
                position,
                rate,
                acceleration: 0.0,
            };
            law.within(&now, gone_on(&now, &instant(1.0)))
        };
        assert_eq!(at(0.5, 0.4).position, 0.9);
        let stopped = at(0.5, 0.6);
        assert_eq!((stopped.position, stopped.rate), (1.0, 0.0));
        assert_eq!(at(-0.5, -0.6).position, -1.0);
        // an encoder that reads beyond the limit: no jump back, and the way back is free
        assert_eq!(at(1.2, 0.4).position, 1.2);
        assert_eq!(at(1.2, -0.4).position, 1.2 - 0.4);
    }

    #[test]
    fn a_joint_comes_to_the_rate_that_is_asked_for_and_to_no_other() {
        let now = Motion {
            position: 0.1,
            rate: 0.3,
            acceleration: 4.0,
        };
        let at = |time_s: f64, command: f64| commanded(&now, command, &instant(time_s));
        for command in [0.0, -0.5, 0.8] {
            let [start, late] = [0.0, 9.0].map(|time_s| at(time_s, command));
            assert!((start.position - 0.1).abs() < 1e-12 && (start.rate - 0.3).abs() < 1e-12);
            assert!((late.rate - command).abs() < 1e-12 && late.acceleration.abs() < 1e-12);
            let then = at(0.7, command);
            let integral = integrated(&now, 0.7, |time_s| at(time_s, command));
            assert!((then.position - integral).abs() < 1e-8);
            let step = 1e-6;
            let slope =
                (at(0.7 + step, command).rate - at(0.7 - step, command).rate) / (2.0 * step);
            assert!((then.acceleration - slope).abs() < 1e-6);
        }
    }

    #[test]
    fn what_is_asked_for_moves_neither_a_joint_that_stops_nor_one_that_nobody_drives() {
        let now = Motion {
            position: 0.0,
            rate: 0.2,
            acceleration: 0.0,
        };
        let course = Course {
            base: BodyMotion {
                rotation: Matrix3::identity(),
                origin: Vector3::zeros(),
                velocity: Vector3::zeros(),
                specific_force: Vector3::zeros(),
                angular_velocity: Vector3::zeros(),
                angular_acceleration: Vector3::zeros(),
            },
            known: BaseState::unknown(),
            speed_ratio: None,
        };
        let rate = |role: Role, law: Law, command: f64| {
            let joint = JointLaw {
                role,
                limits: [-9.0, 9.0],
                deceleration: 2.0,
                rate: 0.5,
            };
            joint
                .at(law, &now, command, &instant(9.0), &course, STOP_S)
                .rate
        };
        assert_eq!(rate(Role::Arm, Law::GoOn, f64::NAN), 0.2);
        assert!((rate(Role::Arm, Law::GoOn, -0.4) + 0.4).abs() < 1e-9);
        assert!((rate(Role::Arm, Law::BrakeNow, -0.4) + 0.4).abs() < 1e-9);
        assert_eq!(rate(Role::Arm, Law::StopArm, -0.4), 0.0);
        // not faster than it can
        assert!((rate(Role::Arm, Law::GoOn, 90.0) - 0.5).abs() < 1e-9);
        let passive = |command: f64| rate(Role::Passive, Law::GoOn, command);
        assert_eq!(passive(0.4), passive(f64::NAN));
    }

    #[test]
    fn stop_takes_the_shortest_time_at_least() {
        let now = Motion {
            position: 0.0,
            rate: 0.1,
            acceleration: 0.0,
        };
        assert!(stopped(&now, 100.0, STOP_S, 0.19).rate > 0.0);
        assert_eq!(stopped(&now, 100.0, STOP_S, 0.2).rate, 0.0);
        assert!((stopped(&now, 100.0, STOP_S, 1.0).position - 0.01).abs() < 1e-12);
        let resting = Motion::zero();
        assert_eq!(stopped(&resting, 2.0, STOP_S, 0.0), Motion::zero());
    }
}
