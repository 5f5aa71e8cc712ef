//! Does the IMU sit as the machine says? At rest the specific force points up; where it points far
//! from the normal of the wheels' contact plane, the mounting is wrong or the slope extreme. It is
//! reported and never corrected: gravity cannot tell how the sensor is turned about the vertical.

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{State, Workspace, evaluate};

use crate::base::rows::Rows;

/// How a note of an input that contradicts the machine begins.
pub const FAULT: &str = "input_fault";
/// More than the slopes that such machines work on (degrees).
const SUSPICIOUS_DEG: f64 = 20.0;
/// Slower turning counts as steady (rad/s).
const STEADY_RAD_S: f64 = 0.05;
/// A specific force this share off gravity's still counts as steady.
const STEADY_SHARE: f64 = 0.05;
/// Fewer steady rows tell nothing.
const FEWEST_ROWS: usize = 10;
/// Of more steady rows only some are looked at, evenly.
const MOST_ROWS: usize = 1000;

/// What is found if the IMU does not feel gravity from below.
#[must_use]
pub(crate) fn note(machine: &Machine, rows: &Rows) -> Option<String> {
    let (felt, steady_rows) = mean_direction(machine, rows)?;
    let tilt = felt.z.clamp(-1.0, 1.0).acos().to_degrees();
    (tilt > SUSPICIOUS_DEG).then(|| {
        format!(
            "{FAULT}: imu: in {steady_rows} steady rows that were looked at the specific force points {tilt:.0} degrees off the normal of the wheels' \
             contact plane, on average ({:.2}, {:.2}, {:.2}) forward, left and up; expected less than {SUSPICIOUS_DEG:.0}. Mounting: \
             {}. {} Nothing was corrected: loads and findings hold only if the mounting is right.",
            felt.x,
            felt.y,
            felt.z,
            machine.imu().source,
            explanation(machine, &felt)
        )
    })
}

/// Mean direction of what the machine feels in steady rows, in axes forward, left and normal of the
/// contact plane, and the number of those rows that were looked at.
fn mean_direction(machine: &Machine, rows: &Rows) -> Option<(Vector3<f64>, usize)> {
    let (mut state, mut workspace) = (State::zero(machine), Workspace::new(machine));
    let (mut sum, mut count) = (Vector3::zeros(), 0);
    let is_steady = |row: usize, state: &mut State<f64>| {
        rows.states.get(row, state);
        let imu = &state.imu;
        let off = (imu.specific_force.norm() / machine.gravity() - 1.0).abs();
        off < STEADY_SHARE && imu.angular_velocity.norm() < STEADY_RAD_S
    };
    let steady: Vec<usize> = (0..rows.len())
        .filter(|&row| !rows.reasons[row].leave_state_unknown() && is_steady(row, &mut state))
        .collect();
    for &row in steady
        .iter()
        .step_by(steady.len().div_ceil(MOST_ROWS).max(1))
    {
        rows.states.get(row, &mut state);
        // at rest every part of the machine feels the same, which the ground supplies
        state.tool_wrench.force = Vector3::zeros();
        state.tool_wrench.moment = Vector3::zeros();
        let outcome = evaluate(machine, &state, &mut workspace);
        let felt = outcome.ground_wrench.force.normalize();
        let plane = plane_from_base(&outcome.contact_normal);
        if felt.iter().chain(plane.iter()).all(|c| c.is_finite()) {
            sum += plane * felt;
            count += 1;
        }
    }
    (count >= FEWEST_ROWS).then(|| (sum.normalize(), count))
}

fn plane_from_base(normal: &Vector3<f64>) -> Matrix3<f64> {
    let forward = (Vector3::x() - normal * normal.x).normalize();
    let left = normal.cross(&forward);
    Matrix3::from_rows(&[forward.transpose(), left.transpose(), normal.transpose()])
}

/// The smallest turn by quarters that brings the felt direction up, as a mounting to try.
fn explanation(machine: &Machine, felt: &Vector3<f64>) -> String {
    let rest = |turn: &Rotation3<f64>| (turn * felt).z.clamp(-1.0, 1.0).acos().to_degrees();
    let best = quarter_turns()
        .into_iter()
        .filter(|turn| rest(turn) <= SUSPICIOUS_DEG)
        .min_by(|a, b| a.angle().total_cmp(&b.angle()));
    let Some(turn) = best else {
        return "No turn by quarters explains it.".into();
    };
    let about = turn.axis().map_or("no axis", |axis| axis_name(&axis));
    let angle = turn.angle().to_degrees();
    format!(
        "An IMU that is turned by {angle:.0} degrees about the machine's {about} axis would explain all but {:.0} degrees{}",
        rest(&turn),
        mounting(machine, &turn)
    )
}

/// The mounting after a turn, as it would stand in the machine file.
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
    format!(
        ": [imu] link = \"{}\", xyz = [{:.3}, {:.3}, {:.3}], rpy = [{roll:.4}, {pitch:.4}, {yaw:.4}], up to a turn about the vertical, \
         which gravity does not show.",
        machine.base_link(),
        translation.x,
        translation.y,
        translation.z
    )
}

/// The quarter and half turns that keep a box a box.
fn quarter_turns() -> Vec<Rotation3<f64>> {
    let axes = [Vector3::x_axis(), Vector3::y_axis()];
    let quarters = [1.0, -1.0, 2.0].map(|quarters| quarters * std::f64::consts::FRAC_PI_2);
    let about = |axis| quarters.map(|angle| Rotation3::from_axis_angle(&axis, angle));
    axes.into_iter().flat_map(about).collect()
}

fn axis_name(axis: &Vector3<f64>) -> &'static str {
    match axis.iamax() {
        0 if axis.x > 0.0 => "+x (forward)",
        0 => "-x (backward)",
        1 if axis.y > 0.0 => "+y (left)",
        1 => "-y (right)",
        _ => "z",
    }
}
