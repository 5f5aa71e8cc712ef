//! The step below which the paper's problem steers the wrong way.
//!
//! A step of length t to the acceleration a changes the loads by (A + t^2 X) a: at once by inertia, A =
//! dN/dxdd, and by the new position, X = dN/dx. On most machines the two pull apart: pushing the body
//! forward unloads the front now. With d the differences of the loads that the cost counts and W their
//! weights, the step that lowers the cost of the step lowers that of the position too where
//! ```text
//!     S(8)   d_X' W (d_A + t^2 d_X) > 0
//! ```
//! which holds from T* on; by one variable T*^2 = -(d_X' W d_A) / (d_X' W d_X), the ratio of the
//! difference front - rear by acceleration and by position where that is what counts.

use super::instant::Instant;
use super::prospect::{Own, Prospect, SuspendedMachine};
use super::weights::Weights;
use crate::coordinate::Motion;
use crate::number::Dual;

/// T* must not be nearer to the step than this factor.
pub(super) const STEP_FACTOR: f64 = 1.5;

/// How the loads answer to the rods, at rest in one position, and what follows for the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CriticalStep {
    /// T* (s); `None` where it is not real: where loads do not depend on the rods' position, or
    /// inertia does not work against it.
    pub time: Option<f64>,
    /// Load of the front wheels less that of the rear, all rods moving alike, by their position (N/m).
    pub front_less_rear_by_position: f64,
    /// The same by their acceleration (N s^2/m).
    pub front_less_rear_by_acceleration: f64,
}

/// Scratch to find [`CriticalStep`]s.
#[derive(Debug)]
pub(super) struct StepFinder {
    prospect: Prospect<Dual<f64>>,
    by_position: [Vec<f64>; 2],
    by_acceleration: [Vec<f64>; 2],
    rods: Vec<Motion<Dual<f64>>>,
    /// 1 for wheels in front of the middle, -1 behind it.
    in_front: Vec<f64>,
}

impl StepFinder {
    pub(super) fn new(suspended: &SuspendedMachine) -> Self {
        let wheels = &suspended.machine.wheels;
        let middle = wheels.iter().map(|w| w.centre_at_zero.x).sum::<f64>() / wheels.len() as f64;
        let side = |w: &crate::machine::Wheel| (w.centre_at_zero.x - middle).signum();
        let none = || vec![0.0; wheels.len()];
        Self {
            prospect: Prospect::new(suspended),
            by_position: [none(), none()],
            by_acceleration: [none(), none()],
            rods: vec![Motion::zero(); suspended.linkages.len()],
            in_front: wheels.iter().map(side).collect(),
        }
    }

    /// At an instant, with the rods at rest at `positions` (m); the variables of the problem are the
    /// rods one by one where they are `independent`, else all of them together.
    pub(super) fn find(
        &mut self,
        suspended: &SuspendedMachine,
        instant: &Instant,
        positions: &[f64],
        weights: &Weights,
        independent: bool,
    ) -> CriticalStep {
        let variables = if independent { positions.len() } else { 1 };
        for variable in 0..variables {
            let moved = |rod: usize| !independent || rod == variable;
            self.answer(suspended, instant, positions, moved, Own::AtRest);
            for (by, otf) in self.by_position[variable]
                .iter_mut()
                .zip(&self.prospect.otf)
            {
                *by = otf.slope;
            }
            self.answer(suspended, instant, positions, moved, Own::InMotion);
            for (by, otf) in self.by_acceleration[variable]
                .iter_mut()
                .zip(&self.prospect.otf)
            {
                *by = otf.slope;
            }
        }
        let front_less_rear = |by: &[Vec<f64>; 2]| -> f64 {
            let of = |by: &Vec<f64>| -> f64 {
                by.iter()
                    .zip(&self.in_front)
                    .map(|(by, side)| by * side)
                    .sum()
            };
            by[..variables].iter().map(of).sum()
        };
        CriticalStep {
            time: self.time(weights, variables),
            front_less_rear_by_position: front_less_rear(&self.by_position),
            front_less_rear_by_acceleration: front_less_rear(&self.by_acceleration),
        }
    }

    /// Loads by the position, or the acceleration, of the rods for which `moved` holds.
    fn answer(
        &mut self,
        suspended: &SuspendedMachine,
        instant: &Instant,
        positions: &[f64],
        moved: impl Fn(usize) -> bool,
        own: Own,
    ) {
        for (i, (rod, &position)) in self.rods.iter_mut().zip(positions).enumerate() {
            *rod = Motion::zero();
            rod.position.value = position;
            let by = if moved(i) { 1.0 } else { 0.0 };
            match own {
                Own::AtRest => rod.position.slope = by,
                Own::InMotion => rod.acceleration.slope = by,
            }
        }
        self.prospect
            .fill(suspended, instant, &self.rods, own, false);
    }

    /// T* of S(8): the root of the largest l with det(M + l X) = 0, M the symmetric part of d_X' W d_A
    /// and X that of d_X' W d_X.
    fn time(&self, weights: &Weights, variables: usize) -> Option<f64> {
        let product = |a: &[f64], b: &[f64]| weights.product(a, b);
        let (x, a) = (&self.by_position, &self.by_acceleration);
        let mixed = |i: usize, j: usize| 0.5 * (product(&x[i], &a[j]) + product(&x[j], &a[i]));
        let plain = |i: usize, j: usize| product(&x[i], &x[j]);
        let square = if variables == 1 {
            -mixed(0, 0) / plain(0, 0)
        } else {
            // q l^2 + p l + c = 0
            let q = plain(0, 0) * plain(1, 1) - plain(0, 1) * plain(0, 1);
            let p = mixed(0, 0) * plain(1, 1) + mixed(1, 1) * plain(0, 0)
                - 2.0 * mixed(0, 1) * plain(0, 1);
            let c = mixed(0, 0) * mixed(1, 1) - mixed(0, 1) * mixed(0, 1);
            let root = (p * p - 4.0 * q * c).max(0.0).sqrt();
            (root - p) / (2.0 * q)
        };
        (square.is_finite() && square > 0.0).then(|| square.sqrt())
    }
}
