//! The bodies of a machine, the links that they are made of, and what is fixed to them.

use nalgebra::{Isometry3, Matrix3, Vector3};

use super::inertia::{Inertia, MassMoments};

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

/// Where a part of the machine sits on another: what its position is measured in.
#[derive(Debug, Clone, Copy)]
pub struct Seat {
    /// The body that carries the part.
    pub carrier: usize,
    /// Axes in which the position is given, those of the link that carries it, in the carrier's frame.
    pub carrier_from_axes: Matrix3<f64>,
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

/// The moments of a body's links, by group.
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
