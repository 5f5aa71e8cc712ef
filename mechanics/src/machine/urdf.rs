//! Parser for the links and joints of a URDF; geometry, colours and simulator extensions are ignored.

use std::cell::RefCell;

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};

use super::inertia::Inertia;
use super::urdf_text::{line_of_macro, readable};
use super::{ImpossibleInertia, MachineError};

/// The types of a joint in the tree; a floating or planar one only says where the machine stands.
pub(super) const JOINT_TYPES: &str = "a joint type of fixed, revolute, continuous, prismatic (floating or planar only \
     between a massless world and the machine)";

/// A URDF as written: lists of links and of the joints between them, not yet a tree.
#[derive(Debug, Clone)]
pub(super) struct Urdf {
    pub(super) file: String,
    pub(super) links: Vec<UrdfLink>,
    pub(super) joints: Vec<UrdfJoint>,
    /// Faults of single elements; [`Tree::build`](super::tree::Tree::build) refuses a URDF with faults, with all of them at once.
    pub(super) faults: Vec<MachineError>,
}

#[derive(Debug, Clone)]
pub(super) struct UrdfLink {
    pub(super) name: String,
    pub(super) line: u32,
    /// Inertia in the link's frame, as stated, be it possible or not; `None` for a massless frame.
    pub(super) inertia: Option<Inertia>,
    /// Whether the link states an inertia without a mass.
    pub(super) lacks_mass: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum UrdfJointKind {
    Fixed,
    Revolute,
    Prismatic,
    /// `floating` or `planar`: where the machine stands in the world.
    Free,
}

#[derive(Debug, Clone)]
pub(super) struct UrdfJoint {
    pub(super) name: String,
    pub(super) line: u32,
    pub(super) kind: UrdfJointKind,
    pub(super) parent: String,
    pub(super) child: String,
    /// Pose of the joint (and of the child link at position zero) in the parent link.
    pub(super) parent_from_joint: Isometry3<f64>,
    /// Unit axis in the joint's frame.
    pub(super) axis: Vector3<f64>,
    /// Lower and upper limit (rad or m); `None` for continuous joints.
    pub(super) limits: Option<[f64; 2]>,
    /// Largest velocity (rad/s or m/s), where a positive one is stated.
    pub(super) max_velocity: Option<f64>,
    pub(super) mimic: Option<Mimic>,
}

/// `position = multiplier * position of joint + offset`.
#[derive(Debug, Clone)]
pub(super) struct Mimic {
    pub(super) joint: String,
    pub(super) multiplier: f64,
    pub(super) offset: f64,
}

impl Urdf {
    /// # Errors
    /// [`MachineError::Urdf`]: the text is not a URDF. What is wrong with its elements is in [`Self::faults`].
    pub(super) fn parse(text: &str, file: &str) -> Result<Self, MachineError> {
        // recognised in the text: a prefix that is not declared would stop the parser first
        if let Some(line) = line_of_macro(text) {
            return Err(is_template(file, line));
        }
        let text = readable(text);
        let document = Document::parse(&text).map_err(|error| not_read(&error, file))?;
        let reader = UrdfParser {
            file,
            document: &document,
            faults: RefCell::default(),
        };
        let robot = document.root_element();
        if robot.tag_name().name() != "robot" {
            return Err(reader.error(
                robot,
                "the element <robot>",
                format!("<{}>", robot.tag_name().name()),
            ));
        }
        // elements with a prefix are extensions of simulators
        let own = |n: &Node<'_, '_>| n.tag_name().namespace() == robot.tag_name().namespace();
        let elements = |tag: &'static str| {
            robot
                .children()
                .filter(move |n| n.has_tag_name(tag) && own(n))
        };
        if let Some(node) = leftover(robot) {
            return Err(is_template(file, reader.line(node)));
        }
        let links = elements("link").filter_map(|n| reader.link(n)).collect();
        let joints = elements("joint").filter_map(|n| reader.joint(n)).collect();
        Ok(Self {
            file: file.into(),
            links,
            joints,
            faults: reader.faults.into_inner(),
        })
    }
}

impl Urdf {
    /// Replaces impossible inertias.
    pub(super) fn replace(&mut self, replaced: &[ImpossibleInertia]) {
        for replacement in replaced {
            let mut links = self.links.iter_mut();
            if let Some(link) = links.find(|link| link.name == replacement.link) {
                link.inertia = Some(replacement.used);
            }
        }
    }
}

/// Returns the error for a text that the XML parser refused. Entities are never expanded: a few lines of them can stand for
/// gigabytes, or for another file.
fn not_read(error: &roxmltree::Error, file: &str) -> MachineError {
    let (expected, found) = match error {
        roxmltree::Error::UnknownEntityReference(name, _) => (
            "XML without entities of its own (only &lt; &gt; &amp; &quot; &apos; are read)",
            format!("&{name}; (write what it stands for in its place)"),
        ),
        _ => ("XML", error.to_string()),
    };
    MachineError::Urdf {
        file: file.into(),
        line: error.pos().row,
        expected: expected.into(),
        found,
    }
}

fn is_template(file: &str, line: u32) -> MachineError {
    MachineError::Urdf {
        file: file.into(),
        line,
        expected: "a URDF".into(),
        found: "a xacro template: expand it with `xacro FILE.xacro > machine.urdf` (ROS package xacro), with the \
                arguments of the machine's launch file, and give machine.urdf (urdf = \"...\" or --urdf)"
            .into(),
    }
}

/// Returns the first element that only a xacro template has: an element of the macro language in its spelling without prefix, or
/// an expression in place of a name or number. Names of mesh files are not read.
fn leftover<'a, 'input>(robot: Node<'a, 'input>) -> Option<Node<'a, 'input>> {
    let is_expression = |text: &str| text.contains("${") || text.contains("$(");
    let mut children = robot.children();
    children.find_map(|child| match child.tag_name().name() {
        "macro" | "include" => Some(child),
        "link" | "joint" => child.descendants().find(|node| {
            let mut attributes = node.attributes();
            attributes.any(|a| a.name() != "filename" && is_expression(a.value()))
        }),
        _ => None,
    })
}

/// Reads elements. Faults are noted, and a neutral value stands in for a faulty one, so that one pass finds everything.
struct UrdfParser<'a> {
    file: &'a str,
    document: &'a Document<'a>,
    faults: RefCell<Vec<MachineError>>,
}

impl UrdfParser<'_> {
    fn line(&self, node: Node<'_, '_>) -> u32 {
        self.document.text_pos_at(node.range().start).row
    }

    fn error(
        &self,
        node: Node<'_, '_>,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> MachineError {
        MachineError::Urdf {
            file: self.file.into(),
            line: self.line(node),
            expected: expected.into(),
            found: found.into(),
        }
    }

    fn note(&self, node: Node<'_, '_>, expected: impl Into<String>, found: impl Into<String>) {
        let fault = self.error(node, expected, found);
        self.faults.borrow_mut().push(fault);
    }

    fn link(&self, node: Node<'_, '_>) -> Option<UrdfLink> {
        let name = self.text(node, "name")?.to_string();
        let inertia = child(node, "inertial").map(|inertial| self.inertial(inertial, &name));
        let lacks_mass = inertia.is_some_and(|i| i.mass == 0.0 && i.about_com != Matrix3::zeros());
        Some(UrdfLink {
            name,
            line: self.line(node),
            inertia: inertia.filter(|inertia| inertia.mass != 0.0),
            lacks_mass,
        })
    }

    fn inertial(&self, node: Node<'_, '_>, link: &str) -> Inertia {
        let link_from_inertial = self.origin(node);
        let mass = match child(node, "mass") {
            Some(mass) => self.number(mass, "value"),
            None => {
                let expected = format!("<mass value=\"...\"/> in <inertial> of link \"{link}\"");
                self.note(node, expected, "none");
                0.0
            }
        };
        if mass < 0.0 {
            let expected = format!(
                "a positive mass of link \"{link}\" (or zero mass with zero inertia: a frame)"
            );
            self.note(node, expected, format!("mass {mass} kg"));
        }
        let tensor = match child(node, "inertia") {
            Some(n) => {
                let get = |name| self.number(n, name);
                let (xy, xz, yz) = (get("ixy"), get("ixz"), get("iyz"));
                Matrix3::new(get("ixx"), xy, xz, xy, get("iyy"), yz, xz, yz, get("izz"))
            }
            None => Matrix3::zeros(),
        };
        let inertia = Inertia {
            mass,
            com: Vector3::zeros(),
            about_com: tensor,
        };
        inertia.transformed(&link_from_inertial)
    }

    fn joint(&self, node: Node<'_, '_>) -> Option<UrdfJoint> {
        let name = self.text(node, "name")?.to_string();
        let kind = match self.text(node, "type")? {
            "fixed" => UrdfJointKind::Fixed,
            "revolute" | "continuous" => UrdfJointKind::Revolute,
            "prismatic" => UrdfJointKind::Prismatic,
            "floating" | "planar" => UrdfJointKind::Free,
            other => {
                let found = format!("\"{other}\" for joint \"{name}\"");
                self.note(node, JOINT_TYPES, found);
                UrdfJointKind::Fixed
            }
        };
        let link_of = |tag: &'static str| match child(node, tag) {
            Some(n) => self.text(n, "link").map(str::to_string),
            None => {
                let expected = format!("<{tag} link=\"...\"/> in joint \"{name}\"");
                self.note(node, expected, "none");
                None
            }
        };
        let moves = matches!(kind, UrdfJointKind::Revolute | UrdfJointKind::Prismatic);
        // what a joint without a coordinate says about its motion means nothing
        let of_motion = |tag| child(node, tag).filter(|_| moves);
        let limits = match of_motion("limit") {
            Some(limit) if node.attribute("type") != Some("continuous") => {
                Some(self.limits(limit, &name))
            }
            _ => None,
        };
        // Irrelevant to the mechanics: an unreadable limit counts as absent.
        let max_velocity = of_motion("limit")
            .and_then(|limit| limit.attribute("velocity"))
            .and_then(|text| text.trim().parse::<f64>().ok())
            .filter(|rate| rate.is_finite() && *rate > 0.0);
        let mimic = of_motion("mimic").and_then(|n| {
            Some(Mimic {
                joint: self.text(n, "joint")?.to_string(),
                multiplier: self.number_or(n, "multiplier", 1.0),
                offset: self.number_or(n, "offset", 0.0),
            })
        });
        let axis = match of_motion("axis") {
            Some(axis) => self.axis(axis, &name),
            None => Vector3::x(),
        };
        let (parent, child) = (link_of("parent"), link_of("child"));
        Some(UrdfJoint {
            kind,
            parent: parent?,
            child: child?,
            parent_from_joint: self.origin(node),
            axis,
            limits,
            max_velocity,
            mimic,
            name,
            line: self.line(node),
        })
    }

    /// Reads the limits of a joint. Notes exchanged ones as a fault: which is meant to be which is not for a reader to guess, as
    /// the joint may count the other way.
    fn limits(&self, limit: Node<'_, '_>, joint: &str) -> [f64; 2] {
        let [lower, upper] = ["lower", "upper"].map(|name| self.number_or(limit, name, 0.0));
        if lower > upper {
            let expected = format!("a lower limit below the upper one for joint \"{joint}\"");
            let found = format!("lower=\"{lower}\" and upper=\"{upper}\"");
            self.note(limit, expected, found);
        }
        [lower, upper]
    }

    fn axis(&self, axis: Node<'_, '_>, joint: &str) -> Vector3<f64> {
        let Some(xyz) = self.triple(axis, "xyz") else {
            return Vector3::x();
        };
        let found = axis.attribute("xyz").unwrap_or_default().trim();
        // a length that overflows is none that can be divided by
        if !xyz.norm().is_finite() {
            let expected = format!("an axis of finite length for joint \"{joint}\"");
            self.note(axis, expected, found);
            return Vector3::x();
        }
        xyz.try_normalize(1e-9).unwrap_or_else(|| {
            let expected = format!("an axis of non-zero length for joint \"{joint}\"");
            self.note(axis, expected, found);
            Vector3::x()
        })
    }

    fn origin(&self, node: Node<'_, '_>) -> Isometry3<f64> {
        let Some(origin) = child(node, "origin") else {
            return Isometry3::identity();
        };
        let read = |attribute: &str| {
            let stated = origin.has_attribute(attribute);
            let triple = stated.then(|| self.triple(origin, attribute));
            triple.flatten().unwrap_or_else(Vector3::zeros)
        };
        let (xyz, rpy) = (read("xyz"), read("rpy"));
        Isometry3::from_parts(
            Translation3::from(xyz),
            UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z),
        )
    }

    fn text<'n>(&self, node: Node<'n, '_>, attribute: &str) -> Option<&'n str> {
        let text = node.attribute(attribute);
        if text.is_none() {
            let tag = node.tag_name().name();
            let expected = format!("<{tag} {attribute}=\"...\">");
            self.note(node, expected, "no such attribute");
        }
        text
    }

    fn number(&self, node: Node<'_, '_>, attribute: &str) -> f64 {
        let text = self.text(node, attribute);
        let number = text.and_then(|text| self.parse_number(node, attribute, text));
        number.unwrap_or(0.0)
    }

    fn number_or(&self, node: Node<'_, '_>, attribute: &str, default: f64) -> f64 {
        let text = node.attribute(attribute);
        let number = text.and_then(|text| self.parse_number(node, attribute, text));
        number.unwrap_or(default)
    }

    fn parse_number(&self, node: Node<'_, '_>, attribute: &str, text: &str) -> Option<f64> {
        let number = text.trim().parse::<f64>().ok();
        let number = number.filter(|value| value.is_finite());
        if number.is_none() {
            let tag = node.tag_name().name();
            let expected = format!("a finite number in {attribute} of <{tag}>");
            self.note(node, expected, format!("\"{text}\""));
        }
        number
    }

    fn triple(&self, node: Node<'_, '_>, attribute: &str) -> Option<Vector3<f64>> {
        let text = self.text(node, attribute)?;
        let parts: Vec<&str> = text.split_whitespace().collect();
        let [x, y, z] = parts[..] else {
            let expected = format!("three numbers in {attribute}");
            self.note(node, expected, format!("\"{text}\""));
            return None;
        };
        let [x, y, z] = [x, y, z].map(|part| self.parse_number(node, attribute, part));
        Some(Vector3::new(x?, y?, z?))
    }
}

fn child<'a, 'input>(node: Node<'a, 'input>, tag: &str) -> Option<Node<'a, 'input>> {
    node.children().find(|n| n.has_tag_name(tag))
}
