//! Units of joint positions and velocities, by the limits of the URDF and by each other.

use tipwatch_mechanics::machine::{Machine, MeasuredJoint};
use tipwatch_mechanics::state::Sensor;

use super::proportion::{Proportion, Unit, scale_hint, unit_by_factor};
use super::windows::{median, quantile};
use super::{GrossInput, GrossInputKind};
use crate::base::number::{percent, short};
use crate::load::{LoadedLog, Signal};

/// Longest step between samples that are compared (s).
const LONGEST_STEP_S: f64 = 0.25;
/// Time over which a change of position is compared with the velocity (s).
const COMPARED_S: f64 = 0.1;
/// Fewest comparisons.
const FEWEST_STEPS: usize = 10;
/// Smallest root mean square velocity of a joint that moves (rad/s or m/s).
const MOVING: f64 = 0.005;
/// A change of position of half a turn or more in a step may be a wrap (rad).
const WRAP: f64 = 3.0;
/// Proportion of velocity and derivative of the position, or its inverse, that no lag or noise explains.
const LARGEST_PROPORTION: f64 = 3.0;
/// Turns beyond which the position of a joint without useful limits is not an angle in radians.
const MOST_TURNS: f64 = 2.0;
/// Tolerance beyond limits, as a share of their span.
const LIMIT_SHARE: f64 = 0.05;
/// Share of the samples beyond the limits from which all are in another unit.
const MOST_BEYOND: f64 = 0.25;
/// Distance beyond a limit that no wrong zero of an encoder explains (rad and m).
const FAR_BEYOND_RAD: f64 = 6.0;
const FAR_BEYOND_M: f64 = 2.0;
/// Turn of a wheel between two samples beyond which its position may be mistaken (rad).
const LARGEST_WHEEL_STEP: f64 = 2.0;
/// Largest plausible stroke of a prismatic joint (m).
const LARGEST_STROKE_M: f64 = 30.0;
const ANGLES: [(&str, f64); 2] = [("degrees", 57.295_78), ("thousandths of a radian", 1000.0)];
const LENGTHS: [(&str, f64); 3] = [
    ("millimetres", 1000.0),
    ("centimetres", 100.0),
    ("inches", 39.370_08),
];
/// Velocities relative to the derivative of the position, both as logged.
const VELOCITIES: [(&str, f64); 5] = [
    ("degrees per second", 57.295_78),
    ("revolutions per minute", 9.549_3),
    ("revolutions per second", 0.159_155),
    ("millimetres per second", 1000.0),
    ("centimetres per second", 100.0),
];

/// The joints of a signal that look alike.
struct Suspects {
    /// Factor from SI, and the unit that it means, of the first of them.
    first: Option<(f64, Option<Unit>)>,
    names: Vec<String>,
    evidence: Vec<String>,
}

/// Joints whose positions or velocities are in another unit, one finding for each topic.
pub(super) fn scales(loaded: &LoadedLog) -> Vec<GrossInput> {
    let mut found = Vec::new();
    for signal in loaded.signals.iter() {
        let Sensor::Joints(stream) = signal.sensor else {
            continue;
        };
        let joints = &loaded.matched.sensors.joints[stream].joints;
        let mut positions = Suspects::none();
        let mut velocities = Suspects::none();
        for (column, &joint) in joints.iter().enumerate() {
            let values = Column::of(signal, column, joints.len());
            let slides = loaded.machine.joint_slides(joint);
            let it = &loaded.machine.joints()[joint];
            let by_velocity = values.velocity_proportion(slides, it.spins_wheel.is_some());
            let by_limits = beyond_limits(&loaded.machine, it, slides, &values);
            let units: &[Unit] = if slides { &LENGTHS } else { &ANGLES };
            if let Some((factor, evidence)) = by_limits {
                positions.add(it, factor, units, evidence);
            } else if let Some((factor, evidence)) = by_velocity {
                // positions in degrees and velocities in rad/s look like velocities 57 times too small
                match unit_by_factor(1.0 / factor, units) {
                    Some(_) => positions.add(it, 1.0 / factor, units, evidence),
                    None => velocities.add(it, factor, &VELOCITIES, evidence),
                }
            }
        }
        let [of_positions, of_velocities] = [
            GrossInputKind::JointPositionScale,
            GrossInputKind::JointVelocityScale,
        ];
        found.extend(positions.finding(signal, of_positions, "Positions"));
        found.extend(velocities.finding(signal, of_velocities, "Velocities"));
    }
    found
}

/// Positions and velocities of one joint.
struct Column<'s> {
    signal: &'s Signal,
    position: usize,
    velocity: usize,
}

impl<'s> Column<'s> {
    fn of(signal: &'s Signal, column: usize, joints: usize) -> Self {
        Self {
            signal,
            position: column,
            velocity: joints + column,
        }
    }

    fn positions(&self) -> impl Iterator<Item = f64> + '_ {
        let mut reader = self.signal.recording.reader();
        (0..self.signal.recording.len()).map(move |at| reader.sample(at)[self.position])
    }

    /// Proportion of the velocity to the derivative of the position, if it cannot be one, and the evidence.
    fn velocity_proportion(&self, slides: bool, is_wheel: bool) -> Option<(f64, String)> {
        let recording = &self.signal.recording;
        let mut reader = recording.reader();
        let mut proportion = Proportion::default();
        // over a tenth of a second or more, so that the noise of the positions does not matter
        let (mut elapsed_s, mut change, mut travel) = (0.0, 0.0, 0.0);
        for (at, pair) in recording.stamps_ns.windows(2).enumerate() {
            let step_s = pair[1].saturating_sub(pair[0]) as f64 * 1e-9;
            let [before, now] = [at, at + 1].map(|at| {
                let sample = reader.sample(at);
                (sample[self.position], sample[self.velocity])
            });
            let step = now.0 - before.0;
            let is_turn_clear = !is_wheel || now.1.abs() * step_s < LARGEST_WHEEL_STEP;
            let is_step = step_s > 0.0 && step_s <= LONGEST_STEP_S && is_turn_clear;
            if !is_step || !(slides || step.abs() < WRAP) {
                (elapsed_s, change, travel) = (0.0, 0.0, 0.0);
                continue;
            }
            elapsed_s += step_s;
            change += step;
            travel += 0.5 * (before.1 + now.1) * step_s;
            if elapsed_s >= COMPARED_S || !travel.is_finite() {
                proportion.add(change / elapsed_s, travel / elapsed_s);
                (elapsed_s, change, travel) = (0.0, 0.0, 0.0);
            }
        }
        let factor = proportion.factor()?;
        let [derivative, velocity] = proportion.sizes();
        let within = 1.0 / LARGEST_PROPORTION..=LARGEST_PROPORTION;
        if within.contains(&factor)
            || proportion.pairs < FEWEST_STEPS
            || derivative.min(velocity) < MOVING
        {
            return None;
        }
        Some((
            factor,
            format!(
                "velocity is {} times the derivative of the position over {} steps of a tenth of a second or more",
                short(factor),
                proportion.pairs
            ),
        ))
    }
}

/// The factor by which positions exceed what the joint can reach, and the evidence.
fn beyond_limits(
    machine: &Machine,
    joint: &MeasuredJoint,
    slides: bool,
    values: &Column<'_>,
) -> Option<(f64, String)> {
    if joint.spins_wheel.is_some() {
        return None;
    }
    let count = values.positions().filter(|p| p.is_finite()).count();
    let (low, high) = (
        quantile(values.positions(), 0.0)?,
        quantile(values.positions(), 1.0)?,
    );
    let range = format!("between {} and {}", short(low), short(high));
    if let Some([least, greatest]) = joint.limits {
        let margin = LIMIT_SHARE * (greatest - least)
            + match slides {
                true => machine.plausibility().joint_margin_linear,
                false => machine.plausibility().joint_margin,
            };
        let within = least - margin..=greatest + margin;
        let finite = || values.positions().filter(|p| p.is_finite());
        let share_beyond = |scale: f64, offset: f64| {
            let beyond = finite().filter(|p| !within.contains(&(p * scale + offset)));
            beyond.count() as f64 / count as f64
        };
        // an angle may be off by one turn, which changes nothing
        let turn = std::f64::consts::TAU;
        let is_off_by_a_turn = !slides
            && greatest - least <= 1.01 * turn
            && [turn, -turn]
                .iter()
                .any(|&offset| share_beyond(1.0, offset) == 0.0);
        let beyond = share_beyond(1.0, 0.0);
        let units: &[_] = if slides { &LENGTHS } else { &ANGLES };
        let fits = units
            .iter()
            .find(|(_, factor)| share_beyond(1.0 / factor, 0.0) == 0.0);
        // a wrong zero of an encoder is no other unit
        let far = match slides {
            true => FAR_BEYOND_M,
            false => FAR_BEYOND_RAD,
        };
        let is_far = low < least - far || high > greatest + far;
        let is_unit = is_far && beyond > MOST_BEYOND && !is_off_by_a_turn;
        if let Some((_, factor)) = fits.filter(|_| is_unit) {
            return Some((
                *factor,
                format!(
                    "{range}, {} of the samples beyond the limits {} to {} of the URDF",
                    percent(beyond),
                    short(least),
                    short(greatest)
                ),
            ));
        }
    }
    let typical = median(values.positions().map(f64::abs))?;
    let (largest, unit) = match slides {
        true => (LARGEST_STROKE_M, LENGTHS[0]),
        false => (MOST_TURNS * std::f64::consts::TAU, ANGLES[0]),
    };
    // a slewing joint may count its turns: then its limits, if any, allow that
    let may_turn = !slides && !is_limited(joint);
    (typical > largest && !may_turn).then_some((unit.1, range))
}

/// Whether the URDF states limits that a position of several turns would exceed.
fn is_limited(joint: &MeasuredJoint) -> bool {
    joint.limits.is_some_and(|[least, greatest]| {
        least.abs().max(greatest.abs()) < MOST_TURNS * std::f64::consts::TAU
    })
}

impl Suspects {
    fn none() -> Self {
        Self {
            first: None,
            names: Vec::new(),
            evidence: Vec::new(),
        }
    }

    fn add(&mut self, joint: &MeasuredJoint, factor: f64, units: &[Unit], evidence: String) {
        self.first
            .get_or_insert_with(|| (factor, unit_by_factor(factor, units)));
        self.names.push(joint.name.clone());
        self.evidence.push(format!("{}: {evidence}", joint.name));
    }

    fn finding(self, signal: &Signal, kind: GrossInputKind, what: &str) -> Option<GrossInput> {
        let (factor, unit) = self.first?;
        let looks_like = match unit {
            Some((name, _)) => format!("they look like {name}"),
            None if factor < 0.0 => "they have the opposite sign".to_owned(),
            None => "their unit is wrong".to_owned(),
        };
        let key = match kind {
            GrossInputKind::JointPositionScale => "position",
            _ => "velocity",
        };
        Some(GrossInput {
            kind,
            headline: format!(
                "{what} of {} on {} are not in SI units: {looks_like}",
                self.names.join(", "),
                signal.topic
            ),
            evidence: self.evidence,
            fix: format!(
                "{}; bind the joints of {} with that scale: [signals.joints.NAME] {key} = {{ topic = ..., joint = ..., scale = ... }}",
                scale_hint(factor, unit),
                signal.topic
            ),
        })
    }
}
