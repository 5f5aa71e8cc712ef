//! The bodies of a machine, the links that they are made of, and what is fixed to them.

use std::fmt;

use nalgebra::{Isometry3, Matrix3, Vector3};
use tipwatch_language::{say, word};

use super::inertia::{Inertia, MassMoments};
use super::link_sigma::LinkSigma;
use super::payload_signal::Lift;
use super::spec::MassSignal;

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
    pub coupling: JointCoupling,
    /// Orientation of the joint in the parent body.
    pub parent_from_joint: Matrix3<f64>,
    /// Position of the joint in the parent body (m).
    pub joint_in_parent: Vector3<f64>,
    /// Inertial parameters in the body's frame.
    pub inertia: Inertia,
    /// Moments of that inertia, by the groups of its links; groups without mass are omitted.
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
pub enum JointCoupling {
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
    /// Moments of that inertia.
    pub moments: MassMoments,
    /// The part of the machine that it belongs to.
    pub group: LinkGroup,
    /// Uncertainty of the link, where the machine file states it.
    pub sigma: LinkSigma,
    /// Standard deviation of each element of its inertia (kg m^2), where an impossible one was replaced.
    pub inertia_sigma: Option<f64>,
}

/// A joint whose position is logged.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredJoint {
    /// Name in the URDF and in the log.
    pub name: String,
    /// Whether the log contains the joint's position. Only a wheel's spin joint and a joint with a constant position may be
    /// missing.
    pub logged: bool,
    /// Its position from the machine file (rad or m), where the log does not contain it.
    pub constant: Option<f64>,
    /// Standard deviation of its position (rad or m) where that is only assumed.
    pub position_sigma: Option<f64>,
    /// The wheel that it spins, if any.
    pub spins_wheel: Option<usize>,
    /// Smallest and largest position (rad or m), where the URDF states them.
    pub limits: Option<[f64; 2]>,
    /// Largest velocity (rad/s or m/s), where the URDF states it.
    pub max_velocity: Option<f64>,
}

/// The mount of a part on another body: the reference for its position.
#[derive(Debug, Clone, Copy)]
pub struct Mounting {
    /// Index of the body that carries the part.
    pub carrier: usize,
    /// Axes of its position, those of the carrying link, in the carrier's frame.
    pub carrier_from_axes: Matrix3<f64>,
}

/// A frame fixed to a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Mount {
    /// The body.
    pub body: usize,
    /// Its pose in the body's frame.
    pub body_from_mount: Isometry3<f64>,
    /// Source of the mount's pose.
    pub source: MountSource,
}

/// Source of the pose of a mount. Shown as it stands in reports.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MountSource {
    /// The machine file.
    MachineFile,
    /// A link of the URDF with the name that the messages of the sensor give as their frame.
    MessageFrame {
        /// The frame.
        frame: String,
    },
    /// A static transform of the log.
    StaticTransform {
        /// The frame of the messages.
        frame: String,
        /// The link of the URDF that it is placed in.
        parent: String,
    },
    /// Nothing says where it is: at the base.
    Assumed {
        /// The base link.
        base: String,
        /// The frame of the messages, which is nowhere known, if they have one.
        frame: Option<String>,
    },
    /// There is no sensor: its measurement is computed at the base origin.
    NoSensor,
    /// The base frame, to which motion or wrench was moved.
    Base,
}

impl fmt::Display for MountSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&match self {
            Self::MachineFile => word!("the pose in the machine file").to_owned(),
            Self::MessageFrame { frame } => {
                say!("link \"{frame}\" of the URDF, the frame of the IMU's messages")
            }
            Self::StaticTransform { frame, parent } => {
                say!("/tf_static of the log: frame \"{frame}\" in link \"{parent}\"")
            }
            Self::Assumed { base, frame: None } => say!("assumed at {base}"),
            Self::Assumed {
                base,
                frame: Some(frame),
            } => say!(
                "assumed at {base}: neither the URDF nor /tf_static of the log contains \"{frame}\", the frame of the IMU's messages"
            ),
            Self::NoSensor => word!("no IMU: computed at the base origin from odometry").to_owned(),
            Self::Base => word!("the base frame").to_owned(),
        })
    }
}

impl Mount {
    /// Orientation in its body: turns vectors of the mount's frame into the body's.
    #[must_use]
    pub fn rotation_in_body(&self) -> Matrix3<f64> {
        *self.body_from_mount.rotation.to_rotation_matrix().matrix()
    }
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
    /// Whether the payload's mass is to be estimated; zero until then.
    pub is_estimated: bool,
    /// Its inertial parameters in the body's frame.
    pub inertia: Inertia,
    /// Moments of that inertia.
    pub moments: MassMoments,
    /// Whether the payload's mass is known row by row. Its inertia is then that of a kilogram, and its share in a state is its
    /// mass (kg).
    pub is_by_row: bool,
    /// The signal that states its mass.
    pub signal: Option<MassSignal>,
    /// The actuator by whose force its mass is estimated.
    pub lift: Option<Lift>,
    /// Times of attachment and release (s after the first sample).
    pub window_s: [f64; 2],
}

impl Payload {
    /// Whether the payload's mass is estimated row by row: the state then holds its standard deviation.
    #[must_use]
    pub fn is_weighed(&self) -> bool {
        self.is_by_row && self.is_estimated
    }

    /// Whether the payload is attached all the time, with a mass that is known beforehand.
    #[must_use]
    pub fn is_always(&self) -> bool {
        !self.is_by_row && self.window_s.iter().all(|time| time.is_infinite())
    }
}

/// Moments of a body's links, by group.
pub(super) fn link_parts(links: &[Link], body: usize) -> Vec<(LinkGroup, MassMoments)> {
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
