//! The machine: bodies, joints, closed chains, wheels and sensors, checked once and then immutable.
//!
//! [`MachineSpec`] is the machine file as written; [`MachineSpec::check`] puts it beside a URDF and a
//! log's joint names and gives a [`Machine`], or says what is wrong with it.

mod actuated_joint;
mod changed;
mod check;
mod drawn;
mod error;
mod fault_kind;
mod hydraulics;
mod inertia;
mod linkage;
mod nominal;
mod outline;
mod parameter;
mod plausibility_spec;
mod signals;
mod spec;
mod stated_sigma;
mod static_transform;
mod support_polygon;
mod suspension;
mod suspension_control;
mod travel;
mod tree;
mod urdf;
#[cfg(test)]
mod val_suspension_triangle;
mod warp;
mod weighed;

use nalgebra::{Isometry3, Matrix3, Vector3};

pub use actuated_joint::{ActuatedJoint, ActuatorSignal, TorqueJoint};
pub use check::LogFacts;
pub(crate) use drawn::Draws;
pub use error::MachineError;
pub use fault_kind::FaultKind;
pub use hydraulics::{HydraulicParameters, HydraulicsSpec};
pub use inertia::{Inertia, MassMoments};
pub use linkage::{Linkage, LinkageBodies, LinkageInput, LinkageMotion};
pub use outline::{JointMotion, Outline, OutlineJoint, OutlineLink, Shape};
pub(crate) use parameter::massive_links;
pub use parameter::{Axis, InertiaElement, Parameter};
pub use plausibility_spec::{PlausibilitySpec, Policy};
pub use signals::{
    FieldSpec, ImuFields, JointFields, NumberSpec, OdometryFields, OneOrMany, SignalSpec,
    SignalsSpec, WrenchFields,
};
pub use spec::{
    ArmSpec, ContactSpec, EstimatorSpec, Ground, ImuSpec, LimitsSpec, LinkageSpec, MachineSpec,
    PayloadMass, PayloadSpec, PointSpec, PressureSpec, Stiffness, SuspensionSpec, UncertaintySpec,
    WheelSpec,
};
pub use static_transform::StaticTransform;
pub use support_polygon::{Edge, SupportPolygon};
pub use suspension::Suspension;
pub use suspension_control::{ControlMode, ControlWeights, PairWeight, SuspensionControl};
pub use travel::Travel;
pub use warp::Warp;
pub use weighed::{WeighedSpec, WeighedSum, WeighedUnit};

/// Most wheels a machine may have; the load envelope looks at every way to stand on some of them.
pub const MAX_WHEELS: usize = 12;

/// A machine that can be computed: valid by construction, shared freely.
///
/// The base frame is that of the link `base_link` where the URDF has one rigid with its root, else the
/// root link's: x forward, y left, z up (REP-103).
#[derive(Debug, Clone)]
pub struct Machine {
    pub(crate) name: String,
    pub(crate) gravity: f64,
    pub(crate) base_link: String,
    pub(crate) bodies: Vec<Body>,
    pub(crate) links: Vec<Link>,
    pub(crate) linkages: Vec<Linkage>,
    pub(crate) joints: Vec<MeasuredJoint>,
    pub(crate) wheels: Vec<Wheel>,
    pub(crate) polygon: SupportPolygon,
    pub(crate) contact: Contact,
    pub(crate) imu: Mount,
    pub(crate) notes: Vec<String>,
    pub(crate) tool: Option<Mount>,
    pub(crate) arm_root: Option<Mount>,
    pub(crate) arm_seat: Option<Seat>,
    pub(crate) payloads: Vec<Payload>,
    pub(crate) limits: LimitsSpec,
    pub(crate) signals: SignalsSpec,
    pub(crate) estimator: EstimatorSpec,
    pub(crate) uncertainty: UncertaintySpec,
    pub(crate) plausibility: PlausibilitySpec,
    pub(crate) reference: Reference,
    pub(crate) suspension: Option<Suspension>,
}

/// Loads that others are compared with, by wheel (N); NaN until the machine's posture is known: see
/// [`Machine::refer_to_posture`].
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// Level and at rest.
    pub static_load: Vec<f64>,
    /// Those of the machine file, else the static ones.
    pub optimal_load: Vec<f64>,
}

/// A rigid body: links welded by fixed joints. Its frame has the z axis along the joint that carries
/// it; the root's frame is the base frame.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name of the link that its joint carries.
    pub name: String,
    /// Index of the parent body; the root's is 0, itself.
    pub parent: usize,
    /// Revolute about or prismatic along z.
    pub kind: JointKind,
    /// What the joint's coordinate follows from.
    pub drive: Drive,
    /// Orientation of the joint in the parent body.
    pub parent_from_joint: Matrix3<f64>,
    /// Position of the joint in the parent body (m).
    pub joint_in_parent: Vector3<f64>,
    /// Inertial parameters in the body's frame.
    pub inertia: Inertia,
    /// The same as moments, by the groups of its links; groups without mass left out.
    pub parts: Vec<(LinkGroup, MassMoments)>,
}

/// Which part of the machine a link is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LinkGroup {
    /// Neither wheel nor arm: what the first paper calls chassis.
    Chassis,
    /// A wheel.
    Wheel,
    /// The manipulator, with what hangs on it.
    Arm,
}

/// How a joint moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// It turns (rad).
    Revolute,
    /// It slides (m).
    Prismatic,
}

/// What a joint's coordinate follows from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// The root has no joint.
    Root,
    /// The measured joint of this index.
    Measured(usize),
    /// `multiplier * measured joint + offset`.
    Mimic {
        /// Index of the measured joint.
        joint: usize,
        /// Factor, no unit or the ratio of the joints' units.
        multiplier: f64,
        /// Offset (rad or m).
        offset: f64,
    },
    /// The pivot of this linkage.
    Pivot(usize),
    /// The cylinder hinge of this linkage.
    Cylinder(usize),
    /// The rod of this linkage.
    Rod(usize),
}

/// A link of the URDF as a part of a body.
#[derive(Debug, Clone)]
pub struct Link {
    /// Name in the URDF.
    pub name: String,
    /// The body that it is part of.
    pub body: usize,
    /// Its pose in the body's frame.
    pub body_from_link: Isometry3<f64>,
    /// Its inertial parameters in the body's frame, of its payloads not counted.
    pub inertia: Inertia,
    /// The same as moments.
    pub moments: MassMoments,
    /// The part of the machine that it belongs to.
    pub group: LinkGroup,
}

/// A joint whose position a log tells.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredJoint {
    /// Name in the URDF and in the log.
    pub name: String,
    /// Whether the log has it. Only the joint that spins a wheel may be missing.
    pub logged: bool,
    /// The wheel that it spins.
    pub spins_wheel: Option<usize>,
    /// Least and greatest position (rad or m), where the URDF has them.
    pub limits: Option<[f64; 2]>,
    /// Largest rate (rad/s or m/s), where the URDF has it.
    pub max_rate: Option<f64>,
}

/// A wheel.
#[derive(Debug, Clone)]
pub struct Wheel {
    /// Name in the machine file.
    pub name: String,
    /// The body whose point is the centre.
    pub body: usize,
    /// Centre in the body's frame (m).
    pub centre_in_body: Vector3<f64>,
    /// Radius without load (m).
    pub radius: f64,
    /// Vertical stiffness, where the machine file tells it (N/m).
    pub stiffness: Option<f64>,
    /// Vertical stiffness as a share of the mean of all wheels.
    pub relative_stiffness: f64,
    /// Centre in the base frame with all joints at zero (m).
    pub centre_at_zero: Vector3<f64>,
    /// What carries it.
    pub seat: Seat,
}

/// Where a part of the machine sits on another: what its position is measured in.
#[derive(Debug, Clone, Copy)]
pub struct Seat {
    /// The body that carries the part.
    pub carrier: usize,
    /// Axes in which the position is given, those of the link that carries it, in the carrier's frame.
    pub carrier_from_axes: Matrix3<f64>,
}

/// How the ground carries the wheels.
#[derive(Debug, Clone)]
pub struct Contact {
    /// The rule that splits what equilibrium leaves open.
    pub split: Split,
    /// Joints that carry no torque.
    pub free_joints: Vec<TorqueJoint>,
    /// Joints whose torque a log may tell.
    pub actuated_joints: Vec<ActuatedJoint>,
    /// Traction of a wheel beyond such a joint that is not its share of the whole, one standard deviation
    /// as a share of its load.
    pub traction_share: f64,
    /// Whether the wheels' radii differ without load.
    pub radii_differ: bool,
    /// Whether the tyres' stiffness is known, so that their deflection is.
    pub tyres_deflect: bool,
    /// Whether the machine file declares the ground a plane.
    pub ground: Ground,
    /// Mean stiffness of the tyres (N/m), where the ground is a plane and they are known: then heights
    /// of the wheels off one plane press them.
    pub mean_stiffness: Option<f64>,
    /// What such heights do under the front share's rule.
    pub warp: Option<Warp>,
}

/// The moments of a body's links, by group.
fn link_parts(links: &[Link], body: usize) -> Vec<(LinkGroup, MassMoments)> {
    let mut parts: Vec<(LinkGroup, Inertia)> = Vec::new();
    let massive = |link: &&Link| link.body == body && link.inertia != Inertia::zero();
    for link in links.iter().filter(massive) {
        match parts.iter_mut().find(|(group, _)| *group == link.group) {
            Some((_, inertia)) => *inertia = inertia.welded(&link.inertia),
            None => parts.push((link.group, link.inertia)),
        }
    }
    parts
        .iter()
        .map(|(group, inertia)| (*group, MassMoments::from(inertia)))
        .collect()
}

/// The rule that splits the load where equilibrium leaves it open.
#[derive(Debug, Clone, PartialEq)]
pub enum Split {
    /// Assumption 8, (54) of the first paper: right minus left of the front axle is the share D of
    /// right minus left of the machine.
    FrontShare {
        /// D, 0 to 1.
        share: f64,
        /// Indices of the wheels front left, front right, rear left, rear right.
        wheels: [usize; 4],
    },
    /// The wheels stand on springs of their stiffness on a rigid frame.
    Springs,
}

/// Something fixed to a body.
#[derive(Debug, Clone)]
pub struct Mount {
    /// The body.
    pub body: usize,
    /// Its pose in the body's frame.
    pub body_from_mount: Isometry3<f64>,
    /// Where the pose comes from, for the report.
    pub source: String,
}

/// Orientation of a mount in its body.
pub(crate) fn rotation_in_body(mount: &Mount) -> Matrix3<f64> {
    *mount.body_from_mount.rotation.to_rotation_matrix().matrix()
}

/// A load that hangs on a link for a time.
#[derive(Debug, Clone)]
pub struct Payload {
    /// The body that carries it.
    pub body: usize,
    /// The part of the machine that it hangs on.
    pub group: LinkGroup,
    /// Standard deviation of its mass (kg), where it is stated.
    pub mass_sigma: Option<f64>,
    /// Whether its mass is to be estimated; until then it is zero.
    pub is_estimated: bool,
    /// Its inertial parameters in the body's frame.
    pub inertia: Inertia,
    /// The same as moments.
    pub moments: MassMoments,
    /// From and until when it hangs there (s from the first sample).
    pub window_s: [f64; 2],
}

impl Machine {
    /// Name of the machine.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Gravitational acceleration (m/s^2).
    #[must_use]
    pub fn gravity(&self) -> f64 {
        self.gravity
    }

    /// The link whose frame is the base frame.
    #[must_use]
    pub fn base_link(&self) -> &str {
        &self.base_link
    }

    /// The rigid bodies, parents before children, the root first.
    #[must_use]
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The links of the URDF.
    #[must_use]
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// The closed chains.
    #[must_use]
    pub fn linkages(&self) -> &[Linkage] {
        &self.linkages
    }

    /// The joints whose motion a [`State`](crate::State) holds, in its order.
    #[must_use]
    pub fn joints(&self) -> &[MeasuredJoint] {
        &self.joints
    }

    /// The wheels, sorted by name.
    #[must_use]
    pub fn wheels(&self) -> &[Wheel] {
        &self.wheels
    }

    /// The polygon of the contact points.
    #[must_use]
    pub fn polygon(&self) -> &SupportPolygon {
        &self.polygon
    }

    /// How the ground carries the wheels.
    #[must_use]
    pub fn contact(&self) -> &Contact {
        &self.contact
    }

    /// Where the inertial measurement unit sits.
    #[must_use]
    pub fn imu(&self) -> &Mount {
        &self.imu
    }

    /// What is odd about it and yet no error, in plain sentences.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Where the tool wrench acts.
    #[must_use]
    pub fn tool(&self) -> Option<&Mount> {
        self.tool.as_ref()
    }

    /// How uncertain its parameters are.
    #[must_use]
    pub fn uncertainty(&self) -> &UncertaintySpec {
        &self.uncertainty
    }

    /// What counts as an implausible signal.
    #[must_use]
    pub fn plausibility(&self) -> &PlausibilitySpec {
        &self.plausibility
    }

    /// Its active suspension.
    #[must_use]
    pub fn suspension(&self) -> Option<&Suspension> {
        self.suspension.as_ref()
    }

    /// Loads that others are compared with.
    #[must_use]
    pub fn reference(&self) -> &Reference {
        &self.reference
    }

    /// Whether a measured joint slides (m), not turns (rad).
    #[must_use]
    pub fn joint_slides(&self, joint: usize) -> bool {
        let measured_rod = |linkage: &Linkage| {
            linkage.measured_joint == joint && linkage.input == LinkageInput::RodLength
        };
        let driven =
            |body: &Body| body.drive == Drive::Measured(joint) && body.kind == JointKind::Prismatic;
        self.linkages.iter().any(measured_rod) || self.bodies.iter().any(driven)
    }

    /// Takes the force on the tool out of the machine: for logs that do not measure it.
    pub fn leave_out_tool(&mut self) {
        self.tool = None;
    }

    /// Takes the forces of actuators out of the machine: where nobody has measured them.
    pub fn leave_out_actuator_forces(&mut self) {
        self.contact.actuated_joints.clear();
    }

    /// What carries the arm.
    #[must_use]
    pub fn arm_seat(&self) -> Option<&Seat> {
        self.arm_seat.as_ref()
    }

    /// Loads that hang on links.
    #[must_use]
    pub fn payloads(&self) -> &[Payload] {
        &self.payloads
    }

    /// What counts as a finding.
    #[must_use]
    pub fn limits(&self) -> &LimitsSpec {
        &self.limits
    }

    /// Topics that the machine file names.
    #[must_use]
    pub fn signals(&self) -> &SignalsSpec {
        &self.signals
    }

    /// How signals become a state.
    #[must_use]
    pub fn estimator(&self) -> &EstimatorSpec {
        &self.estimator
    }

    /// Whether `body` is `carrier` or carried by it.
    #[must_use]
    pub fn is_carried_by(&self, mut body: usize, carrier: usize) -> bool {
        while body > carrier {
            body = self.bodies[body].parent;
        }
        body == carrier
    }

    /// Mass of all bodies and of the payloads that always hang (kg).
    #[must_use]
    pub fn mass(&self) -> f64 {
        let always = |p: &&Payload| p.window_s == [f64::NEG_INFINITY, f64::INFINITY];
        self.bodies.iter().map(|b| b.inertia.mass).sum::<f64>()
            + self
                .payloads
                .iter()
                .filter(always)
                .map(|p| p.inertia.mass)
                .sum::<f64>()
    }
}
