//! Unit of the odometry's velocity by the wheels, and left and right wheels by the turn of the machine.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use tipwatch_language::{message, say, told, word};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Sensor;

use super::proportion::{Proportion, Unit, scale_hint, unit_by_factor};
use super::slots::{self, Sums};
use super::windows::median;
use super::{GrossInput, GrossInputKind};
use crate::base::number::short;
use crate::events::FoundRotation;
use crate::load::{LoadedLog, Signal};

/// Proportion of odometry and wheels, or its inverse, that no slip of all wheels explains.
const LARGEST_PROPORTION: f64 = 1.8;
/// Fewest slots of half a second of a comparison.
const FEWEST: usize = 6;
/// Smallest root mean square velocity of a machine that drives (m/s).
const DRIVING: f64 = 0.05;
/// Smallest root mean square angular velocity of a machine that turns (rad/s).
const TURNING: f64 = 0.03;
/// The odometry's velocity relative to radius times wheel velocity.
const UNITS: [Unit; 8] = [
    (message!("kilometres per hour"), 3.6),
    (message!("miles per hour"), 2.236_936),
    (message!("centimetres per second"), 100.0),
    (message!("millimetres per second"), 1000.0),
    (
        message!("wheel velocities in degrees per second"),
        1.0 / 57.295_78,
    ),
    (
        message!("wheel velocities in revolutions per minute"),
        1.0 / 9.549_3,
    ),
    (
        message!("wheel velocities in revolutions per second"),
        std::f64::consts::TAU,
    ),
    (
        message!("a diameter given as the radius of the wheels"),
        0.5,
    ),
];

/// The velocity of a wheel's circumference, by slot.
struct WheelSpeed {
    wheel: usize,
    /// 1 where a positive velocity rolls the machine forward by its URDF, else -1.
    rolls: f64,
    by_slot: BTreeMap<i64, f64>,
}

/// Mean forward velocity by slot, where the machine stands on its wheels: those of a machine that falls or lies on its side spin.
fn forward_speeds(odometry: &Signal, rotations: &[FoundRotation]) -> BTreeMap<i64, f64> {
    let mut reader = odometry.recording.reader();
    let mut speeds = slots::means(&odometry.recording.stamps_ns, |at| reader.sample(at)[0]);
    for rotation in rotations {
        slots::leave_out(&mut speeds, rotation.span_ns());
    }
    speeds
}

/// An odometry velocity that does not fit the wheels.
pub(super) fn scale(loaded: &LoadedLog, rotations: &[FoundRotation]) -> Option<GrossInput> {
    let odometry = of(loaded, Sensor::Odometry)?;
    let forward = forward_speeds(odometry, rotations);
    let mut factors = Vec::new();
    let mut evidence = Vec::new();
    for speed in wheel_speeds(loaded) {
        let proportion = compared(&speed.by_slot, &forward);
        let [wheel, odometry] = proportion.sizes();
        if proportion.pairs < FEWEST || wheel.max(odometry) < DRIVING {
            continue;
        }
        let factor = proportion.factor();
        // a wheel that stands tells nothing, one that turns in no proportion contradicts the others
        if factor.is_some() || wheel > DRIVING {
            factors.push(factor.map(f64::abs));
        }
        if let Some(factor) = factor {
            evidence.push(say!(
                "Wheel {}: the odometry is {} times radius times wheel velocity, over {} half seconds",
                loaded.machine.wheels()[speed.wheel].name,
                short(factor),
                proportion.pairs
            ));
        }
    }
    let factor = agreed(&factors)?;
    if (1.0 / LARGEST_PROPORTION..=LARGEST_PROPORTION).contains(&factor) {
        return None;
    }
    let unit = unit_by_factor(factor, &UNITS);
    let looks_like = match unit {
        Some((name, _)) => say!("it looks like {}", told(name)),
        None => word!("one of the two is in another unit").to_owned(),
    };
    Some(GrossInput {
        kind: GrossInputKind::OdometryScale,
        headline: say!(
            "The velocity on {} does not fit the wheels: {looks_like}",
            odometry.topic
        ),
        evidence,
        fix: match unit {
            Some((name, factor)) if name.starts_with("wheel") || factor < 1.0 => {
                word!("correct the radius of the wheels, or the scale of their velocities in [signals.joints]").into()
            }
            _ => say!(
                "{}; bind the velocity with it in [signals.odometry]",
                scale_hint(factor, unit)
            ),
        },
    })
}

/// The median of the factors of the wheels that turn, if most of them agree with it as far as slip allows. A unit is the same at every
/// wheel: wheels that contradict each other slip, or are wrong one by one, as are those that have no factor.
fn agreed(factors: &[Option<f64>]) -> Option<f64> {
    let known = || factors.iter().flatten().copied();
    let factor = median(known())?;
    let agrees = |other: &f64| (*other / factor).ln().abs() < LARGEST_PROPORTION.ln();
    let agreeing = known().filter(agrees).count();
    (2 * agreeing > factors.len()).then_some(factor)
}

/// Left and right wheel velocities that differ the wrong way round when the machine turns.
pub(super) fn exchanged(loaded: &LoadedLog, rotations: &[FoundRotation]) -> Option<GrossInput> {
    let machine = &loaded.machine;
    let odometry = of(loaded, Sensor::Odometry)?;
    let imu = of(loaded, Sensor::Imu)?;
    if machine.imu().body != 0 {
        return None;
    }
    let forward = forward_speeds(odometry, rotations);
    let mount = machine.imu().body_from_mount.rotation;
    let mut reader = imu.recording.reader();
    let mut turn = slots::means(&imu.recording.stamps_ns, |at| {
        let sample = reader.sample(at);
        (mount * Vector3::new(sample[3], sample[4], sample[5])).z
    });
    for rotation in rotations {
        slots::leave_out(&mut turn, rotation.span_ns());
    }
    let mut differences: BTreeMap<i64, f64> = BTreeMap::new();
    let speeds = wheel_speeds(loaded);
    // joint axes may point to either side: forward is positive
    let mut signed: Vec<(&WheelSpeed, f64)> = (speeds.iter())
        .filter_map(|speed| {
            let factor = compared(&speed.by_slot, &forward).factor()?;
            Some((speed, factor.signum()))
        })
        .collect();
    // odometry that points backwards turns all of them, and says nothing of left and right
    if signed
        .iter()
        .all(|(speed, forward)| speed.rolls == -forward)
    {
        for (speed, forward) in &mut signed {
            *forward = speed.rolls;
        }
    }
    for (left, of_left) in &signed {
        for (right, of_right) in &signed {
            let track = lateral(machine, left.wheel) - lateral(machine, right.wheel);
            let apart = machine.wheels()[left.wheel].centre_at_zero.x
                - machine.wheels()[right.wheel].centre_at_zero.x;
            if track > 0.0 && apart.abs() < 0.1 * track {
                for (slot, velocity) in &left.by_slot {
                    if let Some(other) = right.by_slot.get(slot) {
                        let difference = (of_right * other - of_left * velocity) / track;
                        differences.insert(*slot, difference);
                    }
                }
            }
        }
    }
    let proportion = compared(&turn, &differences);
    let factor = proportion.factor()?;
    let [turning, by_wheels] = proportion.sizes();
    if factor > -0.3 || proportion.pairs < FEWEST || turning.min(by_wheels) < TURNING {
        return None;
    }
    Some(GrossInput {
        kind: GrossInputKind::WheelsExchanged,
        headline: word!("Left and right wheel velocities contradict the turn of the machine: left and right seem exchanged")
            .into(),
        evidence: vec![say!(
            "The turn by the wheels is {} times that of the IMU, over {} half seconds",
            short(factor),
            proportion.pairs
        )],
        fix: word!("exchange the names or links of the left and right wheels or joints, or correct the sign of the IMU's \
              angular velocity")
            .into(),
    })
}

fn of(loaded: &LoadedLog, sensor: Sensor) -> Option<&Signal> {
    loaded.signals.iter().find(|signal| signal.sensor == sensor)
}

fn lateral(machine: &Machine, wheel: usize) -> f64 {
    machine.wheels()[wheel].centre_at_zero.y
}

/// The axis of a body's joint in base axes, with all joints at zero.
fn axis_at_zero(machine: &Machine, mut body: usize) -> Vector3<f64> {
    let mut axis = Vector3::z();
    // the root has no joint
    while body != 0 {
        let of = &machine.bodies()[body];
        axis = of.parent_from_joint * axis;
        body = of.parent;
    }
    axis
}

fn compared(x: &BTreeMap<i64, f64>, y: &BTreeMap<i64, f64>) -> Proportion {
    let mut proportion = Proportion::default();
    for (x, y) in slots::pairs(x, y) {
        proportion.add(x, y);
    }
    proportion
}

/// Radius times velocity of every wheel whose joint is logged.
fn wheel_speeds(loaded: &LoadedLog) -> Vec<WheelSpeed> {
    let machine = &loaded.machine;
    let mut speeds = Vec::new();
    for signal in loaded.signals.iter() {
        let Some(joints) = loaded.matched.sensors.joints_of(signal.sensor) else {
            continue;
        };
        let mut wheels = Vec::new();
        for (column, &joint) in joints.iter().enumerate() {
            let Some(wheel) = machine.joints()[joint].spins_wheel else {
                continue;
            };
            let body = machine.bodies_of_joint(joint).next();
            let rolls = body.map_or(1.0, |body| axis_at_zero(machine, body).y.signum());
            wheels.push((wheel, rolls, joints.len() + column, Sums::default()));
        }
        let mut reader = signal.recording.reader();
        if wheels.is_empty() {
            continue;
        }
        for (at, &stamp_ns) in signal.recording.stamps_ns.iter().enumerate() {
            let sample = reader.sample(at);
            for (wheel, _, velocity, sums) in &mut wheels {
                sums.add(
                    stamp_ns,
                    machine.wheels()[*wheel].radius * sample[*velocity],
                );
            }
        }
        speeds.extend(
            wheels
                .into_iter()
                .map(|(wheel, rolls, _, sums)| WheelSpeed {
                    wheel,
                    rolls,
                    by_slot: sums.means(),
                }),
        );
    }
    speeds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_that_of_most_wheels() {
        let agreed = |factors: &[f64]| agreed(&Vec::from_iter(factors.iter().copied().map(Some)));
        assert_eq!(agreed(&[]), None);
        assert_eq!(agreed(&[3.6]), Some(3.6));
        assert_eq!(agreed(&[0.474, 2.174]), None);
        assert_eq!(agreed(&[2.174, 0.474]), None);
        // one of four slips
        assert_eq!(agreed(&[3.6, 0.5, 3.6, 3.6]), Some(3.6));
        assert_eq!(agreed(&[3.6, 0.5, 3.6, 0.5]), None);
    }

    #[test]
    fn one_wheel_in_proportion_is_not_most_of_four_that_turn() {
        assert_eq!(agreed(&[Some(17.0), None, None, None]), None);
        assert_eq!(agreed(&[Some(3.6), None, Some(3.6), Some(3.6)]), Some(3.6));
    }
}
