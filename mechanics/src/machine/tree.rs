//! Builds a tree of rigid bodies from the links and joints of a URDF: links connected by fixed joints are
//! merged, and every body's z axis is aligned with its joint axis.

use std::collections::HashMap;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::body::JointKind;
use super::error::MachineError;
use super::inertia::Inertia;
use super::structure::Structure;
use super::urdf::{Mimic, Urdf, UrdfJoint, UrdfJointKind};

/// A tree of bodies, before the sources of its joints' motion are known.
#[derive(Debug)]
pub(super) struct Tree {
    pub(super) base_link: String,
    pub(super) bodies: Vec<TreeBody>,
    pub(super) links: Vec<TreeLink>,
}

#[derive(Debug)]
pub(super) struct TreeBody {
    pub(super) link: String,
    pub(super) parent: usize,
    /// Name and properties of its joint; `None` for the root.
    pub(super) joint: Option<TreeJoint>,
    /// Pose of the joint in the parent body, z along the axis.
    pub(super) parent_from_joint: Isometry3<f64>,
    /// Pose in the base frame with all joints at zero.
    pub(super) base_from_body: Isometry3<f64>,
    pub(super) inertia: Inertia,
}

#[derive(Debug)]
pub(super) struct TreeJoint {
    pub(super) name: String,
    pub(super) kind: JointKind,
    pub(super) limits: Option<[f64; 2]>,
    pub(super) max_velocity: Option<f64>,
    pub(super) mimic: Option<Mimic>,
}

impl TreeJoint {
    /// Its limits; equal ones mean that the URDF states none.
    pub(super) fn stated_limits(&self) -> Option<[f64; 2]> {
        self.limits.filter(|[least, greatest]| least < greatest)
    }
}

#[derive(Debug)]
pub(super) struct TreeLink {
    pub(super) name: String,
    pub(super) parent_link: Option<usize>,
    pub(super) body: usize,
    pub(super) body_from_link: Isometry3<f64>,
    pub(super) inertia: Inertia,
}

impl Tree {
    /// # Errors
    /// Everything that is wrong with the URDF at once: faults of its elements, duplicate links or joints, a joint between
    /// links that do not exist, no root or several roots, cycles.
    pub(super) fn build(urdf: &Urdf) -> Result<Self, MachineError> {
        let mut structure = Structure::of(urdf);
        let root = structure.root();
        let resting = structure.resting();
        structure.faults.splice(0..0, urdf.faults.iter().cloned());
        if let Some(error) = MachineError::all(&urdf.file, structure.faults) {
            return Err(error);
        }
        let mut grower = Grower {
            urdf,
            resting: &resting,
            link_index: &structure.link_index,
            children: &structure.children,
            bodies: Vec::new(),
            links: Vec::new(),
        };
        grower.grow(root.unwrap_or_default());
        let (bodies, links) = (grower.bodies, grower.links);
        Ok(Self {
            base_link: links[0].name.clone(),
            bodies,
            links,
        }
        .rebased(machine_in_world(urdf)))
    }

    /// Moves the base frame to the link `base_link`, if it is rigidly connected to the root; else from the world to the
    /// machine in it.
    fn rebased(mut self, in_world: Option<&str>) -> Self {
        let of_root = |name: &str| self.links.iter().find(|l| l.name == name && l.body == 0);
        let Some(base) = of_root("base_link").or_else(|| of_root(in_world?)) else {
            return self;
        };
        let base_from_root = base.body_from_link.inverse();
        self.base_link = base.name.clone();
        self.bodies[0].inertia = self.bodies[0].inertia.transformed(&base_from_root);
        for link in self.links.iter_mut().filter(|l| l.body == 0) {
            link.body_from_link = base_from_root * link.body_from_link;
            link.inertia = link.inertia.transformed(&base_from_root);
        }
        for body in &mut self.bodies[1..] {
            body.base_from_body = base_from_root * body.base_from_body;
            if body.parent == 0 {
                body.parent_from_joint = base_from_root * body.parent_from_joint;
            }
        }
        self
    }

    pub(super) fn link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|l| l.name == name)
    }

    /// Index of the body moved by the joint with this name.
    pub(super) fn body_of_joint(&self, name: &str) -> Option<usize> {
        self.bodies
            .iter()
            .position(|b| b.joint.as_ref().is_some_and(|j| j.name == name))
    }

    /// Whether `body` is `ancestor` or in its distal subtree.
    pub(super) fn is_carried_by(&self, mut body: usize, ancestor: usize) -> bool {
        while body > ancestor {
            body = self.bodies[body].parent;
        }
        body == ancestor
    }

    /// Whether `link` is `ancestor` or in its distal subtree.
    pub(super) fn link_is_below(&self, mut link: usize, ancestor: usize) -> bool {
        loop {
            if link == ancestor {
                return true;
            }
            match self.links[link].parent_link {
                Some(parent) => link = parent,
                None => return false,
            }
        }
    }
}

/// Motion of a joint along or about its axis.
fn displaced(kind: UrdfJointKind, axis: &Vector3<f64>, position: f64) -> Isometry3<f64> {
    match kind {
        UrdfJointKind::Prismatic => {
            Isometry3::translation(axis.x * position, axis.y * position, axis.z * position)
        }
        _ => Isometry3::from_parts(
            Translation3::identity(),
            UnitQuaternion::from_scaled_axis(axis * position),
        ),
    }
}

/// The machine's first link where a floating or planar joint connects it to a world.
fn machine_in_world(urdf: &Urdf) -> Option<&str> {
    let mut joints = urdf.joints.iter();
    let free = joints.find(|joint| joint.kind == UrdfJointKind::Free)?;
    Some(&free.child)
}

struct Grower<'a> {
    urdf: &'a Urdf,
    /// Positions of the joints that follow a joint that cannot move.
    resting: &'a HashMap<&'a str, f64>,
    link_index: &'a HashMap<&'a str, usize>,
    children: &'a [Vec<&'a UrdfJoint>],
    bodies: Vec<TreeBody>,
    links: Vec<TreeLink>,
}

impl Grower<'_> {
    /// Walks the tree from the root without recursion (a URDF may nest arbitrarily deep).
    fn grow(&mut self, root: usize) {
        let identity = Isometry3::identity();
        self.bodies.push(TreeBody {
            link: self.urdf.links[root].name.clone(),
            parent: 0,
            joint: None,
            parent_from_joint: identity,
            base_from_body: identity,
            inertia: Inertia::zero(),
        });
        let mut pending = vec![(root, None, 0, identity)];
        while let Some((urdf_link, parent_link, body, body_from_link)) = pending.pop() {
            let link = self.add_link(urdf_link, parent_link, body, body_from_link);
            for &joint in self.children[urdf_link].iter().rev() {
                let child = self.link_index[joint.child.as_str()];
                let body_from_joint = body_from_link * joint.parent_from_joint;
                let rests_at = self.resting.get(joint.name.as_str());
                let (child_body, child_pose) = match (joint.kind, rests_at) {
                    (UrdfJointKind::Fixed | UrdfJointKind::Free, _) => (body, body_from_joint),
                    (kind, Some(&position)) => (
                        body,
                        body_from_joint * displaced(kind, &joint.axis, position),
                    ),
                    (UrdfJointKind::Revolute, None) => {
                        self.add_body(joint, JointKind::Revolute, body, body_from_joint)
                    }
                    (UrdfJointKind::Prismatic, None) => {
                        self.add_body(joint, JointKind::Prismatic, body, body_from_joint)
                    }
                };
                pending.push((child, Some(link), child_body, child_pose));
            }
        }
    }

    fn add_link(
        &mut self,
        urdf_link: usize,
        parent_link: Option<usize>,
        body: usize,
        body_from_link: Isometry3<f64>,
    ) -> usize {
        let source = &self.urdf.links[urdf_link];
        let inertia = source
            .inertia
            .map_or(Inertia::zero(), |i| i.transformed(&body_from_link));
        self.bodies[body].inertia = self.bodies[body].inertia.welded(&inertia);
        self.links.push(TreeLink {
            name: source.name.clone(),
            parent_link,
            body,
            body_from_link,
            inertia,
        });
        self.links.len() - 1
    }

    /// Adds the body moved by `joint`, its z axis along the joint axis; returns its index and the pose of the
    /// joint's own frame in it.
    fn add_body(
        &mut self,
        joint: &UrdfJoint,
        kind: JointKind,
        parent: usize,
        body_from_joint: Isometry3<f64>,
    ) -> (usize, Isometry3<f64>) {
        let joint_from_aligned = z_turned_to(&joint.axis);
        let parent_from_joint = body_from_joint * joint_from_aligned;
        self.bodies.push(TreeBody {
            link: joint.child.clone(),
            parent,
            joint: Some(TreeJoint {
                name: joint.name.clone(),
                kind,
                limits: joint.limits,
                max_velocity: joint.max_velocity,
                mimic: joint.mimic.clone(),
            }),
            parent_from_joint,
            base_from_body: self.bodies[parent].base_from_body * parent_from_joint,
            inertia: Inertia::zero(),
        });
        (self.bodies.len() - 1, joint_from_aligned.inverse())
    }
}

/// A rotation that maps z to `axis`: exactly the identity for +z, exactly a half turn about x for -z.
fn z_turned_to(axis: &Vector3<f64>) -> Isometry3<f64> {
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let rotation = UnitQuaternion::rotation_between(&Vector3::z(), axis).unwrap_or(half_turn);
    Isometry3::from_parts(Translation3::identity(), rotation)
}
