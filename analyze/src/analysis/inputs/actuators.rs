//! Units of the forces and pressures of actuators that carry wheels, and of those of supports: together they bear a share of the weight.

use tipwatch_language::{message, say, told, word};
use tipwatch_mechanics::machine::{ForceSource, SupportId};
use tipwatch_mechanics::state::{NumberKind, Sensor};

use super::proportion::digits;
use super::windows::median;
use super::{GrossInput, GrossInputKind};
use crate::base::number::{percent, short};
use crate::load::{LoadedLog, Recording};

/// Smallest and largest force of an actuator as a share of the weight: one that carries wheels is within, in
/// kilonewtons or bar none is.
const FORCE_SHARE: [f64; 2] = [0.002, 60.0];

/// Smallest and largest sum of the measured loads of supports as a share of the weight, where all of them are measured: loads that are not
/// stated and masses that are wrong are within, kilonewtons, kilograms and pounds are not.
const SUM_SHARE: [f64; 2] = [0.3, 3.0];
/// Smallest and largest sum of the measured loads as a share of the weight, where only some supports are measured.
const PART_SHARE: [f64; 2] = [0.002, 3.0];
/// Fewest times at which a sum is compared.
const FEWEST_SUMS: usize = 5;
/// Likely units of logged forces: name, newtons of one unit.
const UNITS: [(&str, f64); 6] = [
    ("kN", 1000.0),
    ("kg", 9.80665),
    (message!("tonnes"), 9806.65),
    (message!("pounds"), 4.448_22),
    ("daN", 10.0),
    ("MN", 1e6),
];
/// Largest deviation of a sum from the weight by which one of these units is recognised (as a factor).
const UNIT_WITHIN: f64 = 1.5;

/// Actuators whose logged force cannot be one that carries wheels, one finding for each linkage.
pub(super) fn scales(loaded: &LoadedLog) -> Vec<GrossInput> {
    let machine = &loaded.machine;
    let weight = machine.mass() * machine.gravity();
    let joints = machine.contact().actuated_joints.iter().enumerate();
    joints
        .filter_map(|(index, joint)| {
            // an outrigger carries nothing for most of the time
            joint.linkage()?;
            let mut forces = Vec::new();
            let mut topics = Vec::new();
            for signal in loaded.signals.iter() {
                let Sensor::Number(NumberKind::Actuator, at) = signal.sensor else {
                    continue;
                };
                let of_joint = &loaded.matched.sensors.actuators[at];
                if of_joint.joint == index {
                    let factor = joint.signals[of_joint.signal].abs();
                    let mut reader = signal.recording.reader();
                    let samples = 0..signal.recording.len();
                    let sizes = samples.map(|at| reader.sample(at)[0].abs() * factor);
                    forces.extend(median(sizes));
                    topics.push(signal.topic.as_str());
                }
            }
            // the chamber under pressure counts, not the one that drains
            let force = forces.into_iter().reduce(f64::max)?;
            let [least, largest] = FORCE_SHARE;
            if force == 0.0 || (least..=largest).contains(&(force / weight)) {
                return None;
            }
            let name = joint.name(machine.linkages());
            Some(GrossInput {
                kind: GrossInputKind::ActuatorScale,
                headline: say!(
                    "The force of {name} is {} of the weight: force or pressure is in another unit",
                    percent(force / weight)
                ),
                evidence: vec![say!(
                    "Median {} N, from {}; the machine weighs {} N",
                    short(force),
                    topics.join(", "),
                    short(weight)
                )],
                fix: word!(
                    "add a scale to the bound field: 1000 for kN, 100000 for bar, 1000000 for MPa"
                )
                .into(),
            })
        })
        .collect()
}

/// The measured load of a support.
struct MeasuredSupport<'a> {
    support: SupportId,
    name: &'a str,
    topic: &'a str,
    recording: &'a Recording,
    factor: f64,
}

/// Supports whose measured loads cannot bear the weight that is on them: they are in another unit.
pub(super) fn support_scale(loaded: &LoadedLog) -> Option<GrossInput> {
    let machine = &loaded.machine;
    let weight = machine.mass() * machine.gravity();
    let measured = measured_supports(loaded);
    let is_measured = |support: &SupportId| measured.iter().any(|m| m.support == *support);
    let mut values: Vec<_> = measured.iter().map(|m| m.recording.reader()).collect();
    let (mut whole, mut part) = (Vec::new(), Vec::new());
    let stamps = measured.first()?.recording.stamps_ns.iter();
    for &time_ns in stamps {
        let on = match &loaded.supports {
            None => machine.stands_on(),
            Some(timeline) => match timeline.on_at(time_ns) {
                Some(on) => on,
                None => continue,
            },
        };
        let mut found: Option<f64> = None;
        for (measured, values) in measured.iter().zip(&mut values) {
            // the last sample until then
            let next = (measured.recording.stamps_ns).partition_point(|&stamp| stamp <= time_ns);
            if on.contains(&measured.support)
                && let Some(last) = next.checked_sub(1)
            {
                let force = measured.factor * values.sample(last)[0];
                *found.get_or_insert(0.0) += force;
            }
        }
        match on.iter().all(is_measured) {
            true => whole.extend(found),
            false => part.extend(found),
        }
    }
    let (sums, [least, largest], which) = match whole.len() >= FEWEST_SUMS {
        true => (whole, SUM_SHARE, word!("all supports on the ground")),
        false => (
            part,
            PART_SHARE,
            word!("some of the supports on the ground"),
        ),
    };
    if sums.len() < FEWEST_SUMS {
        return None;
    }
    let sum = median(sums)?;
    let share = sum / weight;
    if sum == 0.0 || (least..=largest).contains(&share) {
        return None;
    }
    let names: Vec<&str> = measured.iter().map(|m| m.name).collect();
    let mut topics: Vec<&str> = measured.iter().map(|m| m.topic).collect();
    topics.dedup();
    Some(GrossInput {
        kind: GrossInputKind::ActuatorScale,
        headline: say!(
            "The measured loads of {} are {} of the weight: the forces are in another unit",
            names.join(", "),
            percent(share)
        ),
        evidence: vec![say!(
            "Median of the sum over {which} {} N, from {}; the machine weighs {} N",
            short(sum),
            topics.join(", "),
            short(weight)
        )],
        fix: unit_of(share),
    })
}

fn measured_supports(loaded: &LoadedLog) -> Vec<MeasuredSupport<'_>> {
    let joints = &loaded.machine.contact().actuated_joints;
    let measured = loaded.signals.iter().filter_map(|signal| {
        let Sensor::Number(NumberKind::Actuator, at) = signal.sensor else {
            return None;
        };
        let of_joint = &loaded.matched.sensors.actuators[at];
        let joint = &joints[of_joint.joint];
        let ForceSource::Support { name, support, .. } = &joint.source else {
            return None;
        };
        Some(MeasuredSupport {
            support: *support,
            name,
            topic: &signal.topic,
            recording: &signal.recording,
            factor: joint.signals[of_joint.signal],
        })
    });
    measured.collect()
}

/// The likely correction, by the share of the weight that was measured.
fn unit_of(share: f64) -> String {
    if share < 0.0 {
        return word!("a negative scale in the bound fields: a force that presses the support on the ground is positive").into();
    }
    let off = |newtons: f64| (share * newtons).ln().abs();
    let nearest = UNITS
        .into_iter()
        .min_by(|(_, a), (_, b)| off(*a).total_cmp(&off(*b)));
    match nearest.filter(|(_, newtons)| off(*newtons) < UNIT_WITHIN.ln()) {
        Some((unit, newtons)) => {
            say!(
                "they look like {}: add scale = {} to the bound fields",
                told(unit),
                digits(newtons)
            )
        }
        None => {
            word!("check the unit of the bound fields (N) and the masses of the URDF (kg)").into()
        }
    }
}
