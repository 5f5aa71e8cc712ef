//! Exact derivatives of every wheel's load with respect to every signal and parameter, in one reverse pass.
//!
//! The adjoint of a load ([`Influence`](crate::wheel_loads)) holds its derivatives with respect to the ground
//! wrench and the wheel positions. The reverse pass continues to what these depend on: the motion of joints and
//! base ([`motion`](self)), the inertial parameters of the links, in which the wrench is linear (the
//! regressor), and the positions of wheels, arm and IMU.

mod chain;
mod geometry;
mod nominal;
mod parameter;
mod regressor;
mod sums;

pub(crate) use chain::{SensedMotion, followed_by};
pub(crate) use parameter::massive_links;
pub use parameter::{Axis, InertiaElement, Parameter};
pub(crate) use sums::LaneSums;
pub use sums::SensitivitySums;

use crate::indicators::by_travel;
use crate::machine::Machine;
use crate::newton_euler_derivatives::BaseGradient;
use crate::number::Real;
use crate::wheel_loads::{Influence, Influences};
use nalgebra::Vector3;

use chain::Chain;

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
    chain: Chain<T>,
}

impl<T: Real> Sensitivity<T> {
    pub(crate) fn new(machine: &Machine) -> Self {
        let (wheels, size) = (machine.wheels.len(), Parameter::all(machine).len());
        Self {
            otf: vec![vec![T::zero(); size]; wheels],
            load: vec![vec![T::zero(); size]; wheels],
            base: vec![BaseGradient::zero(); wheels],
            lifted: false,
            chain: Chain::new(machine),
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

    pub(crate) fn fill(&mut self, motion: &SensedMotion<'_, T>, influences: &Influences<T>) {
        self.chain.fill(motion);
        for (wheel, influence) in influences.otf.iter().enumerate() {
            self.base[wheel] = self.chain.gradient(motion, influence, &mut self.otf[wheel]);
        }
        self.lifted = influences.load().is_some();
        for (wheel, influence) in influences.load().into_iter().flatten().enumerate() {
            self.chain
                .gradient(motion, influence, &mut self.load[wheel]);
        }
    }
}

impl<T: Real> Chain<T> {
    /// Writes the derivatives of one load; returns those with respect to the base's motion.
    fn gradient(
        &mut self,
        motion: &SensedMotion<'_, T>,
        influence: &Influence<T>,
        out: &mut [T],
    ) -> BaseGradient<T> {
        let mut write = Writer { rest: out };
        let base = self.follow(motion, influence);
        self.write_signals(motion, influence, &base, &mut write);
        geometry::write_imu(motion, &base, &mut write);
        geometry::write_arm(motion, self, &base, &mut write);
        self.write_links(motion, &mut write);
        self.write_payloads(motion, &mut write);
        geometry::write_wheels(motion, self, influence, &mut write);
        geometry::write_contact(motion, influence, &mut write);
        let w = &motion.motions[0].angular_velocity;
        write.write(by_travel(&base, w, &motion.state.base.velocity));
        base
    }
}

/// Writes derivatives consecutively, in the order of [`Parameter::all`].
struct Writer<'a, T> {
    rest: &'a mut [T],
}

impl<T: Real> Writer<'_, T> {
    #[inline(always)]
    fn write<const N: usize>(&mut self, values: [T; N]) {
        if let Some((places, rest)) = std::mem::take(&mut self.rest).split_first_chunk_mut() {
            *places = values;
            self.rest = rest;
        }
    }

    #[inline(always)]
    fn vector(&mut self, vector: &Vector3<T>) {
        self.write([vector.x, vector.y, vector.z]);
    }
}
