//! Flows through the valve, rates of the chambers' pressures, force of the piston: (26)-(29).

use tipwatch_mechanics::machine::HydraulicParameters;
use tipwatch_mechanics::number::Real;

/// Below this pressure drop (Pa) flow is laminar: the square root's slope would be endless at zero.
const LAMINAR_DROP: f64 = 1e4;

/// Check and relief valves open gradually over this pressure drop (Pa).
const OPENING_DROP: f64 = 1e5;

/// Check and relief valves pass so many times what the valve's own edge does: they are sized so that a
/// chamber does not run empty.
const SAFETY_SIZE: f64 = 20.0;

/// Pressures in the chambers (Pa, gauge).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pressures<T> {
    /// On the piston's side.
    pub piston: T,
    /// On the rod's side.
    pub rod: T,
}

/// Flows into the chambers (m^3/s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flows<T> {
    /// Q_a, on the piston's side.
    pub piston: T,
    /// Q_b, on the rod's side.
    pub rod: T,
}

/// v(p) = sign(p) sqrt|p|, linear near zero: p / (p^2 + d^2)^(1/4), within 3e-5 of it beyond a
/// megapascal.
fn root<T: Real>(drop: T) -> T {
    let laminar = T::constant(LAMINAR_DROP * LAMINAR_DROP);
    drop / (drop * drop + laminar).sqrt().sqrt()
}

/// Flow through a check valve that opens for a positive drop, at first with its square: no corner where it opens.
fn check<T: Real>(coefficient: T, drop: T) -> T {
    let drop = drop.max(T::zero());
    let square = drop * drop;
    let root = (square + T::constant(OPENING_DROP * OPENING_DROP)).sqrt();
    coefficient * square / (root * root.sqrt())
}

/// H(1), H(2) for a valve that is open by u, -1 to 1, and the flows of check and relief valves.
#[must_use]
pub fn flows<T: Real>(
    parameters: &HydraulicParameters,
    pressures: &Pressures<T>,
    opening: T,
) -> Flows<T> {
    let [c_p1, c_n1, c_p2, c_n2] = parameters.coefficients.map(T::constant);
    let (supply, tank) = (T::constant(parameters.supply), T::constant(parameters.tank));
    // u S(u) and u S(-u)
    let (out, back) = (opening.max(T::zero()), opening.min(T::zero()));
    let (a, b) = (pressures.piston, pressures.rod);
    let piston = c_p1 * root(supply - a) * out + c_n1 * root(a - tank) * back;
    let rod = -(c_n2 * root(b - tank) * out) - c_p2 * root(supply - b) * back;
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

/// H(3), H(4): rates of the pressures (Pa/s) for a rod `out` of its least coordinate (m) that moves with
/// `velocity` (m/s), outwards. Beyond its stroke a volume is what it is at the end.
#[must_use]
pub fn pressure_rates<T: Real>(
    parameters: &HydraulicParameters,
    flows: &Flows<T>,
    out: T,
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
    let out = out.max(T::zero()).min(stroke);
    Pressures {
        piston: beta / (dead_a + area_a * out) * (flows.piston - area_a * velocity),
        rod: beta / (dead_b + area_b * (stroke - out)) * (flows.rod + area_b * velocity),
    }
}

/// H(5): force by the piston on the rod, outwards (N).
#[must_use]
pub fn piston_force<T: Real>(parameters: &HydraulicParameters, pressures: &Pressures<T>) -> T {
    T::constant(parameters.piston_area) * pressures.piston
        - T::constant(parameters.ring_area) * pressures.rod
}
