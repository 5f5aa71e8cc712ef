//! Dynamics of a cylinder with its valve and load.

use nalgebra::{Matrix4, Vector4};

use super::chambers::{Flows, Pressures, flows, piston_force, pressure_rates};
use super::rosenbrock::{StepError, integrate};
use super::valve::Valve;
use tipwatch_mechanics::machine::HydraulicParameters;
use tipwatch_mechanics::number::{Dual, Real};

/// Error tolerance of a sub-step: pressures (Pa), position (m), velocity (m/s).
const PRESSURE_TOLERANCE: f64 = 1e3;
const POSITION_TOLERANCE: f64 = 1e-6;
const VELOCITY_TOLERANCE: f64 = 1e-5;
/// Ends of the stroke: stiffness (N/m) and damping (N s/m).
const STOP_STIFFNESS: f64 = 1e8;
const STOP_DAMPING: f64 = 1e5;

/// Pressures and motion of a cylinder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActuatorState {
    /// Chamber pressures.
    pub pressures: Pressures<f64>,
    /// Extension of the rod from its smallest stroke (m).
    pub extension: f64,
    /// Velocity of extension (m/s).
    pub velocity: f64,
}

/// Input of an actuator, constant over a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ActuatorInput {
    /// A load: force on the rod (N), positive when it retracts the rod, and the mass moving with the rod (kg).
    Load {
        /// F (N).
        force: f64,
        /// m (kg).
        mass: f64,
    },
    /// A prescribed motion: velocity of extension (m/s).
    Motion {
        /// dx/dt (m/s).
        velocity: f64,
    },
}

/// One actuator of the suspension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Actuator {
    /// Cylinder, oil and valve.
    pub parameters: HydraulicParameters,
}

impl Actuator {
    /// Equilibrium under a load (N) at this extension (m): the rod side at a third of the supply pressure, the
    /// piston side as the load requires, both within the range of the valves.
    #[must_use]
    pub fn at_rest(&self, extension: f64, load: f64) -> ActuatorState {
        let p = &self.parameters;
        let within = |pressure: f64| pressure.clamp(p.tank, p.relief);
        let rod = within(p.tank + (p.supply - p.tank) / 3.0);
        let piston = within((load + p.ring_area * rod) / p.piston_area);
        let rod = within((p.piston_area * piston - load) / p.ring_area);
        ActuatorState {
            pressures: Pressures { piston, rod },
            extension,
            velocity: 0.0,
        }
    }

    /// Force f on the rod, positive when it extends (N).
    #[must_use]
    pub fn force(&self, state: &ActuatorState) -> f64 {
        piston_force(&self.parameters, &state.pressures)
    }

    /// Flow rates into the chambers (m^3/s).
    #[must_use]
    pub fn flows(&self, state: &ActuatorState, valve: Valve) -> Flows<f64> {
        flows(&self.parameters, &state.pressures, valve.opening())
    }

    /// The state after `seconds` with constant valve opening and input.
    ///
    /// # Errors
    /// [`StepError`]: values that are not finite, a mass that is not positive, or a step that does not converge.
    pub fn step(
        &self,
        state: &ActuatorState,
        valve: Valve,
        input: ActuatorInput,
        seconds: f64,
    ) -> Result<ActuatorState, StepError> {
        let is_usable = match input {
            ActuatorInput::Load { force, mass } => {
                force.is_finite() && mass.is_finite() && mass > 0.0
            }
            ActuatorInput::Motion { velocity } => velocity.is_finite(),
        };
        if !is_usable {
            return Err(StepError::NotFinite);
        }
        let start = Vector4::from([
            state.pressures.piston,
            state.pressures.rod,
            state.extension,
            match input {
                ActuatorInput::Load { .. } => state.velocity,
                ActuatorInput::Motion { velocity } => velocity,
            },
        ]);
        let tolerance = Vector4::from([
            PRESSURE_TOLERANCE,
            PRESSURE_TOLERANCE,
            POSITION_TOLERANCE,
            VELOCITY_TOLERANCE,
        ]);
        let system = LoadedCylinder {
            parameters: &self.parameters,
            opening: valve.opening(),
            input,
        };
        let [piston, rod, extension, velocity] =
            integrate(|y| system.rates(y), tolerance, start, seconds)?.into();
        Ok(ActuatorState {
            pressures: Pressures { piston, rod },
            extension,
            velocity,
        })
    }
}

/// H(1)-(5), H(7) with constant inputs; y = (p_a, p_b, x, dx/dt).
struct LoadedCylinder<'a> {
    parameters: &'a HydraulicParameters,
    opening: f64,
    input: ActuatorInput,
}

impl LoadedCylinder<'_> {
    fn of<T: Real>(&self, [a, b, extension, velocity]: [T; 4]) -> [T; 4] {
        let parameters = self.parameters;
        let pressures = Pressures { piston: a, rod: b };
        let flows = flows(parameters, &pressures, T::constant(self.opening));
        let rates = pressure_rates(parameters, &flows, extension, velocity);
        let acceleration = match self.input {
            ActuatorInput::Motion { .. } => T::zero(),
            ActuatorInput::Load { force, mass } => {
                let drag = T::constant(parameters.friction) * velocity;
                let pushed = piston_force(parameters, &pressures) - T::constant(force) - drag;
                (pushed + self.stop(extension, velocity)) / T::constant(mass)
            }
        };
        [rates.piston, rates.rod, velocity, acceleration]
    }

    /// Contact force of the end stop, which never pulls.
    fn stop<T: Real>(&self, extension: T, velocity: T) -> T {
        let (stiff, damped) = (T::constant(STOP_STIFFNESS), T::constant(STOP_DAMPING));
        let zero = T::zero();
        let distal = extension - T::constant(self.parameters.stroke);
        let inner = (-(stiff * extension) - damped * velocity).max(zero);
        let outer = (-(stiff * distal) - damped * velocity).min(zero);
        T::select(extension.lt(zero), inner, zero) + T::select(zero.lt(distal), outer, zero)
    }

    /// f(y) and its derivatives.
    fn rates(&self, y: &Vector4<f64>) -> (Vector4<f64>, Matrix4<f64>) {
        let mut jacobian = Matrix4::zeros();
        for column in 0..4 {
            let varied: [Dual<f64>; 4] = std::array::from_fn(|i| Dual {
                value: y[i],
                slope: if i == column { 1.0 } else { 0.0 },
            });
            let slopes = self.of(varied).map(|rate| rate.slope);
            jacobian.set_column(column, &Vector4::from(slopes));
        }
        (Vector4::from(self.of((*y).into())), jacobian)
    }
}
