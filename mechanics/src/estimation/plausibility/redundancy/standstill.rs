//! Encoders that repeat themselves bit for bit among encoders that flicker.
//!
//! An encoder at rest may repeat itself: many do not flicker. So this alone is no fault. But where most encoders of the
//! arm flicker and one does not, less lean of the platform suffices to show that its joint moves: see
//! [`super::lean_difference`].

use crate::machine::{JointCoupling, Machine};

/// Number of identical readings after which an encoder stands out (samples), and with which it still flickers.
const STANDS: u32 = 50;
const FLICKERS: u32 = 20;
/// Number of samples after which the noise of an encoder is known.
const KNOWN: u32 = 64;
/// Weight of a sample in the share of turning points.
const WEIGHT: f64 = 1.0 / 64.0;
/// Two of three samples of white noise are turning points, but only few of a smooth signal.
const NOISY_SHARE: f64 = 0.4;

/// The readings of all joints that weigh on the wheels.
#[derive(Debug, Clone)]
pub(super) struct Standstill {
    joints: Vec<Readings>,
}

/// How the reading of a joint changes.
#[derive(Debug, Clone)]
struct Readings {
    /// Neither a wheel nor a joint that carries one.
    is_of_arm: bool,
    last: f64,
    step: f64,
    /// Number of consecutive identical readings.
    run: u32,
    samples: u32,
    turning_share: f64,
    /// Whether it has shown noise.
    is_noisy: bool,
}

impl Standstill {
    pub(super) fn new(machine: &Machine) -> Self {
        let mut carries_wheel = vec![false; machine.bodies.len()];
        for wheel in machine.wheels() {
            let mut body = wheel.body;
            while body != 0 {
                carries_wheel[body] = true;
                body = machine.bodies[body].parent;
            }
        }
        let joints = machine.joints().iter().enumerate();
        let joints = joints.map(|(index, joint)| {
            let moves_wheel = machine
                .bodies
                .iter()
                .zip(&carries_wheel)
                .any(|(body, carries)| {
                    *carries && matches!(body.coupling, JointCoupling::Measured(j) if j == index)
                });
            Readings {
                is_of_arm: joint.logged && joint.spins_wheel.is_none() && !moves_wheel,
                last: f64::NAN,
                step: 0.0,
                run: 0,
                samples: 0,
                turning_share: 0.0,
                is_noisy: false,
            }
        });
        Self {
            joints: joints.collect(),
        }
    }

    /// Takes a position of a joint.
    pub(super) fn take(&mut self, joint: usize, position: f64) {
        let it = &mut self.joints[joint];
        if !it.is_of_arm {
            return;
        }
        if position.to_bits() == it.last.to_bits() {
            it.run = it.run.saturating_add(1);
            return;
        }
        let step = position - it.last;
        let turns = f64::from(u8::from(step * it.step < 0.0));
        it.turning_share += WEIGHT * (turns - it.turning_share);
        (it.last, it.step, it.run) = (position, step, 1);
        it.samples = it.samples.saturating_add(1);
        it.is_noisy |= it.samples >= KNOWN && it.turning_share >= NOISY_SHARE;
    }

    /// Whether an encoder of the arm stands still among more that flicker.
    pub(super) fn stands_out(&self) -> bool {
        let arm = || self.joints.iter().filter(|it| it.is_of_arm);
        let still = arm().filter(|it| it.run >= STANDS).count();
        let flickering = arm().filter(|it| it.is_noisy && it.run < FLICKERS).count();
        still > 0 && flickering >= 2 && flickering > still
    }
}
