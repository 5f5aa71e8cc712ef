//! The machine: bodies, joints, closed chains, wheels and sensors, validated once and then immutable.
//!
//! [`MachineSpec`] is the machine file as written; [`MachineSpec::check`] combines it with a URDF and a log's
//! joint names into a [`Machine`], or explains what is wrong.

mod actuated_joint;
mod changed;
mod check;
mod drawn;
mod error;
mod inertia;
mod linkage;
mod outline;
mod plausibility_spec;
mod signals;
mod spec;
mod static_transform;
mod support_polygon;
mod suspension;
mod suspension_control;
mod tree;
mod urdf;
#[cfg(test)]
mod val_suspension_triangle;
mod warp;
mod weighed;

use nalgebra::{Isometry3, Matrix3, Vector3};

pub use actuated_joint::{ActuatedJoint, TorqueJoint};
pub use check::LogFacts;
pub(crate) use drawn::Draws;
pub use error::MachineError;
pub use inertia::{Inertia, MassMoments};
pub use linkage::{Linkage, LinkageInput};
pub use outline::{JointMotion, Outline, OutlineJoint, OutlineLink, Shape};
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
pub use warp::Warp;
pub use weighed::{WeighedSpec, WeighedSum, WeighedUnit};

/// Maximum number of wheels; the load envelope enumerates the possible sets of loaded wheels.
pub const MAX_WHEELS: usize = 12;

/// A machine that is ready for computation: valid by construction and cheap to share.
///
/// The base frame is that of the link `base_link` if the URDF has one rigidly connected to its root, else the
/// frame of the root link: x forward, y left, z up (REP-103).
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

/// Reference loads by wheel (N); NaN until the reference posture is known: see
/// [`Machine::refer_to_posture`].
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// Loads at rest on level ground.
    pub static_load: Vec<f64>,
    /// Optimal loads from the machine file, else the static ones.
    pub optimal_load: Vec<f64>,
}

/// A rigid body: links connected by fixed joints. The z axis of its frame is the axis of its joint; the root's
/// frame is the base frame.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name of the link that its joint moves.
    pub name: String,
    /// Index of the parent body; the root is its own parent (0).
    pub parent: usize,
    /// Revolute about or prismatic along z.
    pub kind: JointKind,
    /// Source of the joint's coordinate.
    pub drive: Drive,
    /// Orientation of the joint in the parent body.
    pub parent_from_joint: Matrix3<f64>,
    /// Position of the joint in the parent body (m).
    pub joint_in_parent: Vector3<f64>,
    /// Inertial parameters in the body's frame.
    pub inertia: Inertia,
    /// The same as moments, by the groups of its links; groups without mass are omitted.
    pub parts: Vec<(LinkGroup, MassMoments)>,
}

/// The part of the machine that a link belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LinkGroup {
    /// Neither wheel nor arm: the chassis of the first paper.
    Chassis,
    /// A wheel.
    Wheel,
    /// The manipulator, including its payloads.
    Arm,
}

/// Type of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// Rotation about its axis (rad).
    Revolute,
    /// Displacement along its axis (m).
    Prismatic,
}

/// Source of a joint's coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// The root has no joint.
    Root,
    /// The measured joint with this index.
    Measured(usize),
    /// `multiplier * measured joint + offset`.
    Mimic {
        /// Index of the measured joint.
        joint: usize,
        /// Factor (dimensionless, or the ratio of the joints' units).
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

/// A URDF link, part of a body.
#[derive(Debug, Clone)]
pub struct Link {
    /// Name in the URDF.
    pub name: String,
    /// The body that it belongs to.
    pub body: usize,
    /// Its pose in the body's frame.
    pub body_from_link: Isometry3<f64>,
    /// Its inertial parameters in the body's frame, without payloads.
    pub inertia: Inertia,
    /// The same as moments.
    pub(crate) moments: MassMoments,
    /// The part of the machine that it belongs to.
    pub group: LinkGroup,
}

/// A joint whose position is logged.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredJoint {
    /// Name in the URDF and in the log.
    pub name: String,
    /// Whether the log contains it. Only a wheel's spin joint may be missing.
    pub logged: bool,
    /// The wheel that it spins, if any.
    pub spins_wheel: Option<usize>,
    /// Smallest and largest position (rad or m), where the URDF states them.
    pub limits: Option<[f64; 2]>,
    /// Largest velocity (rad/s or m/s), where the URDF states it.
    pub max_rate: Option<f64>,
}

/// A wheel.
#[derive(Debug, Clone)]
pub struct Wheel {
    /// Name in the machine file.
    pub name: String,
    /// The body that carries the wheel's centre.
    pub body: usize,
    /// Centre in the body's frame (m).
    pub centre_in_body: Vector3<f64>,
    /// Unloaded radius (m).
    pub radius: f64,
    /// Vertical stiffness (N/m), where the machine file states it.
    pub stiffness: Option<f64>,
    /// Vertical stiffness relative to the mean of all wheels.
    pub relative_stiffness: f64,
    /// Centre in the base frame with all joints at zero (m).
    pub centre_at_zero: Vector3<f64>,
    /// The mount on the body that carries it.
    pub seat: Seat,
}

/// The mount of a part on another body: the reference for its position.
#[derive(Debug, Clone, Copy)]
pub struct Seat {
    /// Index of the body that carries the part.
    pub carrier: usize,
    /// Axes of its position, those of the carrying link, in the carrier's frame.
    pub carrier_from_axes: Matrix3<f64>,
}

/// Contact between wheels and ground.
#[derive(Debug, Clone)]
pub struct Contact {
    /// The rule for the load split that equilibrium leaves open.
    pub split: Split,
    /// Joints that carry no torque.
    pub free_joints: Vec<TorqueJoint>,
    /// Joints whose torque may be logged.
    pub actuated_joints: Vec<ActuatedJoint>,
    /// Standard deviation of a distal wheel's traction from its proportional share, as a fraction of its load,
    /// for such joints.
    pub traction_share: f64,
    /// Whether the unloaded radii of the wheels differ.
    pub radii_differ: bool,
    /// Whether the tyres' stiffness is known, so that their deflection is included.
    pub tyres_deflect: bool,
    /// Whether the machine file declares the ground flat.
    pub ground: Ground,
    /// Mean stiffness of the tyres (N/m), if the ground is flat and the stiffness known: then the wheels' heights
    /// off a common plane deflect the tyres.
    pub mean_stiffness: Option<f64>,
    /// Effect of such heights under the split rule by roll moment distribution.
    pub warp: Option<Warp>,
}

/// Moments of a body's links, by group.
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

/// The rule for the load split that equilibrium leaves open.
#[derive(Debug, Clone, PartialEq)]
pub enum Split {
    /// Assumption 8, (54) of the first paper: the front axle carries the share D of the load difference between
    /// the right and the left side.
    FrontShare {
        /// D, 0 to 1.
        share: f64,
        /// Indices of the wheels front left, front right, rear left, rear right.
        wheels: [usize; 4],
    },
    /// The wheels are springs of their stiffness under a rigid frame.
    Springs,
}

/// A frame fixed to a body.
#[derive(Debug, Clone)]
pub struct Mount {
    /// The body.
    pub body: usize,
    /// Its pose in the body's frame.
    pub body_from_mount: Isometry3<f64>,
    /// Source of the pose, for the report.
    pub source: String,
}

/// A load attached to a link for a time.
#[derive(Debug, Clone)]
pub struct Payload {
    /// The body that carries it.
    pub body: usize,
    /// The part of the machine that it is attached to.
    pub group: LinkGroup,
    /// Standard deviation of its mass (kg), where it is stated.
    pub mass_sigma: Option<f64>,
    /// Whether its mass is to be estimated; zero until then.
    pub is_estimated: bool,
    /// Its inertial parameters in the body's frame.
    pub inertia: Inertia,
    /// The same as moments.
    pub(crate) moments: MassMoments,
    /// Times of attachment and release (s after the first sample).
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

    /// The support polygon of the contact points.
    #[must_use]
    pub fn polygon(&self) -> &SupportPolygon {
        &self.polygon
    }

    /// Contact between wheels and ground.
    #[must_use]
    pub fn contact(&self) -> &Contact {
        &self.contact
    }

    /// Pose of the inertial measurement unit.
    #[must_use]
    pub fn imu(&self) -> &Mount {
        &self.imu
    }

    /// Peculiarities that are not errors, as plain sentences.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Pose of the frame in which the tool wrench acts.
    #[must_use]
    pub fn tool(&self) -> Option<&Mount> {
        self.tool.as_ref()
    }

    /// Uncertainty of its parameters.
    #[must_use]
    pub fn uncertainty(&self) -> &UncertaintySpec {
        &self.uncertainty
    }

    /// Limits of plausible signals.
    #[must_use]
    pub fn plausibility(&self) -> &PlausibilitySpec {
        &self.plausibility
    }

    /// Its active suspension.
    #[must_use]
    pub fn suspension(&self) -> Option<&Suspension> {
        self.suspension.as_ref()
    }

    /// The reference loads.
    #[must_use]
    pub fn reference(&self) -> &Reference {
        &self.reference
    }

    /// Whether a measured joint is prismatic (m) and not revolute (rad).
    #[must_use]
    pub fn joint_slides(&self, joint: usize) -> bool {
        let measured_rod = |linkage: &Linkage| {
            linkage.measured_joint == joint && linkage.input == LinkageInput::RodLength
        };
        let driven =
            |body: &Body| body.drive == Drive::Measured(joint) && body.kind == JointKind::Prismatic;
        self.linkages.iter().any(measured_rod) || self.bodies.iter().any(driven)
    }

    /// Removes the tool, for logs without a measured tool wrench.
    pub fn leave_out_tool(&mut self) {
        self.tool = None;
    }

    /// The mount of the arm.
    #[must_use]
    pub fn arm_seat(&self) -> Option<&Seat> {
        self.arm_seat.as_ref()
    }

    /// Loads attached to links.
    #[must_use]
    pub fn payloads(&self) -> &[Payload] {
        &self.payloads
    }

    /// Thresholds for findings.
    #[must_use]
    pub fn limits(&self) -> &LimitsSpec {
        &self.limits
    }

    /// Topics named in the machine file.
    #[must_use]
    pub fn signals(&self) -> &SignalsSpec {
        &self.signals
    }

    /// Settings of the state estimator.
    #[must_use]
    pub fn estimator(&self) -> &EstimatorSpec {
        &self.estimator
    }

    /// Whether `body` is `carrier` or in its distal subtree.
    pub(crate) fn is_carried_by(&self, mut body: usize, carrier: usize) -> bool {
        while body > carrier {
            body = self.bodies[body].parent;
        }
        body == carrier
    }

    /// Mass of all bodies and of the payloads without a time limit (kg).
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
