//! Outline of a URDF without a machine file: links, their tree and their shapes, for guessing which of them
//! are wheels and arm.

use std::collections::HashMap;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use roxmltree::Node;

use super::MachineError;
use super::tree::Tree;
use super::urdf::{Urdf, UrdfJoint, UrdfJointKind};
use super::urdf_text::{by_link, triple};

/// The links of a URDF, parents before children.
#[derive(Debug, Clone)]
pub struct Outline {
    /// The link whose frame is the base frame.
    pub base_link: String,
    /// The links.
    pub links: Vec<OutlineLink>,
}

/// A link and the joint that connects it to its parent.
#[derive(Debug, Clone)]
pub struct OutlineLink {
    /// Its name.
    pub name: String,
    /// Index of the parent link.
    pub parent: Option<usize>,
    /// The joint to the parent; `None` for the root.
    pub joint: Option<OutlineJoint>,
    /// Its pose in the base frame with all joints at zero.
    pub base_from_link: Isometry3<f64>,
    /// Mass (kg); zero for a massless frame.
    pub mass: f64,
    /// Its collision shapes, then its visual ones.
    pub shapes: Vec<Shape>,
}

/// The joint of a link.
#[derive(Debug, Clone)]
pub struct OutlineJoint {
    /// Its name.
    pub name: String,
    /// Type of motion.
    pub motion: JointMotion,
    /// Its axis in the child link.
    pub axis_in_link: Vector3<f64>,
    /// Its axis in the base frame with all joints at zero.
    pub axis_in_base: Vector3<f64>,
    /// Whether the joint is coupled to another joint (`<mimic>`).
    pub mimics: bool,
    /// Smallest and largest position (rad or m), where the URDF states them.
    pub limits: Option<[f64; 2]>,
}

/// Type of a URDF joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointMotion {
    /// No motion.
    Fixed,
    /// Rotation without limits.
    Continuous,
    /// Rotation between limits.
    Revolute,
    /// Translation.
    Prismatic,
}

/// Shape of a link.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A cylinder.
    Cylinder {
        /// Radius (m).
        radius: f64,
        /// Direction of its axis in the link.
        axis_in_link: Vector3<f64>,
    },
    /// A sphere.
    Sphere {
        /// Radius (m).
        radius: f64,
    },
    /// A box, a capsule or another primitive.
    Other,
    /// A mesh file.
    Mesh {
        /// Its name.
        file: String,
        /// Scale factors of its coordinates along the link's axes.
        scale_in_link: [f64; 3],
    },
}

impl Outline {
    /// Reads a URDF; `file` is its name for messages.
    ///
    /// # Errors
    /// The text is not a URDF, or its links do not form a tree.
    pub fn read(text: &str, file: &str) -> Result<Self, MachineError> {
        let urdf = Urdf::parse(text, file)?;
        let tree = Tree::build(&urdf)?;
        let mut shapes = shapes_by_link(text);
        let links = tree.links.iter().map(|link| {
            let base_from_link = tree.bodies[link.body].base_from_body * link.body_from_link;
            let joint = urdf.joints.iter().find(|joint| joint.child == link.name);
            OutlineLink {
                name: link.name.clone(),
                parent: link.parent_link,
                joint: joint.map(|joint| outline_joint(joint, &base_from_link)),
                base_from_link,
                mass: link.inertia.mass,
                shapes: shapes.remove(&link.name).unwrap_or_default(),
            }
        });
        Ok(Self {
            base_link: tree.base_link.clone(),
            links: links.collect(),
        })
    }

    /// Index of the link with this name.
    #[must_use]
    pub fn link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }

    /// Whether a link is `ancestor` or in its distal subtree.
    #[must_use]
    pub fn is_below(&self, link: usize, ancestor: usize) -> bool {
        let parents = std::iter::successors(Some(link), |&at| self.links[at].parent);
        parents.into_iter().any(|at| at == ancestor)
    }
}

impl OutlineLink {
    /// Whether the link's joint can move.
    #[must_use]
    pub fn moves(&self) -> bool {
        let motion = self.joint.as_ref().map(|joint| joint.motion);
        motion.is_some_and(|motion| motion != JointMotion::Fixed)
    }
}

fn outline_joint(joint: &UrdfJoint, base_from_link: &Isometry3<f64>) -> OutlineJoint {
    OutlineJoint {
        name: joint.name.clone(),
        motion: match (joint.kind, joint.limits) {
            (UrdfJointKind::Fixed | UrdfJointKind::Free, _) => JointMotion::Fixed,
            (UrdfJointKind::Prismatic, _) => JointMotion::Prismatic,
            (UrdfJointKind::Revolute, None) => JointMotion::Continuous,
            (UrdfJointKind::Revolute, Some(_)) => JointMotion::Revolute,
        },
        axis_in_link: joint.axis,
        axis_in_base: base_from_link.rotation * joint.axis,
        mimics: joint.mimic.is_some(),
        limits: joint.limits.filter(|[least, greatest]| least < greatest),
    }
}

/// Shapes are only hints, so unreadable ones are ignored.
pub(super) fn shapes_by_link(text: &str) -> HashMap<String, Vec<Shape>> {
    by_link(text, |link| {
        let of = |tag: &'static str| link.children().filter(move |n| n.has_tag_name(tag));
        let shapes = of("collision").chain(of("visual")).filter_map(shape);
        Some(shapes.collect())
    })
}

fn shape(holder: Node<'_, '_>) -> Option<Shape> {
    let child = |node: Node<'_, '_>, tag: &str| {
        let found = node.children().find(|n| n.has_tag_name(tag));
        found.map(|n| n.id())
    };
    let node = |id| holder.document().get_node(id);
    let geometry = node(child(holder, "geometry")?)?;
    let kind = geometry.children().find(Node::is_element)?;
    let radius = || kind.attribute("radius")?.trim().parse::<f64>().ok();
    let turn = child(holder, "origin").and_then(node).and_then(rotation);
    let turn = turn.unwrap_or_else(UnitQuaternion::identity);
    Some(match kind.tag_name().name() {
        "cylinder" => Shape::Cylinder {
            radius: radius()?,
            axis_in_link: turn * Vector3::z(),
        },
        "sphere" => Shape::Sphere { radius: radius()? },
        "mesh" => Shape::Mesh {
            file: kind.attribute("filename").unwrap_or_default().into(),
            scale_in_link: scale_in_link(kind.attribute("scale"), &turn),
        },
        _ => Shape::Other,
    })
}

fn rotation(origin: Node<'_, '_>) -> Option<UnitQuaternion<f64>> {
    let [roll, pitch, yaw] = triple(origin.attribute("rpy")?)?;
    Some(UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}

/// Returns, for each axis of the link, the scale along the mesh axis closest to it.
fn scale_in_link(scale: Option<&str>, turn: &UnitQuaternion<f64>) -> [f64; 3] {
    let scale = scale.and_then(triple).unwrap_or([1.0; 3]);
    let of_axis = |axis: Vector3<f64>| scale[turn.inverse_transform_vector(&axis).iamax()];
    [Vector3::x(), Vector3::y(), Vector3::z()].map(of_axis)
}
