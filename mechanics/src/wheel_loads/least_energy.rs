//! Loads of least spring energy that satisfy the equations, within the compliance of each row.

use super::equilibrium::Equations;
use crate::machine::MAX_WHEELS;
use crate::number::Real;

/// A pivot below this fraction of its row's first value marks an equation that the preceding ones already
/// imply or contradict; it is skipped.
const DEPENDENT_SHARE: f64 = 1e-9;

/// Scratch memory for N = K A' l with (A K A') l = b, solved by an LDL' factorisation.
#[derive(Debug)]
pub(crate) struct LeastEnergy<T> {
    /// L D below the diagonal, and L.
    lower_scaled: Vec<[T; MAX_WHEELS]>,
    lower: Vec<[T; MAX_WHEELS]>,
    inverse_pivot: [T; MAX_WHEELS],
    /// l: the Lagrange multipliers of the equations.
    pub(super) multiplier: [T; MAX_WHEELS],
}

impl<T: Real> LeastEnergy<T> {
    pub(super) fn new() -> Self {
        let empty = [T::zero(); MAX_WHEELS];
        Self {
            lower_scaled: vec![empty; MAX_WHEELS],
            lower: vec![empty; MAX_WHEELS],
            inverse_pivot: empty,
            multiplier: empty,
        }
    }

    /// Solves for the loads under the active equations (`holds` 1, not 0) with right-hand side `value` and
    /// spring stiffnesses; a wheel of stiffness zero carries no load. Equations that contradict earlier ones are
    /// skipped; a row of compliance S is relaxed: (A K A' + S) l = b.
    pub(super) fn solve(
        &mut self,
        equations: &Equations<T>,
        holds: &[T],
        value: &[T],
        stiffness: &[T],
        loads: &mut [T],
    ) {
        // With sizes known at compile time, the usual four wheels take half the time.
        match (holds.len(), loads.len()) {
            (3, 4) => self.solve_sized(
                equations,
                &holds[..3],
                value,
                &stiffness[..4],
                &mut loads[..4],
            ),
            (4, 4) => self.solve_sized(
                equations,
                &holds[..4],
                value,
                &stiffness[..4],
                &mut loads[..4],
            ),
            _ => self.solve_sized(equations, holds, value, stiffness, loads),
        }
    }

    /// [`Self::solve`] for the case that all equations are active and exact and all springs alike: bit-identical,
    /// with the factors of one omitted.
    pub(super) fn solve_alike(&mut self, equations: &Equations<T>, value: &[T], loads: &mut [T]) {
        match (equations.value.len(), loads.len()) {
            (4, 4) => self.solve_alike_sized(equations, 4, value, &mut loads[..4]),
            (rows, _) => self.solve_alike_sized(equations, rows, value, loads),
        }
    }

    #[inline(always)]
    fn solve_alike_sized(
        &mut self,
        equations: &Equations<T>,
        rows: usize,
        value: &[T],
        loads: &mut [T],
    ) {
        self.factorise(
            equations,
            rows,
            loads.len(),
            |_, product| product,
            |_, _, sum| sum,
        );
        self.substitute(rows, value);
        for (wheel, load) in loads.iter_mut().enumerate() {
            *load = self.indentation(equations, rows, wheel);
        }
    }

    #[inline(always)]
    fn solve_sized(
        &mut self,
        equations: &Equations<T>,
        holds: &[T],
        value: &[T],
        stiffness: &[T],
        loads: &mut [T],
    ) {
        self.factorise(
            equations,
            holds.len(),
            stiffness.len(),
            |wheel, product| product * stiffness[wheel],
            |i, j, sum| {
                let sum = sum * (holds[i] * holds[j]);
                if i == j {
                    sum + equations.compliance[i]
                } else {
                    sum
                }
            },
        );
        self.solve_again(equations, holds.len(), value, stiffness, loads);
    }

    /// The loads for another right-hand side of the equations solved last.
    #[inline(always)]
    pub(super) fn solve_again(
        &mut self,
        equations: &Equations<T>,
        rows: usize,
        value: &[T],
        stiffness: &[T],
        loads: &mut [T],
    ) {
        self.substitute(rows, value);
        for (wheel, load) in loads.iter_mut().enumerate() {
            *load = self.indentation(equations, rows, wheel) * stiffness[wheel];
        }
    }

    /// Deflection of a wheel's spring, in units of load by relative stiffness: A' l.
    #[inline(always)]
    pub(super) fn indentation(&self, equations: &Equations<T>, rows: usize, wheel: usize) -> T {
        let mut sum = self.multiplier[0];
        for row in 1..rows {
            sum += equations.factor[row][wheel] * self.multiplier[row];
        }
        sum
    }

    /// [`Self::solve`] with the equations' offsets: N = K (u + A' l), (A K A') l = b - A K u.
    pub(super) fn solve_pressed(
        &mut self,
        equations: &Equations<T>,
        holds: &[T],
        value: &[T],
        stiffness: &[T],
        loads: &mut [T],
    ) {
        let mut rest = [T::zero(); MAX_WHEELS];
        for (row, rest) in rest[..holds.len()].iter_mut().enumerate() {
            *rest = value[row];
            for (wheel, &k) in stiffness.iter().enumerate() {
                *rest -= equations.factor[row][wheel] * k * equations.offset[wheel];
            }
            *rest *= holds[row];
        }
        self.solve(equations, holds, &rest, stiffness, loads);
        for (wheel, load) in loads.iter_mut().enumerate() {
            *load += stiffness[wheel] * equations.offset[wheel];
        }
    }

    #[inline(always)]
    fn factorise(
        &mut self,
        equations: &Equations<T>,
        rows: usize,
        wheels: usize,
        by_spring: impl Fn(usize, T) -> T,
        held: impl Fn(usize, usize, T) -> T,
    ) {
        for j in 0..rows {
            for i in j..rows {
                let mut whole = T::zero();
                for wheel in 0..wheels {
                    // The first row consists of ones.
                    let mut product = equations.factor[i][wheel];
                    if j > 0 {
                        product *= equations.factor[j][wheel];
                    }
                    whole += by_spring(wheel, product);
                }
                let whole = held(i, j, whole);
                let mut rest = whole;
                for k in 0..j {
                    rest -= self.lower_scaled[i][k] * self.lower[j][k];
                }
                if i == j {
                    let independent = (whole * T::constant(DEPENDENT_SHARE)).lt(rest);
                    self.inverse_pivot[j] = T::select(independent, T::one() / rest, T::zero());
                } else {
                    self.lower_scaled[i][j] = rest;
                    self.lower[i][j] = rest * self.inverse_pivot[j];
                }
            }
        }
    }

    #[inline(always)]
    fn substitute(&mut self, rows: usize, value: &[T]) {
        let x = &mut self.multiplier;
        for i in 0..rows {
            x[i] = value[i];
            for k in 0..i {
                let known = self.lower[i][k] * x[k];
                x[i] -= known;
            }
        }
        for i in (0..rows).rev() {
            x[i] *= self.inverse_pivot[i];
            for k in i + 1..rows {
                let known = self.lower[k][i] * x[k];
                x[i] -= known;
            }
        }
    }
}
