//! Source of each joint's motion: a measurement, a linkage or a mimic rule.

use nalgebra::Vector3;

use super::checker::Checker;
use crate::machine::impossible_inertia::figure;
use crate::machine::linkage::{self, LinkageBodies, LinkageInput};
use crate::machine::spec::LinkageSpec;
use crate::machine::tree::TreeJoint;
use crate::machine::{
    JointCoupling, JointKind, Linkage, MachineError, MeasuredJoint, NumberSpec, SupportKind, Wheel,
};

/// The coupling of each body's joint, and the resulting measured joints and closed chains.
pub(super) struct Driving {
    pub(super) couplings: Vec<Option<JointCoupling>>,
    pub(super) joints: Vec<MeasuredJoint>,
    pub(super) linkages: Vec<Linkage>,
}

fn measured_joint(
    joint: &TreeJoint,
    logged: bool,
    constant: Option<f64>,
    spins_wheel: Option<usize>,
) -> MeasuredJoint {
    MeasuredJoint {
        name: joint.name.clone(),
        logged,
        constant: constant.filter(|_| !logged),
        position_sigma: None,
        spins_wheel,
        limits: joint.stated_limits(),
        max_velocity: joint.max_velocity,
    }
}

impl Checker<'_> {
    pub(super) fn driving(&self, wheels: &[Wheel]) -> Result<Driving, MachineError> {
        let mut driving = Driving {
            couplings: vec![None; self.tree.bodies.len()],
            joints: Vec::new(),
            linkages: Vec::new(),
        };
        driving.couplings[0] = Some(JointCoupling::Root);
        for spec in &self.spec.linkage {
            self.add_linkage(spec, &mut driving)?;
        }
        let mut missing = Vec::new();
        for (i, body) in self.tree.bodies.iter().enumerate() {
            let Some(joint) = body
                .joint
                .as_ref()
                .filter(|j| driving.couplings[i].is_none() && j.mimic.is_none())
            else {
                continue;
            };
            let spins_wheel = self.wheel_spun_by(i, wheels);
            let logged = self.is_logged(&joint.name);
            let constant = self.constant(&joint.name);
            if logged || constant.is_some() || spins_wheel.is_some() {
                driving.couplings[i] = Some(JointCoupling::Measured(driving.joints.len()));
                driving
                    .joints
                    .push(measured_joint(joint, logged, constant, spins_wheel));
            } else {
                missing.push(self.with_carried_mass(&joint.name));
            }
        }
        self.follow_mimics(&mut driving, &mut missing);
        if missing.is_empty() {
            Ok(driving)
        } else {
            Err(self.unmeasured(&missing))
        }
    }

    fn unmeasured(&self, joints: &[String]) -> MachineError {
        MachineError::UnmeasuredJoints {
            joints: joints.join(", "),
            urdf: self.urdf_name.into(),
            logged: self
                .log
                .joint_names
                .map_or(String::new(), |names| names.join(", ")),
        }
    }

    /// Returns the joint's name with the mass that the joint carries, by which its position matters.
    fn with_carried_mass(&self, joint: &str) -> String {
        let [kg, percent] = self.carried_mass(joint);
        format!("\"{joint}\" (carries {kg} kg, {percent} % of the mass)")
    }

    /// The mass that a joint carries (kg), and its share (%).
    pub(super) fn carried_mass(&self, joint: &str) -> [String; 2] {
        let bodies = &self.tree.bodies;
        let mass = |carrier: usize| -> f64 {
            let carried = (0..bodies.len()).filter(|&b| self.tree.is_carried_by(b, carrier));
            carried.map(|b| bodies[b].inertia.mass).sum()
        };
        let carried = self.tree.body_of_joint(joint).map_or(0.0, mass);
        [carried, 100.0 * carried / mass(0)].map(figure)
    }

    /// Whether the log contains a joint; without a log, every joint without a constant counts as logged.
    fn is_logged(&self, joint: &str) -> bool {
        match self.log.joint_names {
            Some(names) => names.iter().any(|n| n == joint),
            None => self.constant(joint).is_none(),
        }
    }

    /// The constant position of a joint that nobody logs.
    fn constant(&self, joint: &str) -> Option<f64> {
        match self.spec.signals.joints.get(joint)?.position {
            Some(NumberSpec::Constant(position)) => Some(position),
            _ => None,
        }
    }

    fn add_linkage(&self, spec: &LinkageSpec, driving: &mut Driving) -> Result<(), MachineError> {
        let key = |field: &str| format!("linkage.{}.{field}", spec.name);
        let bodies = LinkageBodies {
            pivot: self.joint(&key("pivot"), &spec.pivot)?,
            cylinder: self.joint(&key("cylinder"), &spec.cylinder)?,
            rod: self.joint(&key("rod"), &spec.rod)?,
        };
        self.link(&key("rod_end.link"), &spec.rod_end.link)?;
        self.link(&key("anchor.link"), &spec.anchor.link)?;
        let index = driving.linkages.len();
        for (body, name) in [
            (bodies.pivot, &spec.pivot),
            (bodies.cylinder, &spec.cylinder),
            (bodies.rod, &spec.rod),
        ] {
            if driving.couplings[body].is_some() {
                return Err(self.value_error(
                    format!("linkage.{}", spec.name),
                    "joints that no other linkage uses",
                    format!("\"{name}\" twice"),
                ));
            }
        }
        // what the log measures comes before a constant
        let has = |joint: &str| self.constant(joint).is_some();
        let input = if self.is_logged(&spec.pivot) {
            LinkageInput::PivotAngle
        } else if self.is_logged(&spec.rod) {
            LinkageInput::RodLength
        } else if has(&spec.pivot) {
            LinkageInput::PivotAngle
        } else if has(&spec.rod) {
            LinkageInput::RodLength
        } else {
            let pivot = self.with_carried_mass(&spec.pivot);
            return Err(self.unmeasured(&[format!("{pivot} (or \"{}\")", spec.rod)]));
        };
        let measured = driving.joints.len();
        let body = match input {
            LinkageInput::PivotAngle => bodies.pivot,
            LinkageInput::RodLength => bodies.rod,
        };
        let joint = self.tree.bodies[body].joint.as_ref();
        let near = self.pivot_near(spec, bodies.pivot, input)?;
        driving.linkages.push(linkage::build(
            spec,
            bodies,
            near,
            input,
            measured,
            self.tree,
            &self.spec.file,
        )?);
        driving.joints.extend(joint.map(|joint| {
            let logged = self.is_logged(&joint.name);
            measured_joint(joint, logged, self.constant(&joint.name), None)
        }));
        driving.couplings[bodies.pivot] = Some(JointCoupling::Pivot(index));
        driving.couplings[bodies.cylinder] = Some(JointCoupling::Cylinder(index));
        driving.couplings[bodies.rod] = Some(JointCoupling::Rod(index));
        Ok(())
    }

    /// An angle of the pivot on the side of the dead centre on which the machine works: as stated, that of the reference posture, the
    /// middle of limits that span less than half a turn, or zero for a suspension, whose wheels are level there. Two angles fit each
    /// length of a rod.
    fn pivot_near(
        &self,
        spec: &LinkageSpec,
        pivot: usize,
        input: LinkageInput,
    ) -> Result<f64, MachineError> {
        let posture = &self.spec.limits.reference_posture;
        let stated = spec
            .pivot_near
            .or_else(|| posture.get(&spec.pivot).copied());
        let joint = self.tree.bodies[pivot].joint.as_ref();
        let limits = joint.and_then(TreeJoint::stated_limits);
        let middle = limits
            .filter(|[lower, upper]| upper - lower < std::f64::consts::PI)
            .map(|[lower, upper]| 0.5 * (lower + upper));
        let is_below = |link: &str| {
            let link = self.tree.link(link);
            link.is_some_and(|link| self.tree.is_carried_by(self.tree.links[link].body, pivot))
        };
        let suspends = self.spec.wheels.values().any(|wheel| is_below(&wheel.link));
        let level = suspends.then_some(0.0);
        match (stated.or(middle).or(level), input) {
            (Some(near), _) => Ok(near),
            // the measured angle is on the side on which it is
            (None, LinkageInput::PivotAngle) => Ok(0.0),
            (None, LinkageInput::RodLength) => Err(self.value_error(
                format!("linkage.{}.pivot_near", spec.name),
                format!(
                    "an angle of \"{}\" on the side on which the machine works [rad] (or one in limits.reference_posture, or limits in \
                     the URDF that span less than half a turn): only its rod is measured, and two angles fit each length",
                    spec.pivot
                ),
                "none",
            )),
        }
    }

    /// A mimic joint is coupled to a measured one; a chain of mimic joints is resolved to its source.
    fn follow_mimics(&self, driving: &mut Driving, missing: &mut Vec<String>) {
        for (i, body) in self.tree.bodies.iter().enumerate() {
            let Some(mut mimic) = body
                .joint
                .as_ref()
                .filter(|_| driving.couplings[i].is_none())
                .and_then(|j| j.mimic.clone())
            else {
                continue;
            };
            for _ in 0..self.tree.bodies.len() {
                let followed = self
                    .tree
                    .body_of_joint(&mimic.joint)
                    .map(|b| &self.tree.bodies[b]);
                let Some(next) = followed
                    .and_then(|b| b.joint.as_ref())
                    .and_then(|j| j.mimic.as_ref())
                else {
                    break;
                };
                mimic.offset += mimic.multiplier * next.offset;
                mimic.multiplier *= next.multiplier;
                mimic.joint.clone_from(&next.joint);
            }
            match driving.joints.iter().position(|j| j.name == mimic.joint) {
                Some(joint) => {
                    driving.couplings[i] = Some(JointCoupling::Mimic {
                        joint,
                        multiplier: mimic.multiplier,
                        offset: mimic.offset,
                    });
                }
                None => missing
                    .push(self.with_carried_mass(body.joint.as_ref().map_or("", |j| &j.name))),
            }
        }
    }

    /// The wheel whose centre lies on the axis of the revolute joint of `body` and in its distal subtree: such a
    /// joint only spins the wheel.
    pub(super) fn wheel_spun_by(&self, body: usize, wheels: &[Wheel]) -> Option<usize> {
        let revolute = self.tree.bodies[body]
            .joint
            .as_ref()
            .is_some_and(|j| j.kind == JointKind::Revolute);
        let lies = |z: &Vector3<f64>| (self.tree.bodies[body].base_from_body * z).z.abs() < 0.5;
        wheels.iter().position(|w| {
            w.kind == SupportKind::Wheel
                && revolute
                && w.body == body
                && w.centre_in_body.xy().norm() < 1e-6
                && lies(&Vector3::z())
        })
    }
}
