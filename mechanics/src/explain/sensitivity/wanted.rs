//! The loads whose derivatives a reverse pass writes.

use crate::dynamics::newton_euler_derivatives::BaseGradient;
use crate::geometry::spatial::Wrench;
use crate::number::Real;
use crate::wheel_loads::LoadAdjoint;

/// Coefficients of the bodies' wrenches in the loads of a group of wheels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Forms<'a, V> {
    pub(super) adjoint: &'a LoadAdjoint<V>,
    /// Coefficients of every body's wrench, where there are joints with known torque: without them, all bodies have those of the
    /// ground wrench.
    pub(super) by_body: &'a [Wrench<V>],
}

impl<'a, V> Forms<'a, V> {
    /// Coefficients of a body's wrench.
    #[inline(always)]
    pub(super) fn of(self, body: usize) -> &'a Wrench<V> {
        if self.by_body.is_empty() {
            &self.adjoint.wrench
        } else {
            &self.by_body[body]
        }
    }
}

/// The loads of all wheels, by group, with places for their derivatives.
pub(super) struct Wanted<'a, T: Real> {
    pub(super) adjoints: &'a [LoadAdjoint<T::Wheels>],
    /// Coefficients of each body's wrench, by group: see [`Forms`].
    pub(super) by_body: &'a mut [Vec<Wrench<T::Wheels>>],
    /// Derivatives with respect to the motion of the base frame.
    pub(super) base: &'a mut [BaseGradient<T::Wheels>],
    /// Derivatives with respect to all parameters.
    pub(super) out: &'a mut [Vec<T::Wheels>],
}

/// The load adjoint of one group of wheels, with the places for its derivatives.
pub(super) struct WantedGroup<'a, V> {
    pub(super) forms: Forms<'a, V>,
    pub(super) base: &'a BaseGradient<V>,
    pub(super) out: &'a mut [V],
}

impl<T: Real> Wanted<'_, T> {
    /// Returns the load adjoint of a group of wheels, with the places for its derivatives.
    pub(super) fn group(&mut self, group: usize) -> WantedGroup<'_, T::Wheels> {
        WantedGroup {
            forms: Forms {
                adjoint: &self.adjoints[group],
                by_body: &self.by_body[group],
            },
            base: &self.base[group],
            out: &mut self.out[group],
        }
    }

    /// The coefficients of each group, and the places for its derivatives.
    #[inline(always)]
    pub(super) fn groups(
        &mut self,
    ) -> impl Iterator<Item = (Forms<'_, T::Wheels>, &mut [T::Wheels])> {
        let forms = self.adjoints.iter().zip(&*self.by_body);
        let forms = forms.map(|(adjoint, by_body)| Forms { adjoint, by_body });
        forms.zip(self.out.iter_mut().map(Vec::as_mut_slice))
    }
}
