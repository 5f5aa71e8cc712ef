//! Response of the loads to the right-hand side of their equations.

use super::equilibrium::Equations;
use super::least_energy::LeastEnergy;
use crate::machine::MAX_WHEELS;
use crate::number::{Real, Wheels};

/// The linear map from the equations' values to the loads, with the factors of its own derivative.
#[derive(Debug, Clone)]
pub(crate) struct Response<T> {
    /// Loads for a unit value of each equation.
    pub(crate) loads: Vec<[T; MAX_WHEELS]>,
    /// l of N = K A' l.
    pub(crate) multiplier: [T; MAX_WHEELS],
    /// K: relative stiffness of the loaded wheels, zero for the others.
    pub(crate) stiffness: [T; MAX_WHEELS],
}

impl<T: Real> Response<T> {
    pub(super) fn new(rows: usize) -> Self {
        Self {
            loads: vec![[T::zero(); MAX_WHEELS]; rows],
            multiplier: [T::zero(); MAX_WHEELS],
            stiffness: [T::zero(); MAX_WHEELS],
        }
    }

    /// Reads the response of the first `rows` equations from the last solution of `least_energy`, with these
    /// wheel stiffnesses; later rows have no response.
    pub(super) fn read(
        &mut self,
        least_energy: &mut LeastEnergy<T>,
        equations: &Equations<T>,
        rows: usize,
        stiffness: &[T; MAX_WHEELS],
    ) {
        // With sizes known at compile time, the usual four wheels take half the time.
        match (rows, equations.wheels) {
            (4, 4) => self.read_sized(least_energy, equations, 4, 4, stiffness),
            (3, 4) => self.read_sized(least_energy, equations, 3, 4, stiffness),
            (rows, n) => self.read_sized(least_energy, equations, rows, n, stiffness),
        }
    }

    #[inline(always)]
    fn read_sized(
        &mut self,
        least_energy: &mut LeastEnergy<T>,
        equations: &Equations<T>,
        rows: usize,
        n: usize,
        stiffness: &[T; MAX_WHEELS],
    ) {
        self.multiplier[..rows].copy_from_slice(&least_energy.multiplier[..rows]);
        self.multiplier[rows..].fill(T::zero());
        self.stiffness = *stiffness;
        let (known, unknown) = self.loads.split_at_mut(rows);
        for (row, loads) in known.iter_mut().enumerate() {
            let mut unit = [T::zero(); MAX_WHEELS];
            unit[row] = T::one();
            least_energy.solve_again(equations, rows, &unit, &stiffness[..n], &mut loads[..n]);
        }
        for loads in unknown {
            loads[..n].fill(T::zero());
        }
    }

    /// Replaces the response by another one where `mask` is true.
    pub(super) fn replace_where(&mut self, mask: T::Mask, other: &Self) {
        let rows = self.loads.iter_mut().zip(&other.loads);
        for (mine, theirs) in rows
            .chain([(&mut self.multiplier, &other.multiplier)])
            .chain([(&mut self.stiffness, &other.stiffness)])
        {
            for (mine, &theirs) in mine.iter_mut().zip(theirs) {
                *mine = T::select(mask, theirs, *mine);
            }
        }
    }

    /// Load per height of the wheels off flat ground (N): through the value of the split rule, or through the
    /// deflection of the wheel's spring.
    pub(crate) fn by_heights(&self, equations: &Equations<T>, wheel: usize) -> T {
        let mut load = T::zero();
        for row in equations.certain..equations.measured {
            load += self.loads[row][wheel] * equations.value[row];
        }
        // Without a rule, this makes the load unknown where the equations are.
        if equations.has_offsets || equations.certain == equations.measured {
            for (other, &offset) in equations.offset[..equations.wheels].iter().enumerate() {
                load += self.slack(equations, wheel, other) * offset;
            }
        }
        load
    }

    /// (I - L A) K of two wheels: load change of one per deflection of the other's spring, in equilibrium.
    pub(crate) fn slack(&self, equations: &Equations<T>, wheel: usize, other: usize) -> T {
        let place = wheel % T::Wheels::COUNT;
        let first = wheel - place;
        self.slack_of(equations, first, other).wheel(place)
    }

    /// (I - L A) K of the wheels from `first` on, side by side: their load changes per deflection of the other's spring, in
    /// equilibrium.
    #[inline(always)]
    pub(crate) fn slack_of(
        &self,
        equations: &Equations<T>,
        first: usize,
        other: usize,
    ) -> T::Wheels {
        let mut held = T::Wheels::constant(0.0);
        for (row, loads) in self.loads.iter().enumerate() {
            let factor = equations.factor[row][other];
            held += T::Wheels::of(&loads[first..]) * T::Wheels::each(factor);
        }
        let own: [T; MAX_WHEELS] =
            std::array::from_fn(|wheel| if wheel == other { T::one() } else { T::zero() });
        (T::Wheels::of(&own[first..]) - held) * T::Wheels::each(self.stiffness[other])
    }
}
