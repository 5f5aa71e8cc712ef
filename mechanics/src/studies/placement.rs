//! Positions of the parts of a machine in one state, as a drawing needs them.

use nalgebra::{Vector2, Vector3};

use crate::evaluate::evaluation::evaluate;
use crate::evaluate::scope::Scope;
use crate::evaluate::workspace::Workspace;
use crate::geometry::spatial::rotate;
use crate::machine::{JointKind, LinkGroup, Machine};
use crate::state::State;
use crate::wheel_loads::TippingLine;

/// Positions of a machine's parts in the base frame, updated state by state.
#[derive(Debug)]
pub struct Placement<'a> {
    machine: &'a Machine,
    workspace: Workspace<f64>,
    arm: Vec<[ArmPoint; 2]>,
    /// Unit normal of the contact plane, pointing up.
    pub normal: Vector3<f64>,
    /// Unit vector in the contact plane: the base's x axis projected onto it.
    pub forward: Vector3<f64>,
    /// Unit vector in the contact plane, to the left.
    pub left: Vector3<f64>,
    /// Contact point of each wheel (m).
    pub contacts: Vec<Vector3<f64>>,
    /// The arm as a stick figure: line segments as start and end (m).
    pub arm_segments: Vec<[Vector3<f64>; 2]>,
    /// Centre of mass of the machine, payloads without a time limit included (m).
    pub centre_of_mass: Vector3<f64>,
    /// Angular velocity of the base, in base axes (rad/s).
    pub angular_velocity: Vector3<f64>,
}

/// A point fixed to a body.
#[derive(Debug, Clone, Copy)]
struct ArmPoint {
    body: usize,
    in_body: Vector3<f64>,
}

impl<'a> Placement<'a> {
    /// A placement before its first state: every position is NaN.
    #[must_use]
    pub fn new(machine: &'a Machine) -> Self {
        let unknown = Vector3::repeat(f64::NAN);
        let arm = arm_points(machine);
        Self {
            workspace: Workspace::with_scope(machine, Scope::LOADS),
            normal: unknown,
            forward: unknown,
            left: unknown,
            contacts: vec![unknown; machine.wheels().len()],
            arm_segments: vec![[unknown; 2]; arm.len()],
            arm,
            centre_of_mass: unknown,
            angular_velocity: unknown,
            machine,
        }
    }

    /// Computes all positions in `state`. A position is NaN where an input is unknown or a linkage cannot
    /// close.
    pub fn place(&mut self, state: &State<f64>) {
        let outcome = evaluate(self.machine, state, &mut self.workspace);
        self.normal = outcome.contact_normal;
        // forward = (x - (x . n) n) / |x - (x . n) n|, the same as in the indicators
        let along = Vector3::x() - self.normal * self.normal.x;
        self.forward = along / along.norm();
        self.left = self.normal.cross(&self.forward);
        let workspace = &self.workspace;
        let wheels = workspace.wheel_centres.iter().zip(&workspace.radii);
        for (contact, (centre, radius)) in self.contacts.iter_mut().zip(wheels) {
            *contact = centre - self.normal * *radius;
        }
        let at = |body: usize, point: &Vector3<f64>| {
            let motion = &workspace.motions[body];
            motion.origin + rotate(&motion.rotation, point)
        };
        for (segment, points) in self.arm_segments.iter_mut().zip(&self.arm) {
            *segment = points.map(|point| at(point.body, &point.in_body));
        }
        let links = self.machine.links().iter().map(|l| (l.body, &l.inertia));
        let payloads = self.machine.payloads().iter();
        let payloads = payloads.filter(|p| p.is_always());
        let masses = links.chain(payloads.map(|p| (p.body, &p.inertia)));
        let (mass, first) =
            masses.fold((0.0, Vector3::zeros()), |(mass, first), (body, inertia)| {
                let moment = at(body, &inertia.com) * inertia.mass;
                match inertia.mass > 0.0 {
                    true => (mass + inertia.mass, first + moment),
                    false => (mass, first),
                }
            });
        self.centre_of_mass = first / mass;
        self.angular_velocity = workspace.motions[0].angular_velocity;
    }

    /// A point that is fixed to a body, in the base frame (m).
    #[must_use]
    pub fn point(&self, body: usize, in_body: &Vector3<f64>) -> Vector3<f64> {
        self.workspace.motions[body].point(in_body)
    }

    /// The line about which the machine tips over an edge of its polygon: its edge, or to the pivot of an axle astride it.
    #[must_use]
    pub fn tipping_line(&self, edge: usize) -> TippingLine<f64> {
        if let Some(line) = self.workspace.tipping_lines.get(edge) {
            return *line;
        }
        let edge = &self.machine.polygon().edges()[edge];
        let through = [edge.from, edge.to].map(|wheel| self.contacts[wheel]);
        TippingLine {
            on_ground: through.map(|at| self.on_plane(&at)),
            through,
        }
    }

    /// Coordinates of a point of the base frame along the axes of `zmp_x` and `zmp_y`: forward and left in
    /// the contact plane, relative to the projected base origin (m).
    #[must_use]
    pub fn on_plane(&self, point: &Vector3<f64>) -> Vector2<f64> {
        Vector2::new(self.forward.dot(point), self.left.dot(point))
    }

    /// The point of the contact plane with these coordinates, in the base frame (m).
    #[must_use]
    pub fn from_plane(&self, coordinates: &Vector2<f64>) -> Vector3<f64> {
        let count = self.contacts.len() as f64;
        let height = self
            .contacts
            .iter()
            .map(|c| self.normal.dot(c))
            .sum::<f64>()
            / count;
        self.forward * coordinates.x + self.left * coordinates.y + self.normal * height
    }
}

/// Segments from each arm body's joint to the joint of the next body, and on to the tool. What slides along the platform, such as the fork
/// of a lift truck, hangs on its mast, and that on the platform.
fn arm_points(machine: &Machine) -> Vec<[ArmPoint; 2]> {
    let of_arm: Vec<bool> = (0..machine.bodies().len())
        .map(|body| {
            let mut links = machine.links().iter();
            body > 0 && links.any(|link| link.body == body && link.group == LinkGroup::Arm)
        })
        .collect();
    let origin = |body: usize| ArmPoint {
        body,
        in_body: Vector3::zeros(),
    };
    let mut segments: Vec<[ArmPoint; 2]> = Vec::new();
    let bodies = machine.bodies().iter().enumerate().skip(1);
    for (index, body) in bodies.filter(|(index, _)| of_arm[*index]) {
        if of_arm[body.parent] {
            segments.push([origin(body.parent), origin(index)]);
        } else if body.kind == JointKind::Prismatic {
            let foot = ArmPoint {
                body: body.parent,
                in_body: body.joint_in_parent,
            };
            segments.extend([[origin(body.parent), foot], [foot, origin(index)]]);
        }
    }
    // The last body of a branch ends at its farthest link frame, or at its centre of mass.
    for (body, _) in of_arm.iter().enumerate().filter(|(_, is_arm)| **is_arm) {
        let carries = machine.bodies().iter().enumerate().skip(1);
        if carries
            .into_iter()
            .any(|(i, b)| i != body && b.parent == body && of_arm[i])
        {
            continue;
        }
        let links = machine.links().iter().filter(|link| link.body == body);
        let places = links.flat_map(|link| {
            let com = Some(link.inertia.com).filter(|_| link.inertia.mass > 0.0);
            [Some(link.body_from_link.translation.vector), com]
        });
        let farthest = places
            .flatten()
            .max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
        if let Some(in_body) = farthest.filter(|place| place.norm() > 0.0) {
            segments.push([origin(body), ArmPoint { body, in_body }]);
        }
    }
    segments
}
