//! Valve flow, chamber pressure rates and piston force: (26)-(29).

use tipwatch_mechanics::machine::HydraulicParameters;
use tipwatch_mechanics::number::Real;

/// Below this pressure drop (Pa) the flow is laminar; a square root would have infinite slope at zero.
const LAMINAR_DROP: f64 = 1e4;

/// Check and relief valves open gradually over this pressure drop (Pa).
const OPENING_DROP: f64 = 1e5;

/// Capacity of check and relief valves relative to the valve's own edge. Up to a piston speed of some 0.8 m/s no pressure
/// leaves the range between tank and relief by more than 0.5 MPa; a load that moves the piston faster may make it do so.
const SAFETY_SIZE: f64 = 20.0;

/// Chamber pressures (Pa, gauge).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pressures<T> {
    /// Piston side.
    pub piston: T,
    /// Rod side.
    pub rod: T,
}

/// Flow rates into the chambers (m^3/s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flows<T> {
    /// Q_a, piston side.
    pub piston: T,
    /// Q_b, rod side.
    pub rod: T,
}

/// v(p) = sign(p) sqrt|p|, linear near zero: p / (p^2 + d^2)^(1/4), within 3e-5 of it above one megapascal.
fn root<T: Real>(drop: T) -> T {
    let laminar = T::constant(LAMINAR_DROP * LAMINAR_DROP);
    drop / (drop * drop + laminar).sqrt().sqrt()
}

/// Flow through a check valve that opens for a positive drop, initially quadratic so that it is smooth.
fn check<T: Real>(coefficient: T, drop: T) -> T {
    let drop = drop.max(T::zero());
    let square = drop * drop;
    let root = (square + T::constant(OPENING_DROP * OPENING_DROP)).sqrt();
    coefficient * square / (root * root.sqrt())
}

/// H(1), H(2) for a valve opening u, -1 to 1, plus the flows of check and relief valves.
#[must_use]
pub fn flows<T: Real>(
    parameters: &HydraulicParameters,
    pressures: &Pressures<T>,
    opening: T,
) -> Flows<T> {
    let [c_p1, c_n1, c_p2, c_n2] = parameters.coefficients.map(T::constant);
    let (supply, tank) = (T::constant(parameters.supply), T::constant(parameters.tank));
    // u S(u) and u S(-u)
    let (extending, retracting) = (opening.max(T::zero()), opening.min(T::zero()));
    let (a, b) = (pressures.piston, pressures.rod);
    let piston = c_p1 * root(supply - a) * extending + c_n1 * root(a - tank) * retracting;
    let rod = -(c_n2 * root(b - tank) * extending) - c_p2 * root(supply - b) * retracting;
    let relief = T::constant(parameters.relief);
    let safety = |coefficient: T, pressure: T| {
        let sized = coefficient.scaled(SAFETY_SIZE);
        check(sized, tank - pressure) - check(sized, pressure - relief)
    };
    Flows {
        piston: piston + safety(c_p1, a),
        rod: rod + safety(c_p2, b),
    }
}

/// H(3), H(4): pressure rates (Pa/s) for an `extension` of the rod (m) and its `velocity` (m/s). Beyond the
/// stroke, the volumes are those at its end.
#[must_use]
pub fn pressure_rates<T: Real>(
    parameters: &HydraulicParameters,
    flows: &Flows<T>,
    extension: T,
    velocity: T,
) -> Pressures<T> {
    let (area_a, area_b) = (
        T::constant(parameters.piston_area),
        T::constant(parameters.ring_area),
    );
    let [dead_a, dead_b] = parameters.dead_volumes.map(T::constant);
    let (beta, stroke) = (
        T::constant(parameters.bulk_modulus),
        T::constant(parameters.stroke),
    );
    let extension = extension.max(T::zero()).min(stroke);
    Pressures {
        piston: beta / (dead_a + area_a * extension) * (flows.piston - area_a * velocity),
        rod: beta / (dead_b + area_b * (stroke - extension)) * (flows.rod + area_b * velocity),
    }
}

/// H(5): force of the piston on the rod, positive when it extends (N).
#[must_use]
pub fn piston_force<T: Real>(parameters: &HydraulicParameters, pressures: &Pressures<T>) -> T {
    T::constant(parameters.piston_area) * pressures.piston
        - T::constant(parameters.ring_area) * pressures.rod
}
