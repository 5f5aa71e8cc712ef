//! Parser for the links and joints of a URDF; geometry, colours and simulator extensions are ignored.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};

use super::MachineError;
use super::inertia::Inertia;

/// A URDF as written: lists of links and of the joints between them, not yet a tree.
#[derive(Debug, Clone)]
pub(super) struct Urdf {
    pub(super) file: String,
    pub(super) links: Vec<UrdfLink>,
    pub(super) joints: Vec<UrdfJoint>,
}

#[derive(Debug, Clone)]
pub(super) struct UrdfLink {
    pub(super) name: String,
    /// In the link's frame; `None` for a massless frame.
    pub(super) inertia: Option<Inertia>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum UrdfJointKind {
    Fixed,
    Revolute,
    Prismatic,
}

#[derive(Debug, Clone)]
pub(super) struct UrdfJoint {
    pub(super) name: String,
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
    /// [`MachineError::Urdf`] or [`MachineError::Value`] with the offending line or link.
    pub(super) fn parse(text: &str, file: &str) -> Result<Self, MachineError> {
        // recognised in the text: a prefix that is not declared would stop the parser first
        if let Some(line) = line_of_macro(text) {
            return Err(MachineError::Urdf {
                file: file.into(),
                line,
                expected: "a URDF".into(),
                found: "a xacro template: expand it with `xacro FILE.xacro > machine.urdf` (ROS package xacro), with the \
                        arguments of the machine's launch file, and give machine.urdf (urdf = \"...\" or --urdf)"
                    .into(),
            });
        }
        let document = Document::parse(text).map_err(|e| MachineError::Urdf {
            file: file.into(),
            line: e.pos().row,
            expected: "XML".into(),
            found: e.to_string(),
        })?;
        let reader = UrdfParser {
            file,
            document: &document,
        };
        let robot = document.root_element();
        if robot.tag_name().name() != "robot" {
            return Err(reader.error(
                robot,
                "the element <robot>",
                format!("<{}>", robot.tag_name().name()),
            ));
        }
        let elements = |tag: &'static str| robot.children().filter(move |n| n.has_tag_name(tag));
        let links = elements("link")
            .map(|n| reader.link(n))
            .collect::<Result<Vec<_>, _>>()?;
        let joints = elements("joint")
            .map(|n| reader.joint(n))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            file: file.into(),
            links,
            joints,
        })
    }
}

/// Line of the first element of xacro, the macro language from which URDFs are generated. The declaration of its
/// name space alone remains in a generated URDF.
fn line_of_macro(text: &str) -> Option<u32> {
    let is_macro = |line: &str| line.contains("<xacro:") && !line.trim_start().starts_with("<!--");
    let mut is_comment = false;
    for (index, line) in text.lines().enumerate() {
        if is_comment {
            is_comment = !line.contains("-->");
            continue;
        }
        if is_macro(line) {
            return u32::try_from(index + 1).ok();
        }
        let opened = line.rfind("<!--");
        is_comment = opened.is_some_and(|at| !line[at..].contains("-->"));
    }
    None
}

struct UrdfParser<'a> {
    file: &'a str,
    document: &'a Document<'a>,
}

impl UrdfParser<'_> {
    fn error(
        &self,
        node: Node<'_, '_>,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> MachineError {
        MachineError::Urdf {
            file: self.file.into(),
            line: self.document.text_pos_at(node.range().start).row,
            expected: expected.into(),
            found: found.into(),
        }
    }

    fn link(&self, node: Node<'_, '_>) -> Result<UrdfLink, MachineError> {
        let name = self.text(node, "name")?.to_string();
        let inertia = match child(node, "inertial") {
            Some(inertial) => self.inertial(inertial, &name)?,
            None => None,
        };
        Ok(UrdfLink { name, inertia })
    }

    /// `None` for zero mass and zero inertia: the link is a frame.
    fn inertial(&self, node: Node<'_, '_>, link: &str) -> Result<Option<Inertia>, MachineError> {
        let link_from_inertial = self.origin(node)?;
        let mass = match child(node, "mass") {
            Some(mass) => self.number(mass, "value")?,
            None => {
                return Err(self.error(
                    node,
                    format!("<mass value=\"...\"/> in <inertial> of link \"{link}\""),
                    "none",
                ));
            }
        };
        let tensor = match child(node, "inertia") {
            Some(n) => {
                let get = |name| self.number(n, name);
                let (xy, xz, yz) = (get("ixy")?, get("ixz")?, get("iyz")?);
                Matrix3::new(
                    get("ixx")?,
                    xy,
                    xz,
                    xy,
                    get("iyy")?,
                    yz,
                    xz,
                    yz,
                    get("izz")?,
                )
            }
            None => Matrix3::zeros(),
        };
        if mass == 0.0 && tensor == Matrix3::zeros() {
            return Ok(None);
        }
        let inertia = Inertia {
            mass,
            com: Vector3::zeros(),
            about_com: tensor,
        };
        inertia.check().map_err(|fault| {
            MachineError::value(
                self.file,
                format!("link \"{link}\""),
                fault.expected,
                fault.found,
            )
        })?;
        Ok(Some(inertia.transformed(&link_from_inertial)))
    }

    fn joint(&self, node: Node<'_, '_>) -> Result<UrdfJoint, MachineError> {
        let name = self.text(node, "name")?.to_string();
        let kind = match self.text(node, "type")? {
            "fixed" => UrdfJointKind::Fixed,
            "revolute" | "continuous" => UrdfJointKind::Revolute,
            "prismatic" => UrdfJointKind::Prismatic,
            other => {
                let found = format!("\"{other}\" for joint \"{name}\"");
                return Err(self.error(
                    node,
                    "a joint type of fixed, revolute, continuous, prismatic",
                    found,
                ));
            }
        };
        let link_of = |tag: &'static str| match child(node, tag) {
            Some(n) => self.text(n, "link").map(str::to_string),
            None => Err(self.error(
                node,
                format!("<{tag} link=\"...\"/> in joint \"{name}\""),
                "none",
            )),
        };
        let limits = match child(node, "limit") {
            Some(limit) if node.attribute("type") != Some("continuous") => Some([
                self.number_or(limit, "lower", 0.0)?,
                self.number_or(limit, "upper", 0.0)?,
            ]),
            _ => None,
        };
        // Irrelevant to the mechanics: an unreadable limit counts as absent.
        let max_velocity = child(node, "limit")
            .and_then(|limit| limit.attribute("velocity"))
            .and_then(|text| text.trim().parse::<f64>().ok())
            .filter(|rate| rate.is_finite() && *rate > 0.0);
        let mimic = match child(node, "mimic") {
            Some(n) => Some(Mimic {
                joint: self.text(n, "joint")?.to_string(),
                multiplier: self.number_or(n, "multiplier", 1.0)?,
                offset: self.number_or(n, "offset", 0.0)?,
            }),
            None => None,
        };
        Ok(UrdfJoint {
            kind,
            parent: link_of("parent")?,
            child: link_of("child")?,
            parent_from_joint: self.origin(node)?,
            axis: self.axis(node, &name)?,
            limits,
            max_velocity,
            mimic,
            name,
        })
    }

    fn axis(&self, node: Node<'_, '_>, joint: &str) -> Result<Vector3<f64>, MachineError> {
        let Some(axis) = child(node, "axis") else {
            return Ok(Vector3::x());
        };
        let xyz = self.triple(axis, "xyz")?;
        xyz.try_normalize(1e-9).ok_or_else(|| {
            self.error(
                axis,
                format!("an axis of non-zero length for joint \"{joint}\""),
                "0 0 0",
            )
        })
    }

    fn origin(&self, node: Node<'_, '_>) -> Result<Isometry3<f64>, MachineError> {
        let Some(origin) = child(node, "origin") else {
            return Ok(Isometry3::identity());
        };
        let xyz = if origin.has_attribute("xyz") {
            self.triple(origin, "xyz")?
        } else {
            Vector3::zeros()
        };
        let rpy = if origin.has_attribute("rpy") {
            self.triple(origin, "rpy")?
        } else {
            Vector3::zeros()
        };
        Ok(Isometry3::from_parts(
            Translation3::from(xyz),
            UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z),
        ))
    }

    fn text<'n>(&self, node: Node<'n, '_>, attribute: &str) -> Result<&'n str, MachineError> {
        let tag = node.tag_name().name();
        node.attribute(attribute).ok_or_else(|| {
            self.error(
                node,
                format!("<{tag} {attribute}=\"...\">"),
                "no such attribute",
            )
        })
    }

    fn number(&self, node: Node<'_, '_>, attribute: &str) -> Result<f64, MachineError> {
        let text = self.text(node, attribute)?;
        self.parse_number(node, attribute, text)
    }

    fn number_or(
        &self,
        node: Node<'_, '_>,
        attribute: &str,
        default: f64,
    ) -> Result<f64, MachineError> {
        node.attribute(attribute)
            .map_or(Ok(default), |text| self.parse_number(node, attribute, text))
    }

    fn parse_number(
        &self,
        node: Node<'_, '_>,
        attribute: &str,
        text: &str,
    ) -> Result<f64, MachineError> {
        text.trim()
            .parse::<f64>()
            .ok()
            .filter(|value| value.is_finite())
            .ok_or_else(|| {
                self.error(
                    node,
                    format!("a finite number in {attribute}"),
                    format!("\"{text}\""),
                )
            })
    }

    fn triple(&self, node: Node<'_, '_>, attribute: &str) -> Result<Vector3<f64>, MachineError> {
        let text = self.text(node, attribute)?;
        let numbers = text
            .split_whitespace()
            .map(|t| self.parse_number(node, attribute, t))
            .collect::<Result<Vec<_>, _>>()?;
        match numbers[..] {
            [x, y, z] => Ok(Vector3::new(x, y, z)),
            _ => Err(self.error(
                node,
                format!("three numbers in {attribute}"),
                format!("\"{text}\""),
            )),
        }
    }
}

fn child<'a, 'input>(node: Node<'a, 'input>, tag: &str) -> Option<Node<'a, 'input>> {
    node.children().find(|n| n.has_tag_name(tag))
}
