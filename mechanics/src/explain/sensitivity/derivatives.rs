//! The derivatives of the loads at one instant.

use super::geometry;
use super::reverse_pass::ReversePass;
use super::sensed_motion::SensedMotion;
use super::writer::Writer;
use crate::dynamics::newton_euler_derivatives::{BaseGradient, by_base_motion};
use crate::machine::{Machine, Parameter};
use crate::number::Real;
use crate::wheel_loads::{LoadAdjoint, LoadAdjoints};

/// Derivatives of the loads at one instant, or at several instants at once.
#[derive(Debug)]
pub struct Sensitivity<T: Real> {
    /// Of the OTF of each wheel, in the order of [`Parameter::all`].
    otf: Vec<Vec<T>>,
    /// Of the loads, where they differ from the OTF.
    load: Vec<Vec<T>>,
    /// Of the OTF with respect to the motion of the base frame.
    base: Vec<BaseGradient<T>>,
    lifted: bool,
    reverse_pass: ReversePass<T>,
}

impl<T: Real> Sensitivity<T> {
    pub(crate) fn new(machine: &Machine) -> Self {
        let (wheels, size) = (machine.wheels.len(), Parameter::all(machine).len());
        Self {
            otf: vec![vec![T::zero(); size]; wheels],
            load: vec![vec![T::zero(); size]; wheels],
            base: vec![BaseGradient::zero(); wheels],
            lifted: false,
            reverse_pass: ReversePass::new(machine),
        }
    }

    /// Derivatives of a wheel's OTF, in the order of [`Parameter::all`].
    #[must_use]
    pub fn otf(&self, wheel: usize) -> &[T] {
        &self.otf[wheel]
    }

    /// Derivatives of a wheel's load: zero for a lifted wheel, NaN while the machine tips.
    #[must_use]
    pub fn load(&self, wheel: usize) -> &[T] {
        if self.lifted {
            &self.load[wheel]
        } else {
            &self.otf[wheel]
        }
    }

    /// Whether a wheel is lifted in any of the samples.
    pub(crate) fn loads_differ(&self) -> bool {
        self.lifted
    }

    /// Derivatives of a wheel's OTF with respect to specific force, angular velocity and angular acceleration of
    /// the base frame.
    pub(crate) fn by_base(&self, wheel: usize) -> &BaseGradient<T> {
        &self.base[wheel]
    }

    pub(crate) fn fill(&mut self, motion: &SensedMotion<'_, T>, adjoints: &LoadAdjoints<T>) {
        self.reverse_pass.fill(motion);
        for (wheel, adjoint) in adjoints.otf.iter().enumerate() {
            self.base[wheel] = self
                .reverse_pass
                .gradient(motion, adjoint, &mut self.otf[wheel]);
        }
        self.lifted = adjoints.load().is_some();
        for (wheel, adjoint) in adjoints.load().into_iter().flatten().enumerate() {
            self.reverse_pass
                .gradient(motion, adjoint, &mut self.load[wheel]);
        }
    }
}

impl<T: Real> ReversePass<T> {
    /// Writes the derivatives of one load; returns those with respect to the base's motion.
    fn gradient(
        &mut self,
        motion: &SensedMotion<'_, T>,
        adjoint: &LoadAdjoint<T>,
        out: &mut [T],
    ) -> BaseGradient<T> {
        let mut write = Writer { rest: out };
        let base = self.follow(motion, adjoint);
        self.write_signals(motion, adjoint, &base, &mut write);
        geometry::write_imu(motion, &base, &mut write);
        geometry::write_arm(motion, self, &base, &mut write);
        self.write_links(motion, &mut write);
        self.write_payloads(motion, &mut write);
        geometry::write_wheels(motion, self, adjoint, &mut write);
        geometry::write_contact(motion, adjoint, &mut write);
        let w = &motion.motions[0].angular_velocity;
        write.write(by_base_motion(&base, w, &motion.state.base.velocity));
        base
    }
}
