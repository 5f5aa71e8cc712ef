//! Units of joint positions and velocities, by the limits of the URDF and by each other.

use tipwatch_language::{message, say, told, word};
use tipwatch_mechanics::machine::{Machine, MeasuredJoint};

use super::proportion::{Proportion, Unit, scale_hint, unit_by_factor};
use super::windows::median;
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
const ANGLES: [(&str, f64); 2] = [
    (message!("degrees"), 57.295_78),
    (message!("thousandths of a radian"), 1000.0),
];
const LENGTHS: [(&str, f64); 3] = [
    (message!("millimetres"), 1000.0),
    (message!("centimetres"), 100.0),
    (message!("inches"), 39.370_08),
];
/// Velocities relative to the derivative of the position, both as logged.
const VELOCITIES: [(&str, f64); 5] = [
    (message!("degrees per second"), 57.295_78),
    (message!("revolutions per minute"), 9.549_3),
    (message!("revolutions per second"), 0.159_155),
    (message!("millimetres per second"), 1000.0),
    (message!("centimetres per second"), 100.0),
];

/// The joints of a signal that look alike.
struct Suspects {
    /// Factor from SI of the first of these joints, with the unit that it means.
    first: Option<(f64, Option<Unit>)>,
    names: Vec<String>,
    evidence: Vec<String>,
}

/// Joints whose positions or velocities are in another unit, one finding for each topic.
pub(super) fn scales(loaded: &LoadedLog) -> Vec<GrossInput> {
    let mut found = Vec::new();
    for signal in loaded.signals.iter() {
        let Some(joints) = loaded.matched.sensors.joints_of(signal.sensor) else {
            continue;
        };
        let mut positions = Suspects::none();
        let mut velocities = Suspects::none();
        let seen = JointSamples::in_signal(loaded, signal, joints);
        for ((column, &joint), seen) in joints.iter().enumerate().zip(seen) {
            let values = Column {
                signal,
                position: column,
                range: seen.range,
            };
            let slides = loaded.machine.joint_slides(joint);
            let it = &loaded.machine.joints()[joint];
            let by_velocity = seen.velocity_proportion();
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
        found.extend(positions.finding(signal, of_positions, word!("Positions")));
        found.extend(velocities.finding(signal, of_velocities, word!("Velocities")));
    }
    found
}

/// Observations of a joint in one pass over the samples of a signal.
#[derive(Default)]
struct JointSamples {
    slides: bool,
    is_wheel: bool,
    /// Number, least and largest of the finite positions.
    range: Option<(usize, f64, f64)>,
    proportion: Proportion,
    last: Option<(f64, f64)>,
    /// Current comparison: its time (s), the change of the position, and the integrated velocity.
    compared: [f64; 3],
}

impl JointSamples {
    /// Observes each joint in a signal.
    fn in_signal(loaded: &LoadedLog, signal: &Signal, joints: &[usize]) -> Vec<Self> {
        let mut all: Vec<Self> = (joints.iter())
            .map(|&joint| Self {
                slides: loaded.machine.joint_slides(joint),
                is_wheel: loaded.machine.joints()[joint].spins_wheel.is_some(),
                ..Self::default()
            })
            .collect();
        let recording = &signal.recording;
        let mut reader = recording.reader();
        let mut last_ns = None;
        for (at, &stamp_ns) in recording.stamps_ns.iter().enumerate() {
            let step = last_ns.replace(stamp_ns);
            let step_s = step.map_or(0.0, |last| stamp_ns.saturating_sub(last) as f64 * 1e-9);
            let (positions, velocities) = reader.sample(at).split_at(joints.len());
            for (seen, now) in all.iter_mut().zip(positions.iter().zip(velocities)) {
                seen.take(step_s, (*now.0, *now.1));
            }
        }
        all
    }

    /// Takes position and velocity of the next sample, so long after the one before (s).
    fn take(&mut self, step_s: f64, now: (f64, f64)) {
        // of several samples with one stamp the first one is used: so much motion in no time is no velocity
        if step_s == 0.0 && self.last.is_some() {
            return;
        }
        let before = self.last.replace(now);
        let position = now.0;
        if position.is_finite() {
            let (count, low, high) = self.range.unwrap_or((0, position, position));
            let is_less = |a: f64, b: f64| a.total_cmp(&b).is_lt();
            let low = if is_less(position, low) {
                position
            } else {
                low
            };
            let high = if is_less(high, position) {
                position
            } else {
                high
            };
            self.range = Some((count + 1, low, high));
        }
        let Some(before) = before else {
            return;
        };
        // over a tenth of a second or more, so that the noise of the positions does not matter
        let step = now.0 - before.0;
        let is_turn_clear = !self.is_wheel || now.1.abs() * step_s < LARGEST_WHEEL_STEP;
        let is_step = step_s > 0.0 && step_s <= LONGEST_STEP_S && is_turn_clear;
        if !is_step || !(self.slides || step.abs() < WRAP) {
            self.compared = [0.0; 3];
            return;
        }
        let [elapsed_s, change, travel] = &mut self.compared;
        *elapsed_s += step_s;
        *change += step;
        *travel += 0.5 * (before.1 + now.1) * step_s;
        if *elapsed_s >= COMPARED_S || !travel.is_finite() {
            (self.proportion).add(*change / *elapsed_s, *travel / *elapsed_s);
            self.compared = [0.0; 3];
        }
    }

    /// Proportion of the velocity to the derivative of the position, if it cannot be one, and the evidence.
    fn velocity_proportion(&self) -> Option<(f64, String)> {
        let proportion = &self.proportion;
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
            say!(
                "velocity is {} times the derivative of the position over {} steps of a tenth of a second or more",
                short(factor),
                proportion.pairs
            ),
        ))
    }
}

/// Positions of one joint.
struct Column<'s> {
    signal: &'s Signal,
    position: usize,
    /// Number, least and largest of the finite positions.
    range: Option<(usize, f64, f64)>,
}

impl Column<'_> {
    fn positions(&self) -> impl Iterator<Item = f64> + '_ {
        let mut reader = self.signal.recording.reader();
        (0..self.signal.recording.len()).map(move |at| reader.sample(at)[self.position])
    }
}

/// Returns the factor by which positions exceed the limits of the joint, and the evidence.
fn beyond_limits(
    machine: &Machine,
    joint: &MeasuredJoint,
    slides: bool,
    values: &Column<'_>,
) -> Option<(f64, String)> {
    if joint.spins_wheel.is_some() {
        return None;
    }
    let (count, low, high) = values.range?;
    let range = say!("between {} and {}", short(low), short(high));
    if let Some([least, greatest]) = joint.limits {
        let margin = LIMIT_SHARE * (greatest - least) + machine.plausibility().margin_of(slides);
        let within = least - margin..=greatest + margin;
        let finite = || values.positions().filter(|p| p.is_finite());
        let share_beyond = |scale: f64, offset: f64| {
            let beyond = finite().filter(|p| !within.contains(&(p * scale + offset)));
            beyond.count() as f64 / count as f64
        };
        // a wrong zero of an encoder is no other unit
        let far = match slides {
            true => FAR_BEYOND_M,
            false => FAR_BEYOND_RAD,
        };
        let is_far = low < least - far || high > greatest + far;
        let beyond = if is_far { share_beyond(1.0, 0.0) } else { 0.0 };
        // an angle may be off by one turn, which changes nothing
        let turn = std::f64::consts::TAU;
        let is_off_by_a_turn = || {
            !slides
                && greatest - least <= 1.01 * turn
                && [turn, -turn]
                    .iter()
                    .any(|&offset| share_beyond(1.0, offset) == 0.0)
        };
        let units: &[_] = if slides { &LENGTHS } else { &ANGLES };
        let fits = || {
            units
                .iter()
                .find(|(_, factor)| share_beyond(1.0 / factor, 0.0) == 0.0)
        };
        let is_unit = beyond > MOST_BEYOND && !is_off_by_a_turn();
        if let Some((_, factor)) = is_unit.then(fits).flatten() {
            return Some((
                *factor,
                say!(
                    "{range}, {} of the samples beyond the limits {} to {} of the URDF",
                    percent(beyond),
                    short(least),
                    short(greatest)
                ),
            ));
        }
    }
    let (largest, unit) = match slides {
        true => (LARGEST_STROKE_M, LENGTHS[0]),
        false => (MOST_TURNS * std::f64::consts::TAU, ANGLES[0]),
    };
    // a slewing joint may count its turns: then its limits, if any, allow that
    let may_turn = !slides && !is_limited(joint);
    if may_turn || low.abs().max(high.abs()) <= largest {
        return None;
    }
    let typical = median(values.positions().map(f64::abs))?;
    (typical > largest).then_some((unit.1, range))
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
            Some((name, _)) => say!("they look like {}", told(name)),
            None if factor < 0.0 => word!("they have the opposite sign").to_owned(),
            None => word!("their unit is wrong").to_owned(),
        };
        let key = match kind {
            GrossInputKind::JointPositionScale => "position",
            _ => "velocity",
        };
        Some(GrossInput {
            kind,
            headline: say!(
                "{what} of {} on {} are not in SI units: {looks_like}",
                self.names.join(", "),
                signal.topic
            ),
            evidence: self.evidence,
            fix: say!(
                "{}; bind the joints of {} with that scale: [signals.joints.NAME] {key} = {{ topic = ..., joint = ..., scale = ... }}",
                scale_hint(factor, unit),
                signal.topic
            ),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_samples_of_one_stamp_make_no_velocity_too_large() {
        let mut seen = JointSamples::default();
        // 100 samples a second with stamps of a tenth of a second
        let mut last = 0;
        for k in 0..3000 {
            let t = f64::from(k) * 0.01;
            let tenth = k / 10;
            let step_s = f64::from(tenth - last) * 0.1;
            last = tenth;
            seen.take(step_s, (0.5 * t.sin(), 0.5 * t.cos()));
        }
        assert_eq!(seen.velocity_proportion(), None);
    }
}
