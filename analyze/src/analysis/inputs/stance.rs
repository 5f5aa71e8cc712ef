//! A machine that stands still must be able to stand: the specific force points away from the ground, and the
//! computed loads hold it up.

use std::ops::Range;

use nalgebra::Vector3;
use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{Placement, State, Workspace, evaluate};

use super::windows::windows;
use super::{GrossInput, GrossInputKind};
use crate::base::estimated::EstimatedRows;
use crate::base::number::short;
use crate::events::FALL_RAD;
use crate::events::support_words::edge_word;
use crate::load::Standing;

/// Largest angular velocity of a quiet row (rad/s).
const QUIET_RAD_S: f64 = 0.03;
/// Largest relative deviation of the specific force from gravity in a quiet row.
const QUIET_SHARE: f64 = 0.1;
/// Largest joint velocity of a quiet row (rad/s or m/s).
const QUIET_JOINTS: f64 = 0.15;
/// Steeper than any ground on which a machine stands (degrees).
const STEEPEST_DEG: f64 = 50.0;
/// Most windows that are evaluated, evenly spread.
const MOST_WINDOWS: usize = 200;
/// Most rows before the first quiet window that are evaluated, evenly spread.
const MOST_EARLIER: usize = 500;
/// Negative load of the wheels off an edge, as a share of the weight, from which a machine cannot stay at rest for a
/// second: it would turn about the edge by several degrees.
const TIPPING_SHARE: f64 = 0.05;
/// Longest time before a machine rests in which a fall of it is looked for (ns).
const FALLS_NS: i64 = 10_000_000_000;

/// The rows whose specific force is looked at: one in each of some windows of a second.
pub(crate) fn looked_at(times_ns: &[i64]) -> Vec<usize> {
    let windows = windows(times_ns);
    let step = windows.len().div_ceil(MOST_WINDOWS).max(1);
    let windows = windows.iter().step_by(step);
    windows
        .map(|window| (window.start + window.end) / 2)
        .collect()
}

/// A specific force that never points away from the ground.
pub(super) fn direction(machine: &Machine, rows: &EstimatedRows) -> Option<GrossInput> {
    let mut scratch = Scratch::new(machine);
    let tilts = looked_at(&rows.times_ns).into_iter().filter_map(|row| {
        if rows.reasons[row].leave_state_unknown() {
            return None;
        }
        rows.state(row, &mut scratch.state);
        // at rest every part has the same specific force, whatever holds it
        scratch.state.tool_wrench.force = Vector3::zeros();
        scratch.state.tool_wrench.moment = Vector3::zeros();
        let outcome = evaluate(machine, &scratch.state, &mut scratch.workspace);
        let tilt = (outcome.ground_wrench.force.angle(&outcome.contact_normal)).to_degrees();
        tilt.is_finite().then_some(tilt)
    });
    let tilts: Vec<f64> = tilts.collect();
    // a machine that lies on its side stood before
    let least = tilts.iter().copied().reduce(f64::min)?;
    if least <= STEEPEST_DEG {
        return None;
    }
    let fix = match least > 150.0 {
        true => {
            word!(
                "the specific force has the opposite sign (scale = -1 in [signals.imu]), or the IMU is mounted upside down ([imu] rpy)"
            )
        }
        // attitude and specific force are of one device: a wrong mounting turns both alike
        false => {
            word!(
                "if the machine stood, correct the mounting of the IMU ([imu] link and rpy); if it lay on its side, no wheel carried it, \
             and the log does not show how it fell"
            )
        }
    };
    Some(GrossInput {
        kind: GrossInputKind::SpecificForceDirection,
        headline: say!(
            "The machine was on its side or roof from the first row on, or its IMU is mounted otherwise than stated: the specific force \
             always points {least:.0} degrees or more away from the normal of the ground"
        ),
        evidence: vec![
            say!(
                "Smallest angle in {} windows of one second; no machine stands on ground steeper than {STEEPEST_DEG:.0} degrees",
                tilts.len()
            ),
            say!("Mounting of the IMU: {}", machine.imu().source),
        ],
        fix: fix.into(),
    })
}

/// A machine that rests where it would tip over.
pub(super) fn rests_while_tipping(
    standing: &Standing<'_>,
    rows: &EstimatedRows,
) -> Option<GrossInput> {
    let machine_at = |row: usize| standing.at(rows.times_ns[row]);
    let mut windows = quiet_windows(rows).into_iter();
    let (window, machine) = windows.find_map(|window| {
        let machine = machine_at(window.start)?;
        // on the same supports until its end
        let last = machine_at(window.end - 1)?;
        (last.stands_on() == machine.stands_on()).then_some((window, machine))
    })?;
    let mut scratch = Scratch::new(machine);
    let earlier = 0..window.start;
    let step = window.start.div_ceil(MOST_EARLIER).max(1);
    for row in earlier.step_by(step) {
        rows.state(row, &mut scratch.state);
        if machine_at(row).is_none_or(|at| at.stands_on() != machine.stands_on()) {
            continue;
        }
        let outcome = evaluate(machine, &scratch.state, &mut scratch.workspace);
        let stood = outcome.itom_full.iter().all(|moment| *moment <= 0.0);
        if stood && !rows.reasons[row].leave_state_unknown() {
            // it stood and fell: now it may lie on its side
            return None;
        }
    }
    if fell(machine, backwards(machine, rows, window.start)) {
        // it fell from the first row on: something caught it
        return None;
    }
    let weight = machine.mass() * machine.gravity();
    let mut least: Vec<f64> = vec![f64::NEG_INFINITY; machine.polygon().edges().len()];
    for row in [
        window.start,
        (window.start + window.end) / 2,
        window.end - 1,
    ] {
        rows.state(row, &mut scratch.state);
        let outcome = evaluate(machine, &scratch.state, &mut scratch.workspace);
        for (edge, least) in machine.polygon().edges().iter().zip(&mut least) {
            let otf: f64 = edge.off().map(|wheel| outcome.otf[wheel]).sum();
            // NaN stays: such a row says nothing
            *least = if otf > *least || otf.is_nan() {
                otf
            } else {
                *least
            };
        }
    }
    let edges = machine.polygon().edges().iter().zip(least);
    let (edge, otf) = edges
        .filter(|(_, otf)| otf.is_finite())
        .min_by(|(_, a), (_, b)| a.total_cmp(b))?;
    if otf >= -TIPPING_SHARE * weight {
        return None;
    }
    Some(GrossInput {
        kind: GrossInputKind::RestsWhileTipping,
        headline: say!(
            "The machine rests at t = {:.2} s, where by these inputs it would tip over about the {} edge",
            rows.seconds(window.start),
            edge_word(&edge.name)
        ),
        evidence: vec![
            say!(
                "The wheels off that edge would have to be pulled down by {} N, {:.0} % of the weight, for {:.2} s",
                short(-otf),
                -100.0 * otf / weight,
                rows.seconds(window.end - 1) - rows.seconds(window.start)
            ),
            word!("Nothing turns meanwhile: something else holds the machine, or masses, geometry or joint positions are wrong")
                .into(),
        ],
        fix: word!("compare masses, centres of mass and wheel positions with the machine (tipwatch check-machine --log), and \
              the unit and zero of the joint positions; state a force on the tool as tool_wrench")
            .into(),
    })
}

/// The states from a row backwards, as long as they are known, with their times (ns).
fn backwards(
    machine: &Machine,
    rows: &EstimatedRows,
    from: usize,
) -> impl Iterator<Item = (i64, State<f64>)> {
    let first_ns = rows.times_ns[from].saturating_sub(FALLS_NS);
    let is_known = move |row: &usize| {
        rows.times_ns[*row] >= first_ns && !rows.reasons[*row].leave_state_unknown()
    };
    (0..=from).rev().take_while(is_known).map(move |row| {
        let mut state = State::zero(machine);
        rows.state(row, &mut state);
        (rows.times_ns[row], state)
    })
}

/// Whether a machine fell before it came to rest, by its states from there backwards: gyro and attitude turned together, while it went
/// less far than a ramp takes to turn it, from one pair of wheels to the next.
fn fell(machine: &Machine, mut backwards: impl Iterator<Item = (i64, State<f64>)>) -> bool {
    let Some((mut last_ns, at_rest)) = backwards.next() else {
        return false;
    };
    let place = |wheel: usize| machine.wheels()[wheel].centre_at_zero.xy();
    let edges = machine.polygon().edges().iter();
    let lengths = edges.map(|edge| (place(edge.to) - place(edge.from)).norm());
    let shortest = lengths.fold(f64::INFINITY, f64::min);
    let mut placement = Placement::new(machine);
    let (mut turned, mut way) = (Vector3::zeros(), 0.0);
    for (time_ns, state) in backwards {
        let step_s = (last_ns - time_ns) as f64 * 1e-9;
        last_ns = time_ns;
        placement.place(&state);
        turned += placement.angular_velocity * step_s;
        way += speed(machine, &state) * step_s;
        let is_on_the_spot = way < shortest;
        if !is_on_the_spot {
            return false;
        }
        let ups = at_rest.base.known_up().zip(state.base.known_up());
        let inclined = ups.map_or(0.0, |(now, then)| now.angle(&then));
        // about the normal it turns on its wheels
        if turned.xy().norm() > FALL_RAD && inclined > FALL_RAD {
            return true;
        }
    }
    false
}

/// Returns the speed (m/s) of the wheel that turns least, or of the base by the odometry; NaN if neither is known. Wheels spin in a fall, but
/// not all of them, and those of a machine that drives all turn.
fn speed(machine: &Machine, state: &State<f64>) -> f64 {
    let joints = machine.joints().iter().zip(&state.joints);
    let by_wheels = joints.filter(|(joint, _)| joint.logged);
    let by_wheels = by_wheels.filter_map(|(joint, motion)| {
        let radius = machine.wheels()[joint.spins_wheel?].radius;
        Some((motion.rate * radius).abs()).filter(|speed| speed.is_finite())
    });
    let least = by_wheels.reduce(f64::min);
    least.unwrap_or_else(|| state.base.velocity.norm())
}

struct Scratch {
    state: State<f64>,
    workspace: Workspace<f64>,
}

impl Scratch {
    fn new(machine: &Machine) -> Self {
        Self {
            state: State::zero(machine),
            workspace: Workspace::new(machine),
        }
    }
}

/// Whether the base does not turn, and the arm moves slowly at most.
pub(crate) fn is_quiet(machine: &Machine, state: &State<f64>) -> bool {
    let imu = &state.imu;
    let length = imu.specific_force.norm() / machine.gravity();
    let joints = (machine.joints().iter().zip(&state.joints))
        .filter(|(joint, _)| joint.spins_wheel.is_none());
    (length - 1.0).abs() < QUIET_SHARE
        && imu.angular_velocity.norm() < QUIET_RAD_S
        && joints
            .into_iter()
            .all(|(_, motion)| motion.rate.abs() < QUIET_JOINTS)
}

/// Windows of a second in which the base does not turn, the arm moves slowly at most, and the signals determine the state.
fn quiet_windows(rows: &EstimatedRows) -> Vec<Range<usize>> {
    let is_quiet =
        |row: usize| rows.activities[row].is_quiet && !rows.reasons[row].leave_state_unknown();
    let found = windows(&rows.times_ns).into_iter();
    let seconds = |window: &Range<usize>| rows.seconds(window.end - 1) - rows.seconds(window.start);
    found
        .filter(|window| seconds(window) > 0.7 && window.clone().all(is_quiet))
        .collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::base::rigid::rigid;

    /// States of a machine that turned by 14 degrees in a second and rests, from there backwards: as the gyro shows a share of the turn,
    /// at a speed (m/s).
    fn turned(machine: &Machine, shown: f64, speed: f64) -> Vec<(i64, State<f64>)> {
        let rate = 14.0_f64.to_radians();
        let imu_from_base = machine.imu().rotation_in_body().transpose();
        let state = |step: i64| {
            let angle = 19.0_f64.to_radians() - rate * 0.01 * step as f64;
            let mut state = State::zero(machine);
            state.base.up = Vector3::new(0.0, angle.sin(), angle.cos());
            state.base.velocity = Vector3::x() * speed;
            state.imu.angular_velocity = imu_from_base * Vector3::x() * (rate * shown);
            for (joint, motion) in machine.joints().iter().zip(&mut state.joints) {
                if let Some(wheel) = joint.spins_wheel {
                    motion.rate = speed / machine.wheels()[wheel].radius;
                }
            }
            (-step * 10_000_000, state)
        };
        (0..=100).map(state).collect()
    }

    #[test]
    fn a_machine_that_turned_on_the_spot_fell_before_it_rested() {
        let machine = rigid();
        let fell = |shown, speed| fell(&machine, turned(&machine, shown, speed).into_iter());
        assert!(fell(1.0, 0.0));
        assert!(!fell(1.0, 20.0), "on a ramp");
        assert!(!fell(0.0, 0.0), "by the attitude alone");
        assert!(!super::fell(&machine, std::iter::empty()));
        // it turned on its wheels on a slope of 15 degrees, by 90 degrees
        let imu_from_base = machine.imu().rotation_in_body().transpose();
        let slope = 15.0_f64.to_radians();
        let on_slope = (0..=100_i64).map(|step| {
            let heading = FRAC_PI_2 * (1.0 - 0.01 * step as f64);
            let mut state = State::zero(&machine);
            let across = Vector3::new(heading.sin(), heading.cos(), 0.0) * slope.sin();
            state.base.up = across + Vector3::z() * slope.cos();
            state.base.velocity = Vector3::zeros();
            state.imu.angular_velocity = imu_from_base * Vector3::z() * FRAC_PI_2;
            (-step * 10_000_000, state)
        });
        assert!(!super::fell(&machine, on_slope));
    }
}
