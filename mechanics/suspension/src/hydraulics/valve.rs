//! Valve law (36) with feed-forward and pressure feedback, and the saturation and slew rate of a real valve.

use tipwatch_mechanics::machine::HydraulicParameters;

/// Rate at which the valve relieves the pressure of an oscillation (1/s). A platform on its oil oscillates at some 20 to
/// 50 rad/s: this damps it to a quarter or more of the critical damping, and still does with a delay of 20 ms.
const RELIEF_RATE: f64 = 25.0;
/// The feed-forward counts on at least this share of the force that supply pressure gives.
const LEAST_PUSH_SHARE: f64 = 0.1;

/// A proportional valve: its opening u, -1 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Valve {
    opening: f64,
}

/// Inputs of the valve law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValveInput {
    /// x_r: reference stroke (m).
    pub wanted: f64,
    /// Velocity of the reference (m/s).
    pub velocity: f64,
    /// x: measured stroke (m).
    pub found: f64,
    /// Extension of the rod from its smallest stroke (m).
    pub extension: f64,
    /// f = A_a p_a - A_b p_b from measured pressures (N); NaN if they are not measured.
    pub force: f64,
    /// F: the part of f that carries the machine, without acceleration of the rods (N); NaN if it is not known.
    pub load: f64,
    /// Largest opening allowed, 0 to 1.
    pub max_opening: f64,
}

impl Valve {
    /// A closed valve.
    #[must_use]
    pub fn closed() -> Self {
        Self { opening: 0.0 }
    }

    /// u: positive fills the piston's side.
    #[must_use]
    pub fn opening(self) -> f64 {
        self.opening
    }

    /// H(6) without feed-forward and pressures: moves for `seconds` towards u = k_p (x_r - x), within saturation
    /// and slew rate. Closes if a position (m) is unknown.
    #[must_use]
    pub fn follow(
        self,
        parameters: &HydraulicParameters,
        wanted: f64,
        found: f64,
        seconds: f64,
    ) -> Self {
        let input = ValveInput {
            wanted,
            velocity: 0.0,
            found,
            extension: 0.0,
            force: f64::NAN,
            load: f64::NAN,
            max_opening: 1.0,
        };
        self.steer(parameters, &input, seconds)
    }

    /// H(6): moves for `seconds` towards u = k_p (x_r - x) + xd_r / V - k_f (f - F), within saturation and slew rate.
    /// Closes if a position is unknown; without measured pressures and a known load the last term is zero.
    #[must_use]
    pub fn steer(self, parameters: &HydraulicParameters, input: &ValveInput, seconds: f64) -> Self {
        let seconds = seconds.max(0.0);
        let error = input.wanted - input.found;
        let target = if error.is_finite() && input.velocity.is_finite() {
            let [carried, oscillation] = match (input.force - input.load).is_finite() {
                true => [input.load, input.force - input.load],
                false => [0.0; 2],
            };
            let full = full_velocity(parameters, carried, input.velocity);
            let relief = RELIEF_RATE / (oil_stiffness(parameters, input.extension) * full);
            let most = input.max_opening.clamp(0.0, 1.0);
            (parameters.gain * error + input.velocity / full - relief * oscillation)
                .clamp(-most, most)
        } else {
            0.0
        };
        let reach = parameters.valve_rate * seconds;
        Self {
            opening: target.clamp(self.opening - reach, self.opening + reach),
        }
    }
}

/// V: steady velocity with the valve fully open (m/s), against a force on the rod (N), in the direction of `velocity`:
/// ```text
///     H(9)   V^2 (A_a^3/c_a^2 + A_b^3/c_b^2) = A_a p_s - A_b p_r - f,     a and b exchanged to retract
/// ```
pub(crate) fn full_velocity(parameters: &HydraulicParameters, force: f64, velocity: f64) -> f64 {
    let p = parameters;
    let [c_p1, c_n1, c_p2, c_n2] = p.coefficients;
    let (a, b) = (p.piston_area, p.ring_area);
    let (swept, pushed, most) = if velocity >= 0.0 {
        let swept = a * a * a / (c_p1 * c_p1) + b * b * b / (c_n2 * c_n2);
        (swept, a * p.supply - b * p.tank - force, a * p.supply)
    } else {
        let swept = a * a * a / (c_n1 * c_n1) + b * b * b / (c_p2 * c_p2);
        (swept, b * p.supply - a * p.tank + force, b * p.supply)
    };
    (pushed.max(LEAST_PUSH_SHARE * most) / swept).sqrt()
}

/// Stiffness of the oil columns on both sides of the piston (N/m).
fn oil_stiffness(parameters: &HydraulicParameters, extension: f64) -> f64 {
    let p = parameters;
    let extension = extension.clamp(0.0, p.stroke);
    let volumes = [
        p.dead_volumes[0] + p.piston_area * extension,
        p.dead_volumes[1] + p.ring_area * (p.stroke - extension),
    ];
    p.bulk_modulus
        * (p.piston_area * p.piston_area / volumes[0] + p.ring_area * p.ring_area / volumes[1])
}
