//! The wheel loads over a range of motion.

use super::extreme::{Extreme, Search, is_linear, largest_change};
use super::signals::signals;
use crate::Scope;
use crate::estimation::quasi_static::MotionRange;
use crate::evaluate::evaluation::evaluate;
use crate::evaluate::workspace::Workspace;
use crate::machine::Machine;
use crate::state::State;

/// Range of one wheel's OTF over a range of motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelReach {
    /// Smallest OTF (N).
    pub least_otf: f64,
    /// Largest OTF (N).
    pub largest_otf: f64,
}

/// Computes the loads over ranges of motion, by the same equations as those of a row. A step allocates little.
#[derive(Debug)]
pub struct UnobservedLoads {
    workspace: Workspace<f64>,
    scratch: State<f64>,
}

impl UnobservedLoads {
    /// Memory for this machine.
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        Self {
            workspace: Workspace::with_scope(machine, Scope::LOADS_AND_DERIVATIVES),
            scratch: State::zero(machine),
        }
    }

    /// Variances of OTF and load of each wheel due to what is unknown at the row itself. Each signal is
    /// independent and uniformly distributed over its range:
    ///
    /// ```text
    ///     var N = sum over signals (dN/dx)^2 w^2 / 3,    w the farthest end of the range of x
    /// ```
    pub fn variances(
        &mut self,
        machine: &Machine,
        state: &State<f64>,
        range: &MotionRange,
    ) -> Vec<[f64; 2]> {
        evaluate(machine, state, &mut self.workspace);
        let sensitivity = self.workspace.sensitivity();
        let widths: Vec<f64> = signals(machine, state, range)
            .map(|(value, span)| span.farthest_from(value))
            .collect();
        let variance = |derivatives: &[f64]| -> f64 {
            let each = derivatives.iter().zip(&widths);
            each.map(|(by, width)| (by * width).powi(2) / 3.0).sum()
        };
        let load = &self.workspace.outcome().load;
        (0..machine.wheels().len())
            .map(|wheel| {
                let otf = variance(&sensitivity.otf(wheel));
                // the sigma of a lifted wheel is that of its OTF
                let of_load = match load[wheel] > 0.0 {
                    true => variance(&sensitivity.load(wheel)),
                    false => otf,
                };
                [otf, of_load]
            })
            .collect()
    }

    /// Returns the change of the OTF of all wheels (N) by one standard deviation of each signal that is unknown at the row
    /// itself. The signals are those of [`Self::variances`], independent of each other:
    ///
    /// ```text
    ///     g_x = (dN/dx) w / sqrt(3),    cov N = sum over signals g_x g_x'
    /// ```
    pub fn by_signal(
        &mut self,
        machine: &Machine,
        state: &State<f64>,
        range: &MotionRange,
    ) -> Vec<Vec<f64>> {
        evaluate(machine, state, &mut self.workspace);
        let sensitivity = self.workspace.sensitivity();
        let wheels = 0..machine.wheels().len();
        let derivatives: Vec<Vec<f64>> = wheels.map(|wheel| sensitivity.otf(wheel)).collect();
        let sigmas = signals(machine, state, range)
            .map(|(value, span)| span.farthest_from(value) / 3.0_f64.sqrt());
        let unknown = sigmas.enumerate().filter(|(_, sigma)| *sigma != 0.0);
        unknown
            .map(|(signal, sigma)| derivatives.iter().map(|by| by[signal] * sigma).collect())
            .collect()
    }

    /// Returns the standard deviations of the OTF of all wheels, without motion that was not observed (N).
    pub fn sigmas(&mut self, machine: &Machine, state: &State<f64>) -> Vec<f64> {
        let outcome = evaluate(machine, state, &mut self.workspace);
        outcome.uncertainty.otf.clone()
    }

    /// The smallest and the largest OTF of each wheel over the range.
    ///
    /// The OTF is linear in accelerations, specific force and tool wrench: there its extremes are exact, the sum of the
    /// absolute values of derivative times range. In positions and velocities it is not: the extreme is searched along
    /// one after the other, and what a parabola through the points can exceed them by is added.
    pub fn reach(
        &mut self,
        machine: &Machine,
        state: &State<f64>,
        range: &MotionRange,
    ) -> Vec<WheelReach> {
        let wheels = 0..machine.wheels().len();
        if is_linear(range) {
            evaluate(machine, state, &mut self.workspace);
            let found = wheels.map(|wheel| {
                let otf = self.workspace.outcome().otf[wheel];
                let derivatives = self.workspace.sensitivity().otf(wheel);
                let change = |sign: f64| {
                    largest_change(sign, &derivatives, signals(machine, state, range), |_| true)
                };
                WheelReach {
                    least_otf: otf - change(-1.0),
                    largest_otf: otf + change(1.0),
                }
            });
            return found.collect();
        }
        wheels
            .map(|wheel| {
                let mut extreme = |sign: f64| {
                    Search {
                        machine,
                        state,
                        range,
                        wheel,
                        sign,
                        workspace: &mut self.workspace,
                        scratch: &mut self.scratch,
                    }
                    .run()
                };
                let (low, high): (Extreme, Extreme) = (extreme(-1.0), extreme(1.0));
                WheelReach {
                    least_otf: -low.value,
                    largest_otf: high.value,
                }
            })
            .collect()
    }
}
