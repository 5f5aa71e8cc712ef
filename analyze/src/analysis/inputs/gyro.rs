//! Unit of the angular velocity, by the change of the attitude and by the odometry.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use tipwatch_language::{message, say, told, word};
use tipwatch_mechanics::state::Sensor;

use super::proportion::{Proportion, Unit, digits, unit_by_factor};
use super::slots;
use super::{GrossInput, GrossInputKind};
use crate::base::number::short;
use crate::load::{LoadedLog, Signal};

/// Time over which a rotation is compared with the integral of the angular velocity (ns).
const STEP_NS: i64 = 200_000_000;
/// Longest step between samples (ns).
const LONGEST_STEP_NS: i64 = 100_000_000;
/// Proportion, or its inverse, that no delay, filter or slip explains.
const LARGEST_PROPORTION: f64 = 4.0;
/// Fewest comparisons.
const FEWEST: usize = 10;
/// Smallest root mean square rotation of a step, or angular velocity, that is evidence (rad or rad/s).
const TURNING: f64 = 0.004;
const UNITS: [Unit; 3] = [
    (message!("degrees per second"), 57.295_78),
    (message!("thousandths of a radian per second"), 1000.0),
    (message!("revolutions per minute"), 9.549_3),
];

/// An angular velocity of the IMU that is not the change of an attitude or of the heading.
pub(super) fn scale(loaded: &LoadedLog) -> Option<GrossInput> {
    let imu = loaded.signals.iter().find(|s| s.sensor == Sensor::Imu)?;
    let (proportion, compared) = match by_attitude(imu) {
        by_attitude if is_telling(&by_attitude) => {
            (by_attitude, word!("the change of its orientation"))
        }
        _ => (
            by_odometry(loaded, imu)?,
            word!("the angular velocity of the odometry about the vertical"),
        ),
    };
    let factor = proportion.factor().filter(|_| is_telling(&proportion))?;
    if (1.0 / LARGEST_PROPORTION..=LARGEST_PROPORTION).contains(&factor.abs()) {
        return None;
    }
    let unit = unit_by_factor(factor.abs(), &UNITS);
    let looks_like = match unit {
        Some((name, _)) => say!("it looks like {}", told(name)),
        None => word!("its unit is wrong").to_owned(),
    };
    let scale = unit.map_or(factor.abs(), |unit| unit.1);
    Some(GrossInput {
        kind: GrossInputKind::AngularVelocityScale,
        headline: say!(
            "The angular velocity of {} is not in rad/s: {looks_like}",
            imu.topic
        ),
        evidence: vec![say!(
            "It is {} times {compared}, over {} comparisons",
            short(factor),
            proportion.pairs
        )],
        fix: say!(
            "bind the components with scale = {} in [signals.imu]",
            digits(1.0 / scale)
        ),
    })
}

fn is_telling(proportion: &Proportion) -> bool {
    let [reference, turning] = proportion.sizes();
    proportion.pairs >= FEWEST && reference.min(turning) > TURNING && proportion.factor().is_some()
}

/// Angular velocity, integrated, against the rotation between two orientations, by component.
fn by_attitude(imu: &Signal) -> Proportion {
    let recording = &imu.recording;
    let mut reader = recording.reader();
    let mut proportion = Proportion::default();
    let mut start: Option<(i64, UnitQuaternion<f64>)> = None;
    let mut turned = Vector3::zeros();
    let mut last_ns = i64::MIN;
    for (at, &stamp_ns) in recording.stamps_ns.iter().enumerate() {
        let sample = reader.sample(at);
        let quaternion = Quaternion::new(sample[9], sample[6], sample[7], sample[8]);
        let step_ns = stamp_ns.saturating_sub(last_ns);
        last_ns = stamp_ns;
        if !((quaternion.norm() - 1.0).abs() < 0.1) || !(1..=LONGEST_STEP_NS).contains(&step_ns) {
            (start, turned) = (None, Vector3::zeros());
            continue;
        }
        let attitude = UnitQuaternion::from_quaternion(quaternion);
        turned += Vector3::new(sample[3], sample[4], sample[5]) * (step_ns as f64 * 1e-9);
        match start {
            Some((since_ns, before)) if stamp_ns.saturating_sub(since_ns) >= STEP_NS => {
                let rotation = (before.inverse() * attitude).scaled_axis();
                for (&rotated, &integrated) in rotation.iter().zip(turned.iter()) {
                    proportion.add(rotated, integrated);
                }
                (start, turned) = (Some((stamp_ns, attitude)), Vector3::zeros());
            }
            Some(_) => {}
            None => (start, turned) = (Some((stamp_ns, attitude)), Vector3::zeros()),
        }
    }
    proportion
}

/// Size of the angular velocity against that of the odometry about the vertical, in slots of half a second: the
/// axes of the IMU play no part.
fn by_odometry(loaded: &LoadedLog, imu: &Signal) -> Option<Proportion> {
    let odometry = (loaded.signals.iter()).find(|signal| signal.sensor == Sensor::Odometry)?;
    let (mut imu_reader, mut odometry_reader) =
        (imu.recording.reader(), odometry.recording.reader());
    let size = |at: usize| {
        let sample = imu_reader.sample(at);
        Vector3::new(sample[3], sample[4], sample[5]).norm()
    };
    let of_imu = slots::means(&imu.recording.stamps_ns, size);
    let of_odometry = slots::means(&odometry.recording.stamps_ns, |at| {
        odometry_reader.sample(at)[5].abs()
    });
    let mut proportion = Proportion::default();
    for (reference, turning) in slots::pairs(&of_odometry, &of_imu) {
        proportion.add(reference, turning);
    }
    // a size alone always correlates: the odometry must turn clearly
    (proportion.sizes()[0] > 0.1).then_some(proportion)
}
