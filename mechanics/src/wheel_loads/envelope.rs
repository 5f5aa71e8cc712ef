//! The load envelope: the smallest and largest load of each wheel in equilibrium and without pulling,
//! independent of the split rule.
//!
//! The loads in equilibrium form a polytope. With one wheel more than equations it is a line segment, N + t z
//! with z the self-equilibrated loads. With more wheels, the extremes of a wheel's load are at vertices, where
//! the number of loaded wheels equals that of the equations: every such set of wheels is tried.

use super::equilibrium::Equations;
use super::least_energy::LeastEnergy;
use super::loads::Loads;
use crate::machine::{MAX_WHEELS, Machine};
use crate::number::{Mask, Real};

/// Rounding tolerance in the equations and loads of a vertex, as a fraction of the weight.
const ROUNDING_SHARE: f64 = 1e-7;

/// Method of computing the envelope of a machine's loads.
#[derive(Debug)]
pub(super) enum Envelope {
    /// From the two ends of a line segment of solutions.
    Line,
    /// Over the sets of wheels that can form a vertex.
    Corners(Vec<[bool; MAX_WHEELS]>),
}

/// Loads of irregular sizes, not orthogonal to any self-equilibrated direction.
const PROBE: [f64; MAX_WHEELS] = [
    1.0, -0.61, 0.37, 0.83, -0.29, 0.53, -0.97, 0.71, 0.19, -0.43, 0.89, -0.67,
];

impl Envelope {
    pub(super) fn new(machine: &Machine) -> Self {
        let (n, equations) = (machine.wheels.len(), 3 + machine.contact.free_joints.len());
        if n == equations + 1 {
            return Self::Line;
        }
        let sets = (0..1_u32 << n).filter(|set| set.count_ones() as usize == equations);
        let corners = sets.map(|set| std::array::from_fn(|wheel| set >> wheel & 1 == 1));
        Self::Corners(corners.collect())
    }

    /// Fills `out.least` and `out.largest`; NaN where no loads without pulling satisfy the equations.
    /// `exchange` is the direction of the line segment: see [`exchange`].
    #[inline]
    pub(super) fn find<T: Real>(
        &self,
        least_energy: &mut LeastEnergy<T>,
        equations: &Equations<T>,
        exchange: &[T; MAX_WHEELS],
        out: &mut Loads<'_, T>,
    ) {
        match self {
            Self::Line => along_line(exchange, out),
            Self::Corners(corners) => over_corners(corners, least_energy, equations, out),
        }
    }
}

/// The self-equilibrated loads, where there is exactly one such direction, for the equations that
/// `least_energy` solved last, all wheels on the ground.
#[inline]
pub(super) fn exchange<T: Real>(
    least_energy: &mut LeastEnergy<T>,
    equations: &Equations<T>,
    stiffness: &[T],
    direction: &mut [T; MAX_WHEELS],
) {
    let (n, rows) = (equations.wheels, equations.measured);
    let mut value = [T::zero(); MAX_WHEELS];
    if rows > equations.certain {
        // As many equations as wheels: the loads that violate only the split rule.
        value[equations.certain] = T::one();
        least_energy.solve_again(equations, rows, &value, stiffness, &mut direction[..n]);
        return;
    }
    // Project the probe onto the null space of the equations.
    for row in 0..rows {
        for wheel in 0..n {
            value[row] +=
                equations.factor[row][wheel] * stiffness[wheel] * T::constant(PROBE[wheel]);
        }
    }
    least_energy.solve_again(equations, rows, &value, stiffness, &mut direction[..n]);
    for wheel in 0..n {
        direction[wheel] = stiffness[wheel] * T::constant(PROBE[wheel]) - direction[wheel];
    }
}

/// Interval of t in which N + t z is nowhere negative.
#[inline]
fn along_line<T: Real>(z: &[T; MAX_WHEELS], out: &mut Loads<'_, T>) {
    let infinity = T::constant(f64::INFINITY);
    let (mut from, mut to, mut weight) = (-infinity, infinity, T::zero());
    for (wheel, &load) in out.otf.iter().enumerate() {
        let limit = -load / z[wheel];
        from = T::select(T::zero().lt(z[wheel]), limit.max(from), from);
        to = T::select(z[wheel].lt(T::zero()), limit.min(to), to);
        weight += load;
    }
    // At a vertex of the polygon both ends coincide up to rounding.
    let open = (from - to).lt(weight * T::constant(ROUNDING_SHARE));
    let unknown = T::constant(f64::NAN);
    for (wheel, &load) in out.otf.iter().enumerate() {
        let (a, b) = (load + from * z[wheel], load + to * z[wheel]);
        let fixed = !(z[wheel].lt(T::zero()) | T::zero().lt(z[wheel]));
        let (least, largest) = (
            T::select(fixed, load, a.min(b)),
            T::select(fixed, load, a.max(b)),
        );
        out.least[wheel] = T::select(open, least.max(T::zero()), unknown);
        out.largest[wheel] = T::select(open, largest, unknown);
    }
}

fn over_corners<T: Real>(
    corners: &[[bool; MAX_WHEELS]],
    least_energy: &mut LeastEnergy<T>,
    equations: &Equations<T>,
    out: &mut Loads<'_, T>,
) {
    let n = equations.wheels;
    let infinity = T::constant(f64::INFINITY);
    let slack = equations.value[0] * T::constant(ROUNDING_SHARE);
    let all_hold = [T::one(); MAX_WHEELS];
    let mut any = T::Mask::splat(false);
    let mut loads = [T::zero(); MAX_WHEELS];
    out.least.fill(infinity);
    out.largest.fill(-infinity);
    for corner in corners {
        let share: [T; MAX_WHEELS] =
            corner.map(|carries| if carries { T::one() } else { T::zero() });
        least_energy.solve(
            equations,
            &all_hold[..equations.certain],
            &equations.value,
            &share[..n],
            &mut loads[..n],
        );
        let mut possible = is_solution(equations, &loads[..n], slack);
        for &load in &loads[..n] {
            possible = possible & (-slack).lt(load);
        }
        any = any | possible;
        for wheel in 0..n {
            let load = loads[wheel].max(T::zero());
            out.least[wheel] = T::select(possible, load.min(out.least[wheel]), out.least[wheel]);
            out.largest[wheel] =
                T::select(possible, load.max(out.largest[wheel]), out.largest[wheel]);
        }
    }
    let unknown = T::constant(f64::NAN);
    for wheel in 0..n {
        out.least[wheel] = T::select(any, out.least[wheel], unknown);
        out.largest[wheel] = T::select(any, out.largest[wheel], unknown);
    }
}

/// Whether the loads satisfy the certain equations, including dependent ones that the solution skipped.
fn is_solution<T: Real>(equations: &Equations<T>, loads: &[T], slack: T) -> T::Mask {
    let mut holds = T::Mask::splat(true);
    for row in 0..equations.certain {
        let mut residual = -equations.value[row];
        for (wheel, &load) in loads.iter().enumerate() {
            residual += equations.factor[row][wheel] * load;
        }
        holds = holds & residual.abs().lt(slack);
    }
    holds
}
