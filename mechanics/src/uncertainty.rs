//! Standard deviations of the loads, to first order, from the stated uncertainty of parameters and the
//! noise of the signals.
//!
//! ```text
//!     var N = sum over parameters (dN/dp sigma_p)^2 + sum over signals g' P g + (model share * mean load)^2
//!             + what the measured torques leave undetermined of the load split, A(3)
//! ```
//! where g are the derivatives with respect to value, velocity and acceleration of a signal, and P is their
//! covariance from the estimator. Parameters are treated as independent, except for the elements of one
//! link's inertia tensor, which share one factor.

use crate::machine::{MAX_WHEELS, Machine};
use crate::number::Real;
use crate::outcome::Outcome;
use crate::sensitivity::{InertiaElement, Parameter, Sensitivity};
use crate::state::{SignalNoise, State};
use crate::workspace::Workspace;

/// Standard deviations of the loads at one instant.
#[derive(Debug, Clone)]
pub struct Uncertainty<T> {
    /// Of the OTF, by wheel (N).
    pub otf: Vec<T>,
    /// Of the load, by wheel (N). For a lifted wheel it is that of its OTF, which shows how certain the
    /// lift-off is. NaN while the machine tips.
    pub load: Vec<T>,
    /// U = 1 - (OTF - 2 sigma) / static load, of the worst wheel; NaN without a static load.
    pub utilisation: T,
}

impl<T: Real> Uncertainty<T> {
    pub(crate) fn blank(machine: &Machine) -> Self {
        let unknown = T::constant(f64::NAN);
        Self {
            otf: vec![unknown; machine.wheels.len()],
            load: vec![unknown; machine.wheels.len()],
            utilisation: unknown,
        }
    }
}

/// How the derivatives with respect to parameters enter the variance; built once per machine.
#[derive(Debug, Clone)]
pub(crate) struct ParameterSigmas {
    /// Index of each independently uncertain parameter in the order of [`Parameter::all`], and its variance.
    variances: Vec<(usize, f64)>,
    /// Start index of each link's inertia tensor, and the standard deviations of its elements, which share
    /// one factor.
    inertias: Vec<(usize, [f64; 6])>,
    model_share: f64,
}

impl ParameterSigmas {
    pub(crate) fn of(machine: &Machine) -> Self {
        let parameters = Parameter::all(machine);
        let share = machine.uncertainty.inertia_share;
        let mut inertias = Vec::new();
        for (i, &parameter) in parameters.iter().enumerate() {
            if let Parameter::LinkInertia(link, InertiaElement::Xx) = parameter {
                let element = |e| Parameter::LinkInertia(link, e).nominal(machine);
                let sigmas = InertiaElement::ALL.map(|e| share * element(e).unwrap_or(0.0));
                inertias.push((i, sigmas));
            }
        }
        let alone = |&parameter: &Parameter| match parameter {
            Parameter::LinkInertia(..) => 0.0,
            _ => stated_sigma(machine, parameter).powi(2),
        };
        Self {
            variances: (parameters.iter().map(alone).enumerate())
                .filter(|(_, variance)| *variance > 0.0)
                .collect(),
            inertias,
            model_share: machine.uncertainty.model_share,
        }
    }

    /// Variance due to the parameters of a number with these derivatives.
    fn variance<T: Real>(&self, derivatives: &[T]) -> T {
        let mut variance = T::zero();
        for &(place, own) in &self.variances {
            let by = derivatives[place];
            variance += by * by * T::constant(own);
        }
        for (first, sigmas) in &self.inertias {
            let mut together = T::zero();
            for (&by, &sigma) in derivatives[*first..].iter().zip(sigmas) {
                together += by * T::constant(sigma);
            }
            variance += together * together;
        }
        variance
    }
}

/// Standard deviation of a signal's systematic error or of a parameter, in its unit.
pub(crate) fn stated_sigma(machine: &Machine, parameter: Parameter) -> f64 {
    let spec = &machine.uncertainty;
    match parameter {
        Parameter::JointPosition(joint) if machine.joints[joint].spins_wheel.is_some() => 0.0,
        Parameter::JointPosition(joint) if machine.joint_slides(joint) => spec.joint_offset_linear,
        Parameter::JointPosition(_) => spec.joint_offset,
        Parameter::SpecificForce(_) => spec.accelerometer_bias,
        Parameter::AngularVelocity(_) => spec.gyro_bias,
        Parameter::ToolForce(_) => spec.tool_force,
        Parameter::ToolMoment(_) => spec.tool_moment,
        Parameter::JointRate(_)
        | Parameter::JointAcceleration(_)
        | Parameter::AngularAcceleration(_)
        // Part of the variance that the measured torques leave.
        | Parameter::ActuatorForce(_)
        | Parameter::Travel(_) => 0.0,
        Parameter::LinkInertia(..) => {
            spec.inertia_share * parameter.nominal(machine).unwrap_or(0.0).abs()
        }
        Parameter::LinkMass(link) => spec.mass_share * machine.links[link].inertia.mass,
        Parameter::LinkCom(..) => spec.com,
        Parameter::PayloadMass(payload) => {
            let payload = &machine.payloads[payload];
            let default = spec.payload_mass_share * payload.inertia.mass;
            payload.mass_sigma.unwrap_or(default)
        }
        Parameter::WheelPosition(..) => spec.wheel_position,
        Parameter::WheelRadius(_) => spec.wheel_radius,
        Parameter::ArmPosition(_) => spec.arm_position,
        Parameter::ImuPosition(_) => spec.imu_position,
        Parameter::ImuRotation(_) => spec.imu_rotation,
        Parameter::FrontShare => spec.roll_moment_distribution,
        Parameter::TyreStiffness(_) => spec.tyre_stiffness_share,
    }
}

/// Fills the standard deviations of an outcome from its derivatives.
pub(crate) fn fill<T: Real>(
    machine: &Machine,
    sigmas: &ParameterSigmas,
    noise: &SignalNoise<T>,
    sensitivity: &Sensitivity<T>,
    [otf_measured, load_measured]: [[T; MAX_WHEELS]; 2],
    out: &mut Outcome<T>,
) {
    let wheels = machine.wheels.len();
    let mean_load = out.normal_force * T::constant(sigmas.model_share / wheels as f64);
    let signals = SignalPlaces::of(machine);
    let of = |derivatives: &[T], measured: T| {
        let variance = sigmas.variance(derivatives)
            + signals.variance(derivatives, noise)
            + mean_load * mean_load
            + measured;
        variance.sqrt()
    };
    for wheel in 0..wheels {
        let otf = of(sensitivity.otf(wheel), otf_measured[wheel]);
        out.uncertainty.otf[wheel] = otf;
        out.uncertainty.load[wheel] = otf;
        if sensitivity.loads_differ() {
            let carries = T::zero().lt(out.load[wheel]);
            let load = of(sensitivity.load(wheel), load_measured[wheel]);
            // NaN in either makes both NaN.
            let unknown = load * T::zero();
            out.uncertainty.load[wheel] = T::select(carries, load, otf + unknown);
        }
    }
    out.uncertainty.utilisation = utilisation(machine, out);
}

/// Standard deviation of a weighted sum of the OTF at the last evaluation of `workspace`, which must have
/// been of `state` with sensitivities in its scope.
#[must_use]
pub fn combination_sigma(
    machine: &Machine,
    state: &State<f64>,
    workspace: &Workspace<f64>,
    factors: &[f64],
) -> f64 {
    let sensitivity = workspace.sensitivity();
    let mut derivatives = vec![0.0; sensitivity.otf(0).len()];
    for (wheel, factor) in factors.iter().enumerate() {
        for (sum, by) in derivatives.iter_mut().zip(sensitivity.otf(wheel)) {
            *sum += factor * by;
        }
    }
    let sigmas = &workspace.sigmas;
    let wheels = machine.wheels.len() as f64;
    let mean_load = workspace.outcome().normal_force * sigmas.model_share / wheels;
    let model: f64 = factors
        .iter()
        .map(|factor| (factor * mean_load).powi(2))
        .sum();
    let signals = SignalPlaces::of(machine).variance(&derivatives, &state.noise);
    let split = workspace.measured_split_variance(factors);
    (sigmas.variance(&derivatives) + signals + model + split).sqrt()
}

/// U of the worst wheel.
fn utilisation<T: Real>(machine: &Machine, out: &Outcome<T>) -> T {
    let mut worst = T::constant(f64::NEG_INFINITY);
    for (wheel, &static_load) in machine.reference.static_load.iter().enumerate() {
        let sure = out.otf[wheel] - out.uncertainty.otf[wheel] * T::constant(2.0);
        let used = T::one() - sure / T::constant(static_load);
        // In the opposite order a NaN would be ignored.
        worst = T::select(used.lt(worst), worst, used);
    }
    worst
}

/// Indices of the signals in a gradient.
struct SignalPlaces {
    joints: usize,
    tool: bool,
}

impl SignalPlaces {
    fn of(machine: &Machine) -> Self {
        Self {
            joints: machine.joints.len(),
            tool: machine.tool.is_some(),
        }
    }

    /// Variance due to the noise of the signals.
    fn variance<T: Real>(&self, derivatives: &[T], noise: &SignalNoise<T>) -> T {
        let two = T::constant(2.0);
        let (joints, rest) = derivatives.split_at(3 * self.joints);
        let mut variance = T::zero();
        let [p00, p01, p02] = noise.joint.value;
        let [p11, p12] = noise.joint.first;
        for by in joints.chunks_exact(3) {
            let (g0, g1, g2) = (by[0], by[1], by[2]);
            variance += g0 * g0 * p00
                + g1 * g1 * p11
                + g2 * g2 * noise.joint.second
                + two * (g0 * (g1 * p01 + g2 * p02) + g1 * g2 * p12);
        }
        let [w, w_alpha, alpha] = noise.turning;
        for axis in 0..3 {
            let (f, by_w, by_alpha) = (rest[axis], rest[3 + axis], rest[6 + axis]);
            variance += f * f * noise.specific_force
                + by_w * by_w * w
                + by_alpha * by_alpha * alpha
                + two * by_w * by_alpha * w_alpha;
        }
        if self.tool {
            for &by in &rest[9..15] {
                variance += by * by * noise.tool_wrench;
            }
        }
        variance
    }
}
