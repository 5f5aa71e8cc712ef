//! The derivatives of the loads at one instant.

use super::geometry;
use super::reverse_pass::ReversePass;
use super::sensed_motion::SensedMotion;
use super::writer::Writer;
use crate::dynamics::composite::Composite;
use crate::dynamics::newton_euler_derivatives::{BaseGradient, by_base_motion};
use crate::machine::{Machine, Parameter};
use crate::number::{Real, Wheels};
use crate::wheel_loads::{LoadAdjoint, LoadAdjoints};

/// Derivatives of the loads at one instant, or at several instants at once.
#[derive(Debug)]
pub struct Sensitivity<T: Real> {
    /// Of the OTF, in the order of [`Parameter::all`], as many wheels side by side as [`Wheels::COUNT`].
    otf: Vec<Vec<T::Wheels>>,
    /// Of the loads, where they differ from the OTF.
    load: Vec<Vec<T::Wheels>>,
    /// Of the OTF with respect to the motion of the base frame.
    base: Vec<BaseGradient<T::Wheels>>,
    lifted: bool,
    reverse_pass: ReversePass<T>,
}

impl<T: Real> Sensitivity<T> {
    pub(crate) fn new(machine: &Machine) -> Self {
        let (wheels, size) = (machine.wheels.len(), Parameter::all(machine).len());
        let groups = wheels.div_ceil(T::Wheels::COUNT);
        let nothing = vec![vec![T::Wheels::constant(0.0); size]; groups];
        Self {
            otf: nothing.clone(),
            load: nothing,
            base: vec![BaseGradient::zero(); groups],
            lifted: false,
            reverse_pass: ReversePass::new(machine),
        }
    }

    /// Derivatives of a wheel's OTF, in the order of [`Parameter::all`].
    #[must_use]
    pub fn otf(&self, wheel: usize) -> Vec<T> {
        of_wheel(&self.otf, wheel)
    }

    /// Derivatives of a wheel's load: zero for a lifted wheel, NaN while the machine tips.
    #[must_use]
    pub fn load(&self, wheel: usize) -> Vec<T> {
        of_wheel(self.loads_of_groups(), wheel)
    }

    /// Derivatives of the OTF, as many wheels side by side as [`Wheels::COUNT`].
    pub(crate) fn otf_of_groups(&self) -> &[Vec<T::Wheels>] {
        &self.otf
    }

    /// Derivatives of the loads, as many wheels side by side as [`Wheels::COUNT`].
    pub(crate) fn loads_of_groups(&self) -> &[Vec<T::Wheels>] {
        if self.lifted { &self.load } else { &self.otf }
    }

    /// Whether a wheel is lifted in any of the samples.
    pub(crate) fn loads_differ(&self) -> bool {
        self.lifted
    }

    /// Derivatives of the OTF of a group of wheels with respect to specific force, angular velocity and angular
    /// acceleration of the base frame.
    pub(crate) fn by_base(&self, group: usize) -> &BaseGradient<T::Wheels> {
        &self.base[group]
    }

    /// Takes the moments of every body before [`Self::fill`], and leaves memory for the next ones.
    pub(crate) fn take_moments(&mut self, bodies: &mut Vec<Composite<T>>) {
        self.reverse_pass.take_moments(bodies);
    }

    pub(crate) fn fill(&mut self, motion: &SensedMotion<'_, T>, adjoints: &LoadAdjoints<T>) {
        let pass = &mut self.reverse_pass;
        pass.fill(motion);
        for (group, adjoint) in adjoints.otf.iter().enumerate() {
            self.base[group] = pass.gradient(motion, adjoint, &mut self.otf[group]);
        }
        self.lifted = adjoints.load().is_some();
        for (group, adjoint) in adjoints.load().into_iter().flatten().enumerate() {
            pass.gradient(motion, adjoint, &mut self.load[group]);
        }
    }
}

fn of_wheel<T: Real>(groups: &[Vec<T::Wheels>], wheel: usize) -> Vec<T> {
    let place = wheel % T::Wheels::COUNT;
    let group = &groups[wheel / T::Wheels::COUNT];
    group.iter().map(|by| by.wheel(place)).collect()
}

impl<T: Real> ReversePass<T> {
    /// Writes the derivatives of the loads of `adjoint`; returns those with respect to the base's motion.
    fn gradient(
        &mut self,
        motion: &SensedMotion<'_, T>,
        adjoint: &LoadAdjoint<T::Wheels>,
        out: &mut [T::Wheels],
    ) -> BaseGradient<T::Wheels> {
        let mut write = Writer { rest: out };
        let base = self.follow(motion.machine, adjoint);
        let sensed = base.by_sensor(motion);
        self.write_signals(motion, adjoint, &sensed, &mut write);
        geometry::write_imu(motion, self, &base, &sensed, &mut write);
        geometry::write_arm(motion, self, adjoint, &base, &mut write);
        self.write_links(motion, adjoint, &mut write);
        self.write_payloads(motion, adjoint, &mut write);
        geometry::write_wheels(motion, self, adjoint, &mut write);
        geometry::write_contact(motion, adjoint, &mut write);
        let w = &motion.motions[0].angular_velocity;
        write.write(by_base_motion(&base, w, &motion.state.base.velocity));
        base
    }
}
