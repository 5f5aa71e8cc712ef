//! Adjoint of each wheel's load: its sensitivity to the ground wrench, the wheel positions and the joints.
//!
//! The loads N = K A' l with A N = b change by
//! ```text
//!     dN = L (db - dA N) + (I - L A) K dA' l + (I - L A) dK A' l,      L = K A' (A K A')^-1      T(23)
//! ```
//! so a wheel's load is a linear form in dA and db, and through them in everything that A and b depend on.

use std::ops::Range;

use nalgebra::Vector3;

use super::actuated::Actuation;
use super::equilibrium::Equations;
use super::response::Response;
use super::unilateral::Solver;
use crate::dynamics::kinematics::BodyMotion;
use crate::geometry::contact_plane::ContactPlane;
use crate::geometry::contact_plane_derivatives::{PlaneDerivatives, PlaneGradient};
use crate::geometry::spatial::{Wrench, cross, each, z_axis, zero};
use crate::machine::{JointKind, MAX_WHEELS, Machine, Split, TorqueJoint};
use crate::number::{Real, Wheels};

/// Derivatives of the load of one wheel, or of several side by side; where the load is linear and homogeneous in a
/// wrench, its coefficients.
#[derive(Debug, Clone)]
pub(crate) struct LoadAdjoint<T> {
    /// Coefficients of the ground wrench about the base origin with the equations' factors fixed: the
    /// contribution of a part of the wrench to the load.
    pub(crate) share: Wrench<T>,
    /// Coefficients of the torque about each free joint due to its distal subtree.
    pub(crate) torque_share: Vec<T>,
    /// Derivative with respect to the ground wrench; it differs from `share` where the wrench tilts the
    /// traction in the equations of free joints, or deflects tyres.
    pub(crate) wrench: Wrench<T>,
    /// Derivative with respect to the torque about (or the force along) each joint with known torque.
    pub(crate) torque: Vec<T>,
    /// Derivative with respect to the actuator force of each actuated joint.
    pub(crate) actuator: Vec<T>,
    /// Derivative with respect to the value of each actuated joint's equation.
    pub(crate) gearing: Vec<T>,
    /// Derivative with respect to each such joint's axis: its origin, its direction.
    pub(crate) axis: Vec<[Vector3<T>; 2]>,
    /// Derivative with respect to each wheel's centre.
    pub(crate) centre: [Vector3<T>; MAX_WHEELS],
    /// Derivative with respect to the distance of each wheel's centre from the ground.
    pub(crate) radius: [T; MAX_WHEELS],
    /// Derivative with respect to the unloaded radius of each wheel, where heights deflect tyres.
    pub(crate) rest_radius: [T; MAX_WHEELS],
    /// Derivative with respect to the roll moment distribution D.
    pub(crate) roll_moment_distribution: T,
    /// Derivative with respect to the logarithm of each wheel's stiffness.
    pub(crate) stiffness: [T; MAX_WHEELS],
}

/// The adjoints of all wheels' loads, as many wheels side by side as [`Wheels::COUNT`].
#[derive(Debug)]
pub(crate) struct LoadAdjoints<T: Real> {
    /// Adjoints of the OTF.
    pub(crate) otf: Vec<LoadAdjoint<T::Wheels>>,
    /// Adjoints of the loads, where they differ from the OTF.
    load: Vec<LoadAdjoint<T::Wheels>>,
    /// Adjoints of the OTF by the split rule alone, where torques are measured.
    rule: Vec<LoadAdjoint<T::Wheels>>,
    /// Adjoints of the loads of the first solution, which deflect the tyres.
    undeflected: Vec<LoadAdjoint<T::Wheels>>,
    lifted: bool,
    by_rule: bool,
}

impl<T: Real> LoadAdjoints<T> {
    pub(crate) fn new(machine: &Machine) -> Self {
        let groups = machine.wheels.len().div_ceil(T::Wheels::COUNT);
        let blank = vec![LoadAdjoint::zero(machine); groups];
        Self {
            otf: blank.clone(),
            load: blank.clone(),
            rule: blank.clone(),
            undeflected: blank,
            lifted: false,
            by_rule: false,
        }
    }

    /// Returns the adjoints of the loads; `None` where the loads equal the OTF.
    pub(crate) fn load(&self) -> Option<&[LoadAdjoint<T::Wheels>]> {
        self.lifted.then_some(&self.load)
    }

    /// Returns the adjoints of the OTF by the split rule without measured torques: the basis of the load contributions.
    pub(crate) fn by_rule(&self) -> &[LoadAdjoint<T::Wheels>] {
        if self.by_rule { &self.rule } else { &self.otf }
    }

    /// Fills those of the OTF by the split rule alone, whose solution is `response`.
    pub(crate) fn fill_by_rule(
        &mut self,
        configuration: &SupportConfiguration<'_, T>,
        response: &Response<T>,
        otf: &[T],
    ) {
        configuration.adjoints(response, otf, &mut self.rule);
        self.by_rule = true;
    }

    /// Fills those of the loads that deflect the tyres.
    pub(crate) fn fill_undeflected(
        &mut self,
        configuration: &SupportConfiguration<'_, T>,
        solver: &Solver<T>,
        loads: &[T],
    ) {
        let response = solver.load_response().unwrap_or(solver.otf_response());
        configuration.adjoints(response, loads, &mut self.undeflected);
    }

    /// Fills those of OTF and loads; `pressing` are the loads that deflected the tyres.
    pub(crate) fn fill(
        &mut self,
        configuration: &SupportConfiguration<'_, T>,
        solver: &Solver<T>,
        [otf, load]: [&[T]; 2],
        pressing: Option<&[T]>,
    ) {
        configuration.adjoints(solver.otf_response(), otf, &mut self.otf);
        self.lifted = solver.load_response().is_some();
        if let Some(response) = solver.load_response() {
            let loads = solver.loads_of_response(otf, load);
            configuration.adjoints(response, &loads[..load.len()], &mut self.load);
        }
        if let Some(pressing) = pressing {
            let sets = [&mut self.otf, &mut self.load];
            for set in sets.into_iter().take(if self.lifted { 2 } else { 1 }) {
                deflect(configuration.machine, &self.undeflected, pressing, set);
            }
        }
    }
}

/// R = R_0 - N / k, with N the load of the first solution and `undeflected` its adjoint.
fn deflect<T: Real>(
    machine: &Machine,
    undeflected: &[LoadAdjoint<T::Wheels>],
    pressing: &[T],
    adjoints: &mut [LoadAdjoint<T::Wheels>],
) {
    // With sizes known at compile time, the usual four wheels take half the time.
    match machine.wheels.len() {
        4 => deflect_sized(machine, 4, undeflected, pressing, adjoints),
        n => deflect_sized(machine, n, undeflected, pressing, adjoints),
    }
}

#[inline(always)]
fn deflect_sized<T: Real>(
    machine: &Machine,
    n: usize,
    undeflected: &[LoadAdjoint<T::Wheels>],
    pressing: &[T],
    adjoints: &mut [LoadAdjoint<T::Wheels>],
) {
    let mut compliance = [0.0; MAX_WHEELS];
    for (compliance, wheel) in compliance.iter_mut().zip(&machine.wheels) {
        *compliance = wheel.stiffness.map_or(0.0, |k| 1.0 / k);
    }
    for adjoint in adjoints {
        let mut by_load = [T::Wheels::constant(0.0); MAX_WHEELS];
        for (wheel, by_load) in by_load[..n].iter_mut().enumerate() {
            *by_load = -adjoint.radius[wheel] * T::Wheels::constant(compliance[wheel]);
        }
        let loads = Deflecting::<T> {
            by_load: &by_load[..n],
            undeflected,
        };
        loads.add_derivatives(&pressing[..n], adjoint);
    }
}

/// The loads that deflect the tyres, side by side.
struct Deflecting<'a, T: Real> {
    /// Derivatives of some loads with respect to the deflecting loads.
    by_load: &'a [T::Wheels],
    /// Derivatives of the deflecting loads themselves.
    undeflected: &'a [LoadAdjoint<T::Wheels>],
}

impl<T: Real> Deflecting<'_, T> {
    /// Adds the effect through the deflection of the tyres to the derivatives (not the shares) of some loads; `pressing` are the
    /// loads that deflect them.
    #[inline(always)]
    fn add_derivatives(&self, pressing: &[T], out: &mut LoadAdjoint<T::Wheels>) {
        self.add_vector(&mut out.wrench.force, |load| &load.wrench.force);
        self.add_vector(&mut out.wrench.moment, |load| &load.wrench.moment);
        for (k, axis) in out.axis.iter_mut().enumerate() {
            self.add_vector(&mut axis[0], |load| &load.axis[k][0]);
            self.add_vector(&mut axis[1], |load| &load.axis[k][1]);
        }
        for wheel in 0..pressing.len() {
            self.add_vector(&mut out.centre[wheel], |load| &load.centre[wheel]);
            self.add(&mut out.radius[wheel], |load| load.radius[wheel]);
            self.add(&mut out.rest_radius[wheel], |load| load.rest_radius[wheel]);
        }
        for k in 0..out.torque.len() {
            self.add(&mut out.torque[k], |load| load.torque[k]);
        }
        for k in 0..out.actuator.len() {
            self.add(&mut out.actuator[k], |load| load.actuator[k]);
            self.add(&mut out.gearing[k], |load| load.gearing[k]);
        }
        self.add(&mut out.roll_moment_distribution, |load| {
            load.roll_moment_distribution
        });
        for (wheel, &pressing) in pressing.iter().enumerate() {
            // a stiffer tyre is deflected less by the same load
            let less = self.by_load[wheel] * T::Wheels::each(pressing);
            let stiffness = &mut out.stiffness[wheel];
            self.add_from(0..wheel, stiffness, |load| load.stiffness[wheel]);
            *stiffness -= less;
            self.add_from(wheel..self.by_load.len(), stiffness, |load| {
                load.stiffness[wheel]
            });
        }
    }

    #[inline(always)]
    fn add_vector(
        &self,
        to: &mut Vector3<T::Wheels>,
        of: impl Fn(&LoadAdjoint<T::Wheels>) -> &Vector3<T::Wheels>,
    ) {
        self.add(&mut to.x, |load| of(load).x);
        self.add(&mut to.y, |load| of(load).y);
        self.add(&mut to.z, |load| of(load).z);
    }

    #[inline(always)]
    fn add(&self, to: &mut T::Wheels, of: impl Fn(&LoadAdjoint<T::Wheels>) -> T::Wheels) {
        self.add_from(0..self.by_load.len(), to, of);
    }

    /// Adds the effect of these wheels' deflections.
    #[inline(always)]
    fn add_from(
        &self,
        wheels: Range<usize>,
        to: &mut T::Wheels,
        of: impl Fn(&LoadAdjoint<T::Wheels>) -> T::Wheels,
    ) {
        for wheel in wheels {
            let (group, place) = (wheel / T::Wheels::COUNT, wheel % T::Wheels::COUNT);
            let by = of(&self.undeflected[group]).wheel(place);
            *to += T::Wheels::each(by) * self.by_load[wheel];
        }
    }
}

/// A solution whose adjoint is computed.
pub(crate) struct SupportConfiguration<'a, T: Real> {
    pub(crate) machine: &'a Machine,
    pub(crate) plane: &'a ContactPlane<T>,
    pub(crate) ground: &'a Wrench<T>,
    pub(crate) normal_force: T,
    pub(crate) centres: &'a [Vector3<T>],
    /// Distance of the wheels' centres from the ground (m).
    pub(crate) radii: &'a [T],
    pub(crate) motions: &'a [BodyMotion<T>],
    /// Wrench about the base origin of the distal subtree of each joint with known torque.
    pub(crate) distal: &'a [Wrench<T>],
    pub(crate) actuations: &'a [Actuation<T>],
    pub(crate) equations: &'a Equations<T>,
}

impl<T: Real> LoadAdjoint<T> {
    pub(crate) fn zero(machine: &Machine) -> Self {
        let contact = &machine.contact;
        let joints = contact.torque_joints().count();
        let actuated = contact.actuated_joints.len();
        let zero = Vector3::zeros();
        Self {
            share: Wrench::zero(),
            torque_share: vec![T::zero(); contact.free_joints.len()],
            wrench: Wrench::zero(),
            torque: vec![T::zero(); joints],
            actuator: vec![T::zero(); actuated],
            gearing: vec![T::zero(); actuated],
            axis: vec![[zero; 2]; joints],
            centre: [zero; MAX_WHEELS],
            radius: [T::zero(); MAX_WHEELS],
            rest_radius: [T::zero(); MAX_WHEELS],
            roll_moment_distribution: T::zero(),
            stiffness: [T::zero(); MAX_WHEELS],
        }
    }
}

impl<T: Real> SupportConfiguration<'_, T> {
    /// The adjoints of all wheels' loads; `loads` are those of `response`.
    pub(crate) fn adjoints(
        &self,
        response: &Response<T>,
        loads: &[T],
        adjoints: &mut [LoadAdjoint<T::Wheels>],
    ) {
        // With sizes known at compile time, the usual four wheels take half the time.
        match self.centres.len() {
            4 => self.adjoints_sized(4, response, loads, adjoints),
            n => self.adjoints_sized(n, response, loads, adjoints),
        }
    }

    #[inline(always)]
    fn adjoints_sized(
        &self,
        n: usize,
        response: &Response<T>,
        loads: &[T],
        adjoints: &mut [LoadAdjoint<T::Wheels>],
    ) {
        let (centres, radii, loads) = (&self.centres[..n], &self.radii[..n], &loads[..n]);
        let derivatives = PlaneDerivatives::new(self.plane, centres, radii);
        let mut above_plane = [T::zero(); MAX_WHEELS];
        for (wheel, above) in above_plane[..n].iter_mut().enumerate() {
            *above = derivatives.above_plane(self.plane, &centres[wheel], radii[wheel]);
        }
        for (group, adjoint) in adjoints.iter_mut().enumerate() {
            let form = LinearForm::new(self, response, loads, group * T::Wheels::COUNT);
            form.fill(&derivatives, centres, &above_plane, adjoint);
        }
    }
}

/// The loads of some wheels side by side as linear forms in the changes of the equations.
struct LinearForm<'a, T: Real> {
    configuration: &'a SupportConfiguration<'a, T>,
    response: &'a Response<T>,
    loads: &'a [T],
    /// The first of these wheels.
    first: usize,
    /// (I - L A) K of these wheels and each wheel; `None` where the springs determine nothing.
    slack: Option<[T::Wheels; MAX_WHEELS]>,
}

impl<'a, T: Real> LinearForm<'a, T> {
    fn new(
        configuration: &'a SupportConfiguration<'a, T>,
        response: &'a Response<T>,
        loads: &'a [T],
        first: usize,
    ) -> Self {
        // With as many equations as wheels the springs determine part of the solution only if some rows are
        // compliant.
        let equations = configuration.equations;
        let is_free = equations.measured < equations.wheels || equations.are_measured();
        let slack = |other| response.slack_of(equations, first, other);
        let mut free = [T::Wheels::constant(0.0); MAX_WHEELS];
        if is_free {
            for (other, free) in free[..equations.wheels].iter_mut().enumerate() {
                *free = slack(other);
            }
        }
        Self {
            configuration,
            response,
            loads,
            first,
            slack: is_free.then_some(free),
        }
    }

    /// Coefficient of db of an equation.
    #[inline(always)]
    fn value(&self, row: usize) -> T::Wheels {
        T::Wheels::of(&self.response.loads[row][self.first..])
    }

    /// Coefficient of dA of an equation and a wheel.
    #[inline(always)]
    fn factor(&self, row: usize, wheel: usize) -> T::Wheels {
        let mut coefficient = -self.value(row) * T::Wheels::each(self.loads[wheel]);
        if let Some(slack) = &self.slack {
            coefficient += slack[wheel] * T::Wheels::each(self.response.multiplier[row]);
        }
        coefficient
    }

    /// Gradient with respect to the plane's axes and height, and to the wheels at a fixed plane:
    /// ```text
    ///     b_0 = n.F    b_1 = f.M + h l.F    b_2 = l.M - h f.F      A_1j = l.c_j    A_2j = -f.c_j
    /// ```
    #[inline(always)]
    fn fill(
        &self,
        derivatives: &PlaneDerivatives<T>,
        centres: &[Vector3<T>],
        above_plane: &[T; MAX_WHEELS],
        out: &mut LoadAdjoint<T::Wheels>,
    ) {
        let configuration = self.configuration;
        let (plane, ground) = (configuration.plane, configuration.ground);
        let [b0, b1, b2] = [0, 1, 2].map(|row| self.value(row));
        let [f, l, n] = [&plane.forward, &plane.left, &plane.normal].map(each);
        let h = T::Wheels::each(plane.height);
        out.share = Wrench {
            force: n * b0 + l * (b1 * h) - f * (b2 * h),
            moment: f * b1 + l * b2,
        };
        out.wrench = out.share;
        let [force, moment] = [&ground.force, &ground.moment].map(each);
        let mut by_plane = PlaneGradient {
            forward: moment * b1 - force * (b2 * h),
            left: force * (b1 * h) + moment * b2,
            normal: force * b0,
            height: b1 * l.dot(&force) - b2 * f.dot(&force),
        };
        for (wheel, centre) in centres.iter().enumerate() {
            let (a1, a2) = (self.factor(1, wheel), self.factor(2, wheel));
            let centre = each(centre);
            by_plane.left += centre * a1;
            by_plane.forward -= centre * a2;
            out.centre[wheel] = l * a1 - f * a2;
            out.radius[wheel] = T::Wheels::constant(0.0);
            out.rest_radius[wheel] = T::Wheels::constant(0.0);
        }
        out.roll_moment_distribution = T::Wheels::constant(0.0);
        self.fill_offsets(&mut by_plane, out);
        self.fill_joints(&mut by_plane, out);
        let by_slope = derivatives.gradient(&by_plane);
        for (wheel, centre) in centres.iter().enumerate() {
            let above = above_plane[wheel];
            let (by_centre, by_radius) = derivatives.by_wheel(&by_slope, centre, above);
            out.centre[wheel] += by_centre;
            out.radius[wheel] += by_radius;
        }
        self.fill_split(centres.len(), out);
    }

    /// Heights off a plane, u_j = k (R_0j + h - n.c_j): with springs they act through (I - L A) K, with the
    /// split rule by roll moment distribution through the value of its equation.
    fn fill_offsets(
        &self,
        by_plane: &mut PlaneGradient<T::Wheels>,
        out: &mut LoadAdjoint<T::Wheels>,
    ) {
        let (configuration, contact) = (self.configuration, &self.configuration.machine.contact);
        let Some(stiffness) = contact.mean_stiffness else {
            return;
        };
        let equations = configuration.equations;
        for (wheel, centre) in configuration.centres.iter().enumerate() {
            let by_offset = match (&contact.warp, &self.slack) {
                (Some(warp), _) => {
                    self.value(equations.certain) * T::Wheels::constant(warp.value_by_offset[wheel])
                }
                (None, Some(slack)) => slack[wheel],
                (None, None) => self.response.slack_of(equations, self.first, wheel),
            };
            let by_height = by_offset * T::Wheels::constant(stiffness);
            out.rest_radius[wheel] = by_height;
            out.centre[wheel] -= each(&configuration.plane.normal) * by_height;
            by_plane.height += by_height;
            by_plane.normal -= each(centre) * by_height;
        }
    }

    /// Equations of joints, with z and p their axis and origin and q = F / F_n:
    /// ```text
    ///     b = z.(M_b - p x F_b)      A_j = z.((c_j - n R_j - p) x q)
    /// ```
    fn fill_joints(
        &self,
        by_plane: &mut PlaneGradient<T::Wheels>,
        out: &mut LoadAdjoint<T::Wheels>,
    ) {
        let (configuration, contact) = (self.configuration, &self.configuration.machine.contact);
        if contact.free_joints.is_empty() && contact.actuated_joints.is_empty() {
            return;
        }
        let mut by_traction = zero();
        out.axis.fill([by_traction; 2]);
        for (k, joint) in contact.free_joints.iter().enumerate() {
            let row = 3 + k;
            self.fill_distal_wheels(row, k, joint, by_plane, &mut by_traction, out);
            out.torque_share[k] = self.value(row);
            self.add_torque(row, k, joint, T::one(), out);
        }
        for (j, (joint, actuation)) in contact
            .actuated_joints
            .iter()
            .zip(configuration.actuations)
            .enumerate()
        {
            let row = configuration.equations.measured + j;
            if let Some(step) = joint.steps.first() {
                let pivot = contact.torque_place(j, 0);
                self.fill_distal_wheels(row, pivot, step, by_plane, &mut by_traction, out);
            }
            let [_, _, by_rod] = actuation.gearing.by_pivot;
            out.actuator[j] = -(self.value(row) * T::Wheels::each(by_rod));
            out.gearing[j] = self.value(row);
            for (s, (step, &factor)) in joint
                .steps
                .iter()
                .zip(&actuation.gearing.by_pivot)
                .enumerate()
            {
                self.add_torque(row, contact.torque_place(j, s), step, factor, out);
            }
        }
        // dq = (dF - q (dn.F + n.dF)) / F_n
        let traction = each(&(configuration.ground.force / configuration.normal_force));
        let along = by_traction.dot(&traction);
        let normal = each(&configuration.plane.normal);
        out.wrench.force +=
            (by_traction - normal * along) / T::Wheels::each(configuration.normal_force);
        by_plane.normal -= traction * along;
    }

    /// Derivatives due to the distal wheels in the row of joint `k`.
    fn fill_distal_wheels(
        &self,
        row: usize,
        k: usize,
        joint: &TorqueJoint,
        by_plane: &mut PlaneGradient<T::Wheels>,
        by_traction: &mut Vector3<T::Wheels>,
        out: &mut LoadAdjoint<T::Wheels>,
    ) {
        let configuration = self.configuration;
        let traction = configuration.ground.force / configuration.normal_force;
        let motion = &configuration.motions[joint.body];
        let (z, p) = (z_axis(&motion.rotation), motion.origin);
        let [by_origin, by_axis] = &mut out.axis[k];
        let across = cross(&traction, &z);
        for wheel in (0..configuration.centres.len()).filter(|&w| joint.supports_wheel[w]) {
            let factor = self.factor(row, wheel);
            let radius = configuration.radii[wheel];
            let arm = configuration.centres[wheel] - configuration.plane.normal * radius - p;
            *by_origin -= each(&across) * factor;
            *by_axis += each(&cross(&arm, &traction)) * factor;
            *by_traction += each(&cross(&z, &arm)) * factor;
            by_plane.normal -= each(&across) * (factor * T::Wheels::each(radius));
            out.centre[wheel] += each(&across) * factor;
            let lean = configuration.plane.normal.dot(&across);
            out.radius[wheel] -= T::Wheels::each(lean) * factor;
        }
    }

    /// Adds `factor` times the torque about (or the force along) joint `k` as the value of its row.
    fn add_torque(
        &self,
        row: usize,
        k: usize,
        joint: &TorqueJoint,
        factor: T,
        out: &mut LoadAdjoint<T::Wheels>,
    ) {
        let configuration = self.configuration;
        let value = self.value(row) * T::Wheels::each(factor);
        out.torque[k] = value;
        let (motion, distal) = (&configuration.motions[joint.body], &configuration.distal[k]);
        if k < configuration.machine.contact.free_joints.len()
            || configuration.machine.bodies[joint.body].kind == JointKind::Revolute
        {
            let z = z_axis(&motion.rotation);
            out.axis[k][0] += each(&cross(&z, &distal.force)) * value;
            out.axis[k][1] += each(&distal.about(&motion.origin).moment) * value;
        } else {
            out.axis[k][1] += each(&distal.force) * value;
        }
    }

    /// Derivatives of the split rule: of the roll moment distribution, or of the springs' stiffness.
    #[inline(always)]
    fn fill_split(&self, wheels: usize, out: &mut LoadAdjoint<T::Wheels>) {
        let equations = self.configuration.equations;
        if let Split::RollMomentDistribution {
            wheels: [fl, fr, rl, rr],
            ..
        } = self.configuration.machine.contact.split
        {
            // dA = (-1, 1, -1, 1) for FR, FL, RR, RL
            let [fl, fr, rl, rr] =
                [fl, fr, rl, rr].map(|wheel| self.factor(equations.certain, wheel));
            out.roll_moment_distribution = fl - fr + rl - rr;
        }
        for (wheel, by_stiffness) in out.stiffness[..wheels].iter_mut().enumerate() {
            *by_stiffness = T::Wheels::constant(0.0);
            if let Some(warp) = &self.configuration.machine.contact.warp {
                // The warp is dominated by its softest tyres.
                let row = equations.certain;
                let share = T::Wheels::constant(warp.compliance_share[wheel]);
                *by_stiffness = self.value(row) * T::Wheels::each(equations.value[row]) * share;
            }
            if let Some(slack) = &self.slack {
                let mut pressed = equations.offset[wheel];
                for (row, &multiplier) in self.response.multiplier[..equations.value.len()]
                    .iter()
                    .enumerate()
                {
                    pressed += equations.factor[row][wheel] * multiplier;
                }
                *by_stiffness = slack[wheel] * T::Wheels::each(pressed);
            }
        }
    }
}
