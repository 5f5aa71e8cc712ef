//! Attitudes: rotations at all, in agreement with the specific force, and measuring a tilt.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::{Note, NoteKind};
use tipwatch_mechanics::state::{Sensor, tilt_is_measured};

use super::windows::{median, of_windows};
use super::{GrossInput, GrossInputKind};
use crate::base::number::{percent, short};
use crate::load::{LoadedLog, Signal};

/// Deviation of a quaternion's length from one that no rounding explains.
const LENGTH_TOLERANCE: f64 = 0.1;
/// Share of quaternions of such a length from which the signal is no attitude.
const MOST_NOT_UNIT: f64 = 0.5;
/// Angle between up by attitude and by specific force, the median over windows of one second, that no
/// acceleration of a machine explains (degrees).
const LARGEST_ANGLE_DEG: f64 = 40.0;
/// Fewest windows of that comparison.
const FEWEST_WINDOWS: usize = 3;

/// First value of the quaternion x y z w in a sample of an IMU or of odometry.
const FIRST: usize = 6;

/// Attitudes that are no rotations or that contradict the specific force.
pub(super) fn faults(loaded: &LoadedLog) -> Vec<GrossInput> {
    let signals = loaded.signals.iter();
    let with_attitude =
        signals.filter(|signal| matches!(signal.sensor, Sensor::Imu | Sensor::Odometry));
    with_attitude
        .filter_map(|signal| not_unit(signal).or_else(|| contradicts_gravity(signal)))
        .collect()
}

/// Without an IMU the loads follow from the attitude of the odometry: one without tilt leaves the slope unknown.
pub(super) fn slope_unknown(loaded: &LoadedLog) -> Option<GrossInput> {
    if loaded.matched.sensors.imu {
        return None;
    }
    let signal = (loaded.signals.iter()).find(|signal| signal.sensor == Sensor::Odometry)?;
    let samples = signal.recording.stamps_ns.len();
    if samples == 0 || quaternions(signal).any(|xyzw| tilt_is_measured(&xyzw)) {
        return None;
    }
    let evidence = match given(signal).count() {
        0 => say!("No orientation in {samples} messages of {}", signal.topic),
        count => say!(
            "Roll and pitch are exactly 0 in all {count} orientations of {}",
            signal.topic
        ),
    };
    Some(GrossInput {
        kind: GrossInputKind::SlopeUnknown,
        headline: word!("Nothing in the log measures the slope of the ground: the odometry is planar and there is no IMU")
            .into(),
        evidence: vec![evidence, word!("Level ground is not assumed").into()],
        fix: word!("bind an IMU, or an attitude that measures roll and pitch").into(),
    })
}

/// A note if the IMU's attitude does not measure a tilt: slope and causes are then unknown, loads are not.
#[must_use]
pub(crate) fn notes_on_slope(loaded: &LoadedLog) -> Option<String> {
    let signal = (loaded.signals.iter()).find(|signal| signal.sensor == Sensor::Imu)?;
    if measures_tilt(signal) {
        return None;
    }
    let count = Some(given(signal).count()).filter(|count| *count > 0)?;
    Some(say!(
        "{}: roll and pitch are exactly 0 in all {count} orientations. They are treated as not measured: the slope of \
         the ground is unknown, not 0 degrees. Loads follow from the specific force and are not affected.",
        signal.topic
    ))
}

/// Returns the note about an IMU whose specific force is compared with no attitude, with the remaining tests of its mounting.
pub(crate) fn untested_mounting(loaded: &LoadedLog) -> Option<Note> {
    let mut with_attitude = (loaded.signals.iter())
        .filter(|signal| matches!(signal.sensor, Sensor::Imu | Sensor::Odometry));
    let is_untested = loaded.matched.sensors.imu && !with_attitude.any(measures_tilt);
    is_untested.then(|| {
        let text = match measures_speed(loaded) {
            true => {
                word!("Mounting and signs of the IMU are tested by the speed alone, because no attitude is logged: where the machine speeds up, \
                 brakes or turns after a rest. An error that this does not show is found only by a check at the machine.")
            }
            false => {
                word!("Not tested by any signal of this log: mounting and signs of the IMU, because neither an attitude nor a speed is logged \
                 that its specific force could be compared with. An error there is found only by a check at the machine.")
            }
        };
        Note::new(NoteKind::Untested, text.into())
    })
}

/// Whether the log has the velocity of the machine, or of its wheels.
fn measures_speed(loaded: &LoadedLog) -> bool {
    let mut joints = loaded.machine.joints().iter();
    loaded.matched.sensors.odometry || joints.any(|it| it.spins_wheel.is_some() && it.logged)
}

/// Whether a signal has an orientation with roll and pitch; the first one is enough.
fn measures_tilt(signal: &Signal) -> bool {
    given(signal).any(|xyzw| tilt_is_measured(&xyzw))
}

/// The orientations that are given.
fn given(signal: &Signal) -> impl Iterator<Item = [f64; 4]> {
    quaternions(signal).filter(|xyzw| xyzw.iter().all(|v| v.is_finite()))
}

fn quaternions(signal: &Signal) -> impl Iterator<Item = [f64; 4]> {
    let mut reader = signal.recording.reader();
    (0..signal.recording.len()).map(move |at| {
        let sample = reader.sample(at);
        [0, 1, 2, 3].map(|i| sample[FIRST + i])
    })
}

fn not_unit(signal: &Signal) -> Option<GrossInput> {
    let lengths = || {
        quaternions(signal)
            .map(|xyzw| xyzw.iter().map(|v| v * v).sum::<f64>().sqrt())
            .filter(|length| length.is_finite() && *length > 0.0)
    };
    let (mut count, mut wrong) = (0_usize, 0_usize);
    for length in lengths() {
        count += 1;
        wrong += usize::from((length - 1.0).abs() > LENGTH_TOLERANCE);
    }
    let share = wrong as f64 / count as f64;
    // NaN, where no quaternion has a length, is no finding either
    if !(share > MOST_NOT_UNIT) {
        return None;
    }
    Some(GrossInput {
        kind: GrossInputKind::Attitude,
        headline: say!(
            "The orientations of {} are no rotations: their quaternions do not have length 1",
            signal.topic
        ),
        evidence: vec![say!(
            "Median length {} of {} quaternions, {} of them beyond 1 ± {LENGTH_TOLERANCE}",
            short(median(lengths()).unwrap_or(f64::NAN)),
            count,
            percent(share)
        )],
        fix: word!("bind the quaternion in the order x, y, z, w, without a scale, or roll_pitch_yaw in radians").into(),
    })
}

/// Finds a contradiction between the attitude and the specific force of an IMU: both are in its own axes, so its mounting plays
/// no part.
fn contradicts_gravity(signal: &Signal) -> Option<GrossInput> {
    if signal.sensor != Sensor::Imu {
        return None;
    }
    let angles: Vec<f64> = of_windows(&signal.recording, |reader, window| {
        let (mut up, mut force) = (Vector3::zeros(), Vector3::zeros());
        for at in window {
            let sample = reader.sample(at);
            let [x, y, z, w] = [6, 7, 8, 9].map(|at| sample[at]);
            let quaternion = Quaternion::new(w, x, y, z);
            let measured = Vector3::new(sample[0], sample[1], sample[2]);
            let is_known = (quaternion.norm() - 1.0).abs() < LENGTH_TOLERANCE
                && tilt_is_measured(&sample[FIRST..])
                && measured.iter().all(|c| c.is_finite());
            if is_known {
                let attitude = UnitQuaternion::from_quaternion(quaternion);
                up += attitude.inverse_transform_vector(&Vector3::z());
                force += measured;
            }
        }
        let angle = up.angle(&force).to_degrees();
        (up.norm() > 0.0 && force.norm() > 0.0 && angle.is_finite()).then_some(angle)
    });
    let angle = median(angles.iter().copied())?;
    if angles.len() < FEWEST_WINDOWS || angle <= LARGEST_ANGLE_DEG {
        return None;
    }
    Some(GrossInput {
        kind: GrossInputKind::Attitude,
        headline: say!(
            "Orientation and specific force of {} disagree on where up is by {angle:.0} degrees",
            signal.topic
        ),
        evidence: vec![say!(
            "Median over {} windows of one second; one of the two is wrong",
            angles.len()
        )],
        fix: word!("an orientation in degrees, or one whose z axis points down, or a specific force of the opposite sign: \
              correct it by scale in [signals.imu], or bind the IMU without its orientation")
            .into(),
    })
}
