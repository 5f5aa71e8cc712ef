//! The time step below which the paper's problem moves the rods the wrong way.
//!
//! A step of length t with the acceleration a changes the loads by (A + t^2 X) a: immediately through inertia,
//! A = dN/dxdd, and through the new position, X = dN/dx. On most machines the two oppose each other: pushing
//! the body forward first unloads the front. With d the load differences in the cost and W their weights, a
//! motion that lowers the cost of the step also lowers that of the position where
//! ```text
//!     S(8)   d_X' W d_(A + t^2 X) > 0
//! ```
//! which holds for steps longer than T*. With one variable, T*^2 = -(d_X' W d_A) / (d_X' W d_X): the ratio of the
//! load difference front - rear by acceleration and by position where only that difference matters.

use crate::condensed::Instant;
use crate::condensed::SuspendedMachine;
use crate::cost::Weights;
use crate::prediction::{PredictedState, RodMotion};
use tipwatch_mechanics::geometry::coordinate::Motion;
use tipwatch_mechanics::number::Gradient;

/// Response of the loads to the rods at rest in one position, and the resulting critical step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CriticalStep {
    /// T* (s); `None` if it is not real: the loads do not depend on the stroke, or inertia does not oppose the
    /// effect of position.
    pub time: Option<f64>,
    /// Front minus rear load with all rods moving alike, derivative with respect to stroke (N/m).
    pub front_less_rear_by_position: f64,
    /// Derivative of that difference with respect to the rods' acceleration (N s^2/m).
    pub front_less_rear_by_acceleration: f64,
}

/// Derivatives of the loads with respect to stroke, index 0, and acceleration, index 1, of one variable.
type Response = Gradient<2>;

const POSITION: usize = 0;
const ACCELERATION: usize = 1;

/// Scratch memory for the computation of [`CriticalStep`]s.
#[derive(Debug)]
pub(crate) struct StepFinder {
    predicted_state: PredictedState<Response>,
    /// Loads by wheel, for each variable.
    responses: [Vec<Response>; 2],
    rods: Vec<Motion<Response>>,
    /// 1 for wheels in front of the middle, -1 behind it.
    in_front: Vec<f64>,
}

impl StepFinder {
    pub(crate) fn new(suspended: &SuspendedMachine) -> Self {
        let wheels = suspended.machine.wheels();
        let middle = wheels.iter().map(|w| w.centre_at_zero.x).sum::<f64>() / wheels.len() as f64;
        let side = |w: &tipwatch_mechanics::machine::Wheel| (w.centre_at_zero.x - middle).signum();
        let none = || vec![Gradient::fixed(0.0); wheels.len()];
        Self {
            predicted_state: PredictedState::new(suspended),
            responses: [none(), none()],
            rods: vec![Motion::zero(); suspended.linkages.len()],
            in_front: wheels.iter().map(side).collect(),
        }
    }

    /// Computes the critical step at an instant, with the rods at rest at `positions` (m); the variables are the individual rods
    /// if they are `independent`, else one for all of them.
    pub(crate) fn find(
        &mut self,
        suspended: &SuspendedMachine,
        instant: &Instant,
        positions: &[f64],
        weights: &Weights,
        independent: bool,
    ) -> CriticalStep {
        let variables = if independent { positions.len() } else { 1 };
        for variable in 0..variables {
            for (k, (rod, &position)) in self.rods.iter_mut().zip(positions).enumerate() {
                *rod = Motion::zero();
                rod.position.value = position;
                if !independent || k == variable {
                    rod.position.slopes[POSITION] = 1.0;
                    rod.acceleration.slopes[ACCELERATION] = 1.0;
                }
            }
            let predicted_state = &mut self.predicted_state;
            predicted_state.fill(suspended, instant, &self.rods, RodMotion::InMotion, false);
            self.responses[variable].copy_from_slice(&predicted_state.otf);
        }
        let front_less_rear = |by: usize| -> f64 {
            let of = |response: &Vec<Response>| -> f64 {
                let sides = response.iter().zip(&self.in_front);
                sides.map(|(load, side)| load.slopes[by] * side).sum()
            };
            self.responses[..variables].iter().map(of).sum()
        };
        CriticalStep {
            time: self.time(weights, variables),
            front_less_rear_by_position: front_less_rear(POSITION),
            front_less_rear_by_acceleration: front_less_rear(ACCELERATION),
        }
    }

    /// T* of S(8): its square is the largest l with det(M + l X) = 0, M the symmetric part of d_X' W d_A
    /// and X that of d_X' W d_X.
    fn time(&self, weights: &Weights, variables: usize) -> Option<f64> {
        let product = |i: usize, j: usize, by: usize| {
            weights.product(&self.responses[i], POSITION, &self.responses[j], by)
        };
        let mixed =
            |i: usize, j: usize| 0.5 * (product(i, j, ACCELERATION) + product(j, i, ACCELERATION));
        let plain = |i: usize, j: usize| product(i, j, POSITION);
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
