//! Checks the mounting of the IMU (inertial measurement unit). At rest the specific force points up. If
//! it is far from the normal of the contact plane, the mounting is wrong or the slope extreme. The
//! finding is reported, never corrected: gravity does not determine the rotation about the vertical.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::{Machine, Note, NoteKind};
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::{BatchWorkspace, Model, Scope, State, StateColumns, ground_forces};

use super::notes::{NotedLog, Notes};
use super::study::{KnownRow, StudiedLog, Study};
use crate::base::rows::Rows;

/// Larger than the slopes on which such machines work (degrees).
const SUSPICIOUS_DEG: f64 = 20.0;
/// Largest angular velocity of a steady row (rad/s).
const STEADY_RAD_S: f64 = 0.05;
/// Largest relative deviation of the specific force from gravity in a steady row.
const STEADY_SHARE: f64 = 0.05;
/// Fewest steady rows for a finding.
const FEWEST_ROWS: usize = 10;
/// Most steady rows that are used, evenly spread: their mean is compared with tens of degrees.
const MOST_ROWS: usize = 256;
/// Rows that are evaluated at once.
const ROWS_AT_ONCE: usize = 64;

/// Directions of the specific force in steady rows, evenly spread.
#[derive(Debug)]
pub(crate) struct MountingCheck {
    workspace: BatchWorkspace,
    /// Number of steady rows so far.
    steady: usize,
    /// Steady rows from one that is used to the next, as a power of two.
    step: u32,
    /// Direction of each used steady row, in axes forward, left and normal to the contact plane; `None` where it is unknown.
    directions: Vec<Option<Vector3<f64>>>,
    /// States of the next ones, the first `waiting` rows: several are evaluated at once.
    states: StateColumns,
    waiting: usize,
}

impl Study<'_> for MountingCheck {
    type Found = Self;

    fn begin(log: &StudiedLog<'_>) -> Self {
        let (machine, model) = (log.machine, Arc::new(Model::WholeBody));
        Self {
            workspace: BatchWorkspace::new(machine, Scope::LOADS, &model),
            steady: 0,
            step: 0,
            directions: Vec::new(),
            states: StateColumns::unknown(machine, ROWS_AT_ONCE),
            waiting: 0,
        }
    }

    fn take_row(&mut self, row: &KnownRow<'_>) {
        // a machine that falls or lies on its side stands on no plane through its contacts
        let falls = [Reason::Tipping, Reason::SupportsUnknown];
        if !falls.iter().any(|&reason| row.reasons().has(reason)) {
            self.take_state(row.machine, row.state);
        }
    }

    fn take_part(&mut self, machine: &Machine, _: &Rows) {
        self.evaluate_waiting(machine);
    }
}

impl Notes for MountingCheck {
    /// A note if the IMU's specific force does not point away from the ground.
    fn notes(&self, log: &NotedLog<'_>) -> Vec<Note> {
        let is_checked = log.loaded.matched.sensors.imu && log.is_recorded;
        let found = self.mean_direction().filter(|_| is_checked);
        let note = found.and_then(|(direction, rows)| note(log.machine, &direction, rows));
        note.into_iter().collect()
    }
}

impl MountingCheck {
    /// Takes the state of the next row. The last row on a machine is followed by [`Self::evaluate_waiting`].
    fn take_state(&mut self, machine: &Machine, state: &State<f64>) {
        let imu = &state.imu;
        let deviation = (imu.specific_force.norm() / machine.gravity() - 1.0).abs();
        if !(deviation < STEADY_SHARE && imu.angular_velocity.norm() < STEADY_RAD_S) {
            return;
        }
        if self.is_used() && self.directions.len() + self.waiting == MOST_ROWS {
            self.evaluate_waiting(machine);
            let mut place = 0;
            self.directions.retain(|_| {
                place += 1;
                place % 2 == 1
            });
            self.step += 1;
        }
        if self.is_used() {
            // at rest every part of the machine has the same specific force, supplied by the ground
            let mut at_rest = state.clone();
            at_rest.tool_wrench.force = Vector3::zeros();
            at_rest.tool_wrench.moment = Vector3::zeros();
            self.states.set(self.waiting, &mut at_rest);
            self.waiting += 1;
            if self.waiting == ROWS_AT_ONCE {
                self.evaluate_waiting(machine);
            }
        }
        self.steady += 1;
    }

    /// Whether the next steady row is one of those that are used.
    fn is_used(&self) -> bool {
        self.steady.is_multiple_of(1 << self.step)
    }

    /// Evaluates the rows that wait.
    fn evaluate_waiting(&mut self, machine: &Machine) {
        let rows = 0..std::mem::take(&mut self.waiting);
        let forces = ground_forces(machine, &self.states, rows, &mut self.workspace);
        let directions = forces.iter().map(|(ground, normal)| {
            let direction = ground.force.normalize();
            let plane = plane_from_base(normal);
            let is_known = direction.iter().chain(plane.iter()).all(|c| c.is_finite());
            is_known.then(|| plane * direction)
        });
        self.directions.extend(directions);
    }

    /// Mean direction, and the number of rows used.
    fn mean_direction(&self) -> Option<(Vector3<f64>, usize)> {
        let known: Vec<&Vector3<f64>> = self.directions.iter().flatten().collect();
        let sum: Vector3<f64> = known.iter().copied().sum();
        (known.len() >= FEWEST_ROWS).then(|| (sum.normalize(), known.len()))
    }
}

fn note(machine: &Machine, direction: &Vector3<f64>, steady_rows: usize) -> Option<Note> {
    let tilt = direction.z.clamp(-1.0, 1.0).acos().to_degrees();
    let text = || {
        say!(
            "Input fault: the specific force of {steady_rows} steady rows deviates from the normal of the contact plane by {tilt:.0} degrees; expected less than {SUSPICIOUS_DEG:.0}. Mean direction: ({:.2}, {:.2}, {:.2}) forward, left and up. Mounting: \
             {}. {} Nothing was corrected: loads and findings hold only if the mounting is right.",
            direction.x,
            direction.y,
            direction.z,
            machine.imu().source,
            explanation(machine, direction)
        )
    };
    (tilt > SUSPICIOUS_DEG).then(|| Note::new(NoteKind::InputFault, text()))
}

fn plane_from_base(normal: &Vector3<f64>) -> Matrix3<f64> {
    let forward = (Vector3::x() - normal * normal.x).normalize();
    let left = normal.cross(&forward);
    Matrix3::from_rows(&[forward.transpose(), left.transpose(), normal.transpose()])
}

/// The smallest rotation by multiples of 90 degrees that brings the measured direction up, as a mounting
/// to try.
fn explanation(machine: &Machine, direction: &Vector3<f64>) -> String {
    let rest = |turn: &Rotation3<f64>| (turn * direction).z.clamp(-1.0, 1.0).acos().to_degrees();
    let best = quarter_turns()
        .into_iter()
        .filter(|turn| rest(turn) <= SUSPICIOUS_DEG)
        .min_by(|a, b| a.angle().total_cmp(&b.angle()));
    let Some(turn) = best else {
        return word!("No rotation by multiples of 90 degrees explains it.").into();
    };
    let about = turn
        .axis()
        .map_or(word!("no axis"), |axis| axis_name(&axis));
    let angle = turn.angle().to_degrees();
    say!(
        "An IMU rotated by {angle:.0} degrees about the machine's {about} axis would explain all but {:.0} degrees{}",
        rest(&turn),
        mounting(machine, &turn)
    )
}

/// The mounting after a rotation, as a line of the machine file.
fn mounting(machine: &Machine, turn: &Rotation3<f64>) -> String {
    let mount = machine.imu();
    if mount.body != 0 {
        return ".".into();
    }
    let Isometry3 {
        rotation,
        translation,
    } = mount.body_from_mount;
    let (roll, pitch, yaw) = (UnitQuaternion::from_rotation_matrix(turn) * rotation).euler_angles();
    say!(
        ": [imu] link = \"{}\", xyz = [{:.3}, {:.3}, {:.3}], rpy = [{roll:.4}, {pitch:.4}, {yaw:.4}], up to a rotation \
         about the vertical, which gravity does not determine.",
        machine.base_link(),
        translation.x,
        translation.y,
        translation.z
    )
}

/// Rotations by 90 and 180 degrees about the horizontal axes.
fn quarter_turns() -> Vec<Rotation3<f64>> {
    let axes = [Vector3::x_axis(), Vector3::y_axis()];
    let quarters = [1.0, -1.0, 2.0].map(|quarters| quarters * std::f64::consts::FRAC_PI_2);
    let about = |axis| quarters.map(|angle| Rotation3::from_axis_angle(&axis, angle));
    axes.into_iter().flat_map(about).collect()
}

fn axis_name(axis: &Vector3<f64>) -> &'static str {
    match axis.iamax() {
        0 if axis.x > 0.0 => word!("+x (forward)"),
        0 => word!("-x (backward)"),
        1 if axis.y > 0.0 => word!("+y (left)"),
        1 => word!("-y (right)"),
        _ => "z",
    }
}
