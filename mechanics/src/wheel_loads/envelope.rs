//! The load envelope: the smallest and largest load that each wheel can have given equilibrium and no
//! pulling, whatever the rule that splits them.
//!
//! The loads that equilibrium allows form a polytope; a wheel's load takes its extremes at corners,
//! where as many wheels carry as there are equations. So every such set of wheels is tried.

use super::Equations;
use super::least_energy::LeastEnergy;
use super::unilateral::Loads;
use crate::machine::{MAX_WHEELS, Machine};
use crate::number::{Mask, Real};

/// Rounding allowed in a corner's equations and loads, as a share of the weight.
const ROUNDING_SHARE: f64 = 1e-7;

/// The sets of wheels that can be a corner.
#[derive(Debug)]
pub(crate) struct Envelope {
    corners: Vec<[bool; MAX_WHEELS]>,
}

impl Envelope {
    pub(crate) fn new(machine: &Machine) -> Self {
        let (n, equations) = (machine.wheels.len(), 3 + machine.contact.free_joints.len());
        let sets = (0..1_u32 << n).filter(|set| set.count_ones() as usize == equations);
        let corners = sets.map(|set| std::array::from_fn(|wheel| set >> wheel & 1 == 1));
        Self { corners: corners.collect() }
    }

    /// Fills `out.least` and `out.largest`; NaN where no corner satisfies the equations.
    #[inline]
    pub(super) fn find<T: Real>(&self, least_energy: &mut LeastEnergy<T>, equations: &Equations<T>, out: &mut Loads<'_, T>) {
        let n = equations.wheels;
        let infinity = T::constant(f64::INFINITY);
        let slack = equations.value[0] * T::constant(ROUNDING_SHARE);
        let all_hold = [T::one(); MAX_WHEELS];
        let mut any = T::Mask::splat(false);
        let mut loads = [T::zero(); MAX_WHEELS];
        out.least.fill(infinity);
        out.largest.fill(-infinity);
        for corner in &self.corners {
            let share: [T; MAX_WHEELS] = corner.map(|carries| if carries { T::one() } else { T::zero() });
            least_energy.solve(equations, &all_hold[..equations.certain], &equations.value, &share[..n], &mut loads[..n]);
            let mut possible = is_solution(equations, &loads[..n], slack);
            for &load in &loads[..n] {
                possible = possible & (-slack).lt(load);
            }
            any = any | possible;
            for wheel in 0..n {
                let load = loads[wheel].max(T::zero());
                out.least[wheel] = T::select(possible, load.min(out.least[wheel]), out.least[wheel]);
                out.largest[wheel] = T::select(possible, load.max(out.largest[wheel]), out.largest[wheel]);
            }
        }
        let unknown = T::constant(f64::NAN);
        for wheel in 0..n {
            out.least[wheel] = T::select(any, out.least[wheel], unknown);
            out.largest[wheel] = T::select(any, out.largest[wheel], unknown);
        }
    }
}

/// Whether the loads satisfy the certain equations; those that depend on others were left out.
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
