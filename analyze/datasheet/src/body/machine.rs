//! A machine as bodies, before it is written as URDF and machine file.

use crate::prior::{Assumption, Template};
use crate::sheet::Switch;

/// A machine from a sheet. The base frame is on the ground in the middle between first and last axle: x forward,
/// y to the left, z up.
#[derive(Debug, Clone)]
pub struct Machine {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub template: Template,
    /// Sources of the numbers.
    pub sources: Vec<String>,
    /// The links, parents before children; the first is the base.
    pub links: Vec<Link>,
    /// The wheels, or the points of the tracks.
    pub wheels: Vec<Wheel>,
    /// Assumptions made where the sheet says nothing.
    pub assumptions: Vec<Assumption>,
    /// Remarks on the numbers, for the reader.
    pub notes: Vec<String>,
    /// Operating mass (kg): the sum of the axle loads where the sheet states them.
    pub mass: f64,
    /// Largest horizontal distance of the arm's tip from the slew's axis, or from the front axle (m).
    pub reach: f64,
    /// Centre of mass of the whole machine in the posture of the sheet (m).
    pub centre_of_mass: [f64; 3],
    pub(crate) axles: Vec<AxleGroup>,
    pub(crate) free_joints: Vec<String>,
    pub(crate) linkages: Vec<Linkage>,
    pub(crate) arm_root: String,
    pub(crate) tool: Option<String>,
    pub(crate) outriggers: Vec<Outrigger>,
    pub(crate) has_tracks: bool,
    pub(crate) rated_load: Option<(f64, f64)>,
    /// Overall height (m).
    pub(crate) height: f64,
    /// Links whose masses the weights determine, with the middle of where their mass may be (m, base frame).
    pub(crate) unknown: Vec<(usize, [f64; 3])>,
    /// Place of the slew, if any (m).
    pub(crate) slew_x: Option<f64>,
    /// Standard deviation of the height of the centre of mass (m).
    pub(crate) height_sigma: f64,
}

/// An outrigger, with the sole of its pad on the ground.
#[derive(Debug, Clone)]
pub(crate) struct Outrigger {
    /// Its link.
    pub(crate) link: String,
    /// Place (m).
    pub(crate) x: f64,
    /// Time in which the outrigger stands on the ground; `None` if the sheet does not state it.
    pub(crate) set: Option<PadSet>,
}

/// Time in which a pad stands on the ground.
#[derive(Debug, Clone)]
pub(crate) enum PadSet {
    Always(bool),
    While(Switch),
}

impl Outrigger {
    /// Its name as a support of the machine file.
    pub(crate) fn support(&self) -> String {
        self.link.to_uppercase()
    }

    /// Whether the pad stands on the ground at some time.
    pub(crate) fn may_be_set(&self) -> bool {
        self.set
            .as_ref()
            .is_some_and(|set| !matches!(set, PadSet::Always(false)))
    }
}

/// A rigid body and the joint that holds it.
#[derive(Debug, Clone)]
pub struct Link {
    /// Its name.
    pub name: String,
    /// The joint to its parent; `None` for the base.
    pub joint: Option<Joint>,
    /// Mass (kg).
    pub mass: f64,
    /// Centre of mass (m).
    pub com: [f64; 3],
    /// Inertia about the centre of mass: xx, yy, zz; the products are zero (kg m^2).
    pub inertia: [f64; 3],
    /// Standard deviation of the mass (kg).
    pub mass_sigma: f64,
    /// Standard deviation of the centre of mass along each axis (m).
    pub com_sigma: [f64; 3],
    /// Length, width and height of the box that its mass fills (m).
    pub extent: [f64; 3],
    /// Its shapes.
    pub shapes: Vec<Shape>,
}

/// Motion of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// No motion.
    Fixed,
    /// Rotation within limits.
    Revolute,
    /// Rotation without limits.
    Continuous,
    /// Translation.
    Prismatic,
}

/// Function of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    Fixed,
    /// Slew and arm: its position is measured.
    Arm,
    /// The frame joint: its position is measured.
    Articulation,
    /// A joint that seldom matters: zero if nobody measures it.
    Steering,
    /// Bogies, pendulum axles, frame roll joints.
    Passive,
    Wheel,
    /// A joint that follows another one.
    Follows,
}

/// A joint.
#[derive(Debug, Clone)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// Motion of the joint.
    pub kind: JointKind,
    /// Index of the parent link.
    pub parent: usize,
    /// Position in the parent (m).
    pub xyz: [f64; 3],
    /// Rotation in the parent about its y axis (rad).
    pub pitch: f64,
    /// Its axis.
    pub axis: [f64; 3],
    /// Limits (rad or m).
    pub limits: Option<[f64; 2]>,
    /// Joint that this joint follows, and the factor.
    pub mimic: Option<(String, f64)>,
    /// Its position in the posture of the sheet (rad or m).
    pub at: f64,
    pub(crate) role: Role,
}

/// A shape of a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Solid of the shape.
    pub solid: Solid,
    /// Its middle in the link (m).
    pub xyz: [f64; 3],
    /// Its colour: red, green, blue, 0 to 1.
    pub colour: [f64; 3],
}

/// A solid with axes of the link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Solid {
    /// Length along x, y, z (m).
    Box([f64; 3]),
    /// A cylinder about the link's y axis.
    CylinderY {
        /// Radius (m).
        radius: f64,
        /// Length (m).
        length: f64,
    },
}

/// A wheel, or a point of a track.
#[derive(Debug, Clone, PartialEq)]
pub struct Wheel {
    /// Its name.
    pub name: String,
    /// Index of its link.
    pub link: usize,
    /// Its middle in that link (m): zero for wheels.
    pub place: [f64; 3],
    /// Radius; zero for a point of a track (m).
    pub radius: f64,
    /// Vertical stiffness (N/m).
    pub stiffness: f64,
    /// Index of its axle.
    pub axle: usize,
    /// Possible deviation of the radius, as a share, where only the designation of the tyre determines the radius.
    pub guess_band: Option<f64>,
}

/// An axle, or a pair of bogies.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AxleGroup {
    /// Place (m).
    pub(crate) x: f64,
    /// Load (kg); assumed where the sheet states none.
    pub(crate) load: Option<f64>,
    pub(crate) is_stated: bool,
}

/// A cylinder that turns a segment.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Linkage {
    pub(crate) name: String,
    pub(crate) pivot: String,
    pub(crate) cylinder: String,
    pub(crate) rod: String,
    pub(crate) rod_link: String,
    pub(crate) rod_end: [f64; 3],
    pub(crate) pivot_link: String,
    pub(crate) anchor: [f64; 3],
    pub(crate) piston_area: f64,
    pub(crate) rod_area: f64,
}

impl Machine {
    /// Index of a link.
    #[must_use]
    pub fn link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }

    /// Axle loads of the sheet (kg), front to rear; `None` where it states none.
    #[must_use]
    pub fn stated_axle_loads(&self) -> Option<Vec<f64>> {
        let load = |axle: &AxleGroup| axle.load.filter(|_| axle.is_stated);
        let loads: Option<Vec<f64>> = self.axles.iter().map(load).collect();
        loads.filter(|loads| !loads.is_empty())
    }

    /// The link that carries the load, if there is a tool.
    #[must_use]
    pub fn tool(&self) -> Option<&str> {
        self.tool.as_deref()
    }

    /// Joints whose position the machine file states as a constant.
    #[must_use]
    pub fn constant_joints(&self) -> Vec<String> {
        let joints = self.links.iter().filter_map(|link| link.joint.as_ref());
        let is_constant = |joint: &&Joint| matches!(joint.role, Role::Passive | Role::Steering);
        joints
            .filter(is_constant)
            .map(|joint| joint.name.clone())
            .collect()
    }

    /// Joints with their positions in the posture of the sheet that differ from zero (rad or m).
    #[must_use]
    pub fn posture(&self) -> Vec<(String, f64)> {
        let joints = self.links.iter().filter_map(|link| link.joint.as_ref());
        let is_input = |joint: &&Joint| {
            joint.at != 0.0 && matches!(joint.role, Role::Arm | Role::Articulation)
        };
        joints
            .filter(is_input)
            .map(|joint| (joint.name.clone(), joint.at))
            .collect()
    }
}
