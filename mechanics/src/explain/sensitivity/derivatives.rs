//! The derivatives of the loads at one instant.

use super::geometry;
use super::reverse_pass::ReversePass;
use super::sensed_motion::SensedMotion;
use super::wanted::{Forms, Wanted, WantedGroup};
use super::writer::Writer;
use crate::dynamics::composite::Composite;
use crate::dynamics::newton_euler_derivatives::{BaseGradient, by_base_motion};
use crate::geometry::spatial::Wrench;
use crate::machine::{Linkage, LinkageMotion, Machine, Parameter};
use crate::number::{Real, Wheels};
use crate::state::State;
use crate::wheel_loads::LoadAdjoints;

/// Derivatives of the loads at one instant, or at several instants at once.
#[derive(Debug)]
pub struct Sensitivity<T: Real> {
    /// Derivatives of the OTF, in the order of [`Parameter::all`], as many wheels side by side as [`Wheels::COUNT`].
    otf: Vec<Vec<T::Wheels>>,
    /// Derivatives of the loads, where they differ from the OTF.
    load: Vec<Vec<T::Wheels>>,
    /// Derivatives of OTF and loads with respect to the motion of the base frame.
    base: [Vec<BaseGradient<T::Wheels>>; 2],
    /// Coefficients of every body's wrench in OTF and loads, where they differ from body to body.
    by_body: [Vec<Vec<Wrench<T::Wheels>>>; 2],
    lifted: bool,
    reverse_pass: ReversePass<T>,
}

impl<T: Real> Sensitivity<T> {
    pub(crate) fn new(machine: &Machine) -> Self {
        let (wheels, size) = (machine.wheels.len(), Parameter::all(machine).len());
        let groups = wheels.div_ceil(T::Wheels::COUNT);
        let bodies = match machine.contact.torque_joints().next() {
            Some(_) => machine.bodies.len(),
            None => 0,
        };
        let nothing = vec![vec![T::Wheels::constant(0.0); size]; groups];
        Self {
            otf: nothing.clone(),
            load: nothing,
            base: [(); 2].map(|()| vec![BaseGradient::zero(); groups]),
            by_body: [(); 2].map(|()| vec![vec![Wrench::zero(); bodies]; groups]),
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

    /// Derivatives of the loads, as many wheels side by side as [`Wheels::COUNT`].
    fn loads_of_groups(&self) -> &[Vec<T::Wheels>] {
        if self.lifted { &self.load } else { &self.otf }
    }

    /// Derivatives of the OTF of a group of wheels with respect to specific force, angular velocity and angular
    /// acceleration of the base frame.
    pub(crate) fn by_base(&self, group: usize) -> &BaseGradient<T::Wheels> {
        &self.base[0][group]
    }

    /// Motion of the joints of a linkage, with the bits of [`Linkage::solve`]; every linkage must be solved by it before
    /// [`Self::fill`].
    pub(crate) fn solve(&mut self, linkage: &Linkage, state: &State<T>) -> LinkageMotion<T> {
        self.reverse_pass.solve(linkage, state)
    }

    /// Takes the moments of every body before [`Self::fill`], and leaves memory for the next ones.
    pub(crate) fn take_moments(&mut self, bodies: &mut Vec<Composite<T>>) {
        self.reverse_pass.take_moments(bodies);
    }

    /// Computes the derivatives, and shows those of each group of wheels to `see`.
    pub(crate) fn fill(
        &mut self,
        motion: &SensedMotion<'_, T>,
        adjoints: &LoadAdjoints<T>,
        mut see: impl FnMut(&GroupDerivatives<'_, T::Wheels>),
    ) {
        self.reverse_pass.fill(motion);
        self.lifted = adjoints.load().is_some();
        let [otf_base, load_base] = &mut self.base;
        let [otf_by_body, load_by_body] = &mut self.by_body;
        let mut wanted = [
            Wanted {
                adjoints: &adjoints.otf,
                by_body: otf_by_body,
                base: otf_base,
                out: &mut self.otf,
            },
            Wanted {
                adjoints: adjoints.load().unwrap_or_default(),
                by_body: load_by_body,
                base: load_base,
                out: &mut self.load,
            },
        ];
        self.reverse_pass.gradients(motion, &mut wanted);
        for (group, otf) in self.otf.iter().enumerate() {
            see(&GroupDerivatives {
                group,
                otf,
                load: self.lifted.then_some(&self.load[group]),
            });
        }
    }
}

/// The derivatives of a group of wheels, as many side by side as [`Wheels::COUNT`].
pub(crate) struct GroupDerivatives<'a, V> {
    /// Index of the group.
    pub(crate) group: usize,
    /// Derivatives of the OTF, in the order of [`Parameter::all`].
    pub(crate) otf: &'a [V],
    /// Derivatives of the loads, where a wheel is lifted in any of the samples.
    pub(crate) load: Option<&'a [V]>,
}

impl<V> GroupDerivatives<'_, V> {
    /// Returns the derivatives of the loads, which are those of the OTF where no wheel is lifted.
    pub(crate) fn of_loads(&self) -> &[V] {
        self.load.unwrap_or(self.otf)
    }
}

fn of_wheel<T: Real>(groups: &[Vec<T::Wheels>], wheel: usize) -> Vec<T> {
    let place = wheel % T::Wheels::COUNT;
    let group = &groups[wheel / T::Wheels::COUNT];
    group.iter().map(|by| by.wheel(place)).collect()
}

impl<T: Real> ReversePass<T> {
    /// Writes the derivatives of the wanted loads.
    fn gradients(&mut self, motion: &SensedMotion<'_, T>, wanted: &mut [Wanted<'_, T>; 2]) {
        let mut first_of_links = 0;
        for wanted in &mut *wanted {
            for (group, adjoint) in wanted.adjoints.iter().enumerate() {
                let by_body = &mut wanted.by_body[group];
                let base = self.follow(motion.machine, adjoint, by_body);
                wanted.base[group] = base;
                let forms = Forms { adjoint, by_body };
                let sensed = base.by_sensor(motion);
                let out = &mut wanted.out[group];
                let size = out.len();
                let mut write = Writer { rest: out };
                self.write_signals(motion, forms, &sensed, &mut write);
                geometry::write_imu(motion, self, &base, &sensed, &mut write);
                geometry::write_arm(motion, self, forms, &base, &mut write);
                first_of_links = size - write.rest.len();
            }
        }
        let next = self.write_links(motion, first_of_links, wanted);
        let (w, velocity) = (
            &motion.motions[0].angular_velocity,
            &motion.state.base.velocity,
        );
        for wanted in wanted {
            for group in 0..wanted.adjoints.len() {
                let WantedGroup { forms, base, out } = wanted.group(group);
                let mut write = Writer {
                    rest: &mut out[next..],
                };
                self.write_payloads(motion, forms, &mut write);
                geometry::write_wheels(motion, self, forms, &mut write);
                geometry::write_contact(motion, forms.adjoint, &mut write);
                write.write(by_base_motion(base, w, velocity));
            }
        }
    }
}
