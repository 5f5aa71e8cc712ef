//! What would have kept the worst wheel at its limit: the smallest changes of what an operator controls.
//!
//! To first order, for each change alone: with g the derivative of the wheel's OTF at its worst instant,
//! `change = (limit - OTF) / g`. Changes are ranked by effort: the change as a share of the range in this log
//! (positions) or of the value (velocities, accelerations, forces, masses).

use tipwatch_mechanics::machine::{LinkGroup, Machine};
use tipwatch_mechanics::{Parameter, State};

use crate::analysis::Analysis;
use crate::base::rows::Rows;

/// A joint with a range up to this did not move (rad or m).
const SMALLEST_RANGE: f64 = 1e-3;
/// Motions and forces up to this are negligible (in their units).
const NEGLIGIBLE: f64 = 1e-3;

/// A change that would have kept the worst wheel at its limit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Prevention {
    /// What would change.
    pub(crate) parameter: Parameter,
    /// Its value at the worst instant.
    pub(crate) value: f64,
    /// The change, in the unit of the parameter.
    pub(crate) change: f64,
    /// The change as a share of `effort_of`.
    pub(crate) effort: f64,
    /// What the change is compared with.
    pub(crate) effort_of: &'static str,
}

/// The changes in order of effort; empty if the worst wheel stayed above its limit or the model has no
/// derivatives. Changes of more than 100 % are omitted, and so are those that would not reduce a motion or force.
pub(crate) fn preventions(analysis: &Analysis) -> Vec<Prevention> {
    let Some(table) = &analysis.sensitivity else {
        return Vec::new();
    };
    let machine = &analysis.machine;
    let limit_n = limit_of(analysis, table.worst_wheel);
    let ranges = joint_ranges(machine, &analysis.rows);
    let of_wheel = table.rows.iter().filter(|r| r.wheel == table.worst_wheel);
    let mut found: Vec<Prevention> = of_wheel
        .filter(|row| row.worst_otf_n < limit_n)
        .filter_map(|row| {
            let value = row.nominal?;
            let change = (limit_n - row.worst_otf_n) / row.derivative;
            let (whole, effort_of) = whole(machine, row.parameter, value, &ranges)?;
            let effort = change.abs() / whole;
            let is_possible = effort.is_finite()
                && effort <= 1.0
                && (is_position(row.parameter) || change * value < 0.0);
            is_possible.then_some(Prevention {
                parameter: row.parameter,
                value,
                change,
                effort,
                effort_of,
            })
        })
        .collect();
    found.sort_by(|a, b| a.effort.total_cmp(&b.effort));
    found
}

/// The load that a wheel should keep (N).
pub(crate) fn limit_of(analysis: &Analysis, wheel: usize) -> f64 {
    let limits = analysis.min_loads_n.as_ref();
    limits
        .and_then(|limits| limits.get(wheel))
        .copied()
        .unwrap_or(0.0)
}

fn is_position(parameter: Parameter) -> bool {
    matches!(parameter, Parameter::JointPosition(_))
}

/// What a change is compared with; `None` for what an operator does not control.
fn whole(
    machine: &Machine,
    parameter: Parameter,
    value: f64,
    ranges: &[f64],
) -> Option<(f64, &'static str)> {
    let moved = |joint: usize| {
        let is_wheel = machine.joints()[joint].spins_wheel.is_some();
        Some(ranges[joint]).filter(|&range| range > SMALLEST_RANGE && !is_wheel)
    };
    match parameter {
        Parameter::JointPosition(joint) => Some((moved(joint)?, "its range in this log")),
        Parameter::JointVelocity(joint) | Parameter::JointAcceleration(joint) => {
            moved(joint)?;
            (value.abs() > NEGLIGIBLE).then_some((value.abs(), "its value at that time"))
        }
        Parameter::BaseMotion(_) | Parameter::ToolForce(_) | Parameter::ToolMoment(_) => {
            (value.abs() > NEGLIGIBLE).then_some((value.abs(), "its value at that time"))
        }
        Parameter::PayloadMass(_) => Some((value, "its mass")),
        Parameter::LinkMass(link) => {
            let carries_load = end_of_arm(machine) == Some(machine.links()[link].body);
            carries_load.then_some((value, "its mass"))
        }
        _ => None,
    }
}

/// The body of the arm with the most joints between it and the base, the heaviest of several: its mass is
/// mostly tool and load.
fn end_of_arm(machine: &Machine) -> Option<usize> {
    let depth = |body: usize| {
        let up = |&body: &usize| Some(machine.bodies()[body].parent).filter(|_| body > 0);
        std::iter::successors(Some(body), up).count()
    };
    let of_arm = machine.links().iter().filter(|l| l.group == LinkGroup::Arm);
    let mass = |body: usize| machine.bodies()[body].inertia.mass;
    of_arm.map(|link| link.body).max_by(|&a, &b| {
        let deeper = depth(a).cmp(&depth(b));
        deeper.then(mass(a).total_cmp(&mass(b)))
    })
}

/// The range of each joint in the log (rad or m).
fn joint_ranges(machine: &Machine, rows: &Rows) -> Vec<f64> {
    let mut state = State::zero(machine);
    let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; machine.joints().len()];
    for row in (0..rows.len()).filter(|&row| rows.is_valid(row)) {
        rows.states.get(row, &mut state);
        for (range, joint) in ranges.iter_mut().zip(&state.joints) {
            *range = [range[0].min(joint.position), range[1].max(joint.position)];
        }
    }
    ranges
        .iter()
        .map(|[low, high]| (high - low).max(0.0))
        .collect()
}
