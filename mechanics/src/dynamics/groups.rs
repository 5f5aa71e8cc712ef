//! Moments and wrenches of chassis, wheels and arm separately.

use crate::dynamics::composite::Composite;
use crate::dynamics::kinematics::BodyMotion;
use crate::geometry::spatial::Wrench;
use crate::machine::{LinkGroup, Machine};
use crate::number::Real;
use crate::state::State;

/// Moments of a part of the machine and the wrench that accelerates it, about the base origin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Part<T> {
    pub(crate) moments: Composite<T>,
    /// Wrench that accelerates the part; that of the arm with the tool wrench, which is not subtracted.
    pub(crate) wrench: Wrench<T>,
}

/// The parts of a set of bodies.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Parts<T> {
    pub(crate) chassis: Part<T>,
    pub(crate) wheels: Part<T>,
    pub(crate) arm: Part<T>,
    /// Wrench of the surroundings on the tool, if the tool belongs to the set.
    pub(crate) tool: Wrench<T>,
}

/// The parts of the whole machine and of the distal subtree of each free joint.
#[derive(Debug)]
pub(crate) struct Groups<T> {
    /// The whole machine first, then the distal subtree of each free joint.
    pub(crate) sets: Vec<Parts<T>>,
    /// Moments of every body including its payloads, until the derivatives take them.
    pub(crate) bodies: Vec<Composite<T>>,
}

impl<T: Real> Part<T> {
    #[inline(always)]
    fn zero() -> Self {
        Self {
            moments: Composite::zero(),
            wrench: Wrench::zero(),
        }
    }

    fn add(&mut self, moments: &Composite<T>, wrench: &Wrench<T>) {
        self.moments.add(moments);
        self.wrench = self.wrench.plus(wrench);
    }
}

impl<T: Real> Parts<T> {
    #[inline(always)]
    fn zero() -> Self {
        Self {
            chassis: Part::zero(),
            wheels: Part::zero(),
            arm: Part::zero(),
            tool: Wrench::zero(),
        }
    }

    fn of(&mut self, group: LinkGroup) -> &mut Part<T> {
        match group {
            LinkGroup::Chassis => &mut self.chassis,
            LinkGroup::Wheel => &mut self.wheels,
            LinkGroup::Arm => &mut self.arm,
        }
    }

    /// Moments of all parts.
    pub(crate) fn whole(&self) -> Composite<T> {
        let mut whole = self.chassis.moments;
        whole.add(&self.wheels.moments);
        whole.add(&self.arm.moments);
        whole
    }
}

impl<T: Real> Groups<T> {
    pub(crate) fn new(machine: &Machine) -> Self {
        Self {
            sets: vec![Parts::zero(); 1 + machine.contact.free_joints.len()],
            bodies: vec![Composite::zero(); machine.bodies.len()],
        }
    }

    pub(crate) fn fill(
        &mut self,
        machine: &Machine,
        state: &State<T>,
        motions: &[BodyMotion<T>],
        wrenches: &[Wrench<T>],
        tool_wrench: &Wrench<T>,
    ) {
        for set in &mut self.sets {
            *set = Parts::zero();
        }
        // Sums are formed after all moments: a sum reads several numbers at once, which takes long where they have just
        // been written one by one.
        let is_laden = |i: usize| machine.payloads.iter().any(|payload| payload.body == i);
        for (i, body) in machine.bodies.iter().enumerate() {
            match &body.parts[..] {
                [(_, moments)] if !is_laden(i) => self.bodies[i].set(moments, &motions[i]),
                _ => self.bodies[i] = Composite::zero(),
            }
        }
        for (i, body) in machine.bodies.iter().enumerate() {
            if let ([(group, _)], false) = (&body.parts[..], is_laden(i)) {
                // A body in a single group moves by its wrench, which is already known.
                self.count(machine, i, *group, &wrenches[i]);
                continue;
            }
            for (group, moments) in &body.parts {
                let moments = Composite::of(moments, &motions[i]);
                self.add(machine, i, *group, moments, &motions[i]);
            }
        }
        for (payload, &share) in machine.payloads.iter().zip(&state.payload_share) {
            let motion = &motions[payload.body];
            let moments = Composite::of(&payload.moments, motion).scaled(share);
            self.add(machine, payload.body, payload.group, moments, motion);
        }
        if let Some(tool) = &machine.tool {
            self.sets[0].tool = *tool_wrench;
            for (set, joint) in self.sets[1..].iter_mut().zip(&machine.contact.free_joints) {
                if joint.supports_body[tool.body] {
                    set.tool = *tool_wrench;
                }
            }
        }
    }

    /// Adds a body that belongs to a single group.
    fn count(&mut self, machine: &Machine, body: usize, group: LinkGroup, wrench: &Wrench<T>) {
        let moments = &self.bodies[body];
        self.sets[0].of(group).add(moments, wrench);
        for (set, joint) in self.sets[1..].iter_mut().zip(&machine.contact.free_joints) {
            if joint.supports_body[body] {
                set.of(group).add(moments, wrench);
            }
        }
    }

    /// Adds a part of a body.
    fn add(
        &mut self,
        machine: &Machine,
        body: usize,
        group: LinkGroup,
        moments: Composite<T>,
        motion: &BodyMotion<T>,
    ) {
        let wrench = moments.moved(motion);
        self.bodies[body].add(&moments);
        self.sets[0].of(group).add(&moments, &wrench);
        for (set, joint) in self.sets[1..].iter_mut().zip(&machine.contact.free_joints) {
            if joint.supports_body[body] {
                set.of(group).add(&moments, &wrench);
            }
        }
    }
}
