//! Samples, verdicts and commands as ROS 2 messages, bit for bit.

use tipwatch_binding::hex;
use tipwatch_mechanics::machine::Proof;
use tipwatch_mechanics::state::{Sample, Sensor};
use tipwatch_suspension::MAX_ACTUATORS;

use super::cdr::Cdr;
use super::pending::{Dropped, Encoded, Kind};
use super::topics::{
    COMMAND_COUNTS, COMMAND_INTEGERS, COMMAND_LISTS, COMMAND_TIMES, VERDICT_COUNTS,
    VERDICT_INTEGERS, VERDICT_NUMBERS, VERDICT_TIMES,
};
use crate::wire::names::Names;
use crate::wire::topics::{WireCommand, WireMachine, WireVerdict};

/// A sample. `joint_names` are those of its stream, `imu_frame` is that of the IMU.
pub(super) fn sample(sample: &Sample<'_>, joint_names: &[String], imu_frame: &str) -> Vec<u8> {
    let mut cdr = Cdr::with_capacity(1024);
    let (stamp_ns, values) = (sample.stamp_ns, sample.values);
    match sample.sensor {
        Sensor::Joints(_) => {
            cdr.header(stamp_ns, "");
            cdr.u32(joint_names.len() as u32);
            joint_names.iter().for_each(|name| cdr.text(name));
            let (positions, rates) = values.split_at(values.len() / 2);
            cdr.list(positions);
            cdr.list(rates);
            cdr.list(&[]);
        }
        Sensor::Imu => {
            cdr.header(stamp_ns, imu_frame);
            let attitude = &values[6..10];
            cdr.f64s(attitude);
            let mut covariance = [0.0; 9];
            if attitude.iter().any(|q| q.is_nan()) {
                // by convention: an IMU without attitude
                covariance[0] = -1.0;
            }
            cdr.f64s(&covariance);
            cdr.f64s(&values[3..6]);
            cdr.f64s(&[0.0; 9]);
            cdr.f64s(&values[..3]);
            cdr.f64s(&[0.0; 9]);
        }
        Sensor::Odometry => {
            cdr.header(stamp_ns, "odom");
            cdr.text("base_link");
            cdr.f64s(&[0.0; 3]);
            cdr.f64s(&values[6..10]);
            cdr.f64s(&[0.0; 36]);
            cdr.f64s(&values[..6]);
            cdr.f64s(&[0.0; 36]);
        }
        Sensor::ToolWrench => {
            cdr.header(stamp_ns, "");
            cdr.f64s(&values[..6]);
        }
        Sensor::Number(..) => {
            cdr.header(stamp_ns, "");
            cdr.f64s(&values[..1]);
        }
    }
    cdr.finish()
}

/// Encodes what a monitor says about itself, in the order of its topic's definition. A text that is not UTF-8 becomes empty.
pub(super) fn program(wire: &WireMachine) -> Vec<u8> {
    let text = |bytes: &[u8]| {
        let end = bytes.iter().position(|&byte| byte == 0);
        let text = std::str::from_utf8(&bytes[..end.unwrap_or(bytes.len())]);
        text.unwrap_or_default().to_owned()
    };
    let mut cdr = Cdr::with_capacity(1024);
    cdr.header(wire.time_ns, "");
    cdr.text(&text(&wire.version));
    cdr.text(&text(&wire.options));
    for hash in [
        wire.program_sha256,
        wire.options_sha256,
        wire.machine_sha256,
        wire.urdf_sha256,
        wire.commissioning_sha256,
    ] {
        let is_known = hash.iter().any(|&byte| byte != 0);
        cdr.text(&if is_known { hex(&hash) } else { String::new() });
    }
    cdr.u64(wire.source);
    let count = (wire.doubted_count as usize).min(wire.doubted_signals.len());
    cdr.u32(count as u32);
    numbers(&mut cdr, &wire.doubted_signals[..count]);
    cdr.list(&wire.doubted_by[..count]);
    cdr.list(&wire.doubted_moved[..count]);
    let count = (wire.known_count as usize).min(wire.known_joints.len());
    cdr.u32(count as u32);
    numbers(&mut cdr, &wire.known_joints[..count]);
    cdr.list(&wire.known_stamps_us[..count]);
    cdr.list(&wire.known_positions[..count]);
    let names = Names::try_from(wire).unwrap_or_default();
    let proofs = || Proof::all(names.joints.len());
    let joint = |joint: usize| names.joint(joint);
    texts(&mut cdr, proofs().map(|proof| proof.name(joint)));
    texts(&mut cdr, proofs().map(|proof| names.way(proof)));
    cdr.finish()
}

/// A sequence of texts.
fn texts(cdr: &mut Cdr, texts: impl Iterator<Item = String>) {
    let texts: Vec<String> = texts.collect();
    cdr.u32(texts.len() as u32);
    texts.iter().for_each(|text| cdr.text(text));
}

/// A sequence of whole numbers.
fn numbers(cdr: &mut Cdr, values: &[u32]) {
    cdr.u32(values.len() as u32);
    values.iter().for_each(|&value| cdr.u32(value));
}

/// A verdict, in the order of its topic's definition.
pub(crate) fn verdict(verdict: &WireVerdict, names: &Names) -> Vec<u8> {
    let mut cdr = Cdr::with_capacity(2048);
    cdr.header(verdict.time_ns, "");
    VERDICT_INTEGERS
        .iter()
        .for_each(|(_, of)| cdr.u32(of(verdict)));
    VERDICT_COUNTS
        .iter()
        .for_each(|(_, of)| cdr.u64(of(verdict)));
    VERDICT_TIMES
        .iter()
        .for_each(|(_, of)| cdr.i64(of(verdict)));
    VERDICT_NUMBERS
        .iter()
        .for_each(|(_, of)| cdr.f64(of(verdict)));
    names.each_number(verdict, |number| cdr.f64(number));
    cdr.finish()
}

/// A command, in the order of its topic's definition.
pub(super) fn command(command: &WireCommand) -> Vec<u8> {
    let mut cdr = Cdr::with_capacity(512);
    cdr.header(command.time_ns, "");
    cdr.text(command.mode().name());
    cdr.text(command.status_name());
    cdr.u32(command.reasons().iter().count() as u32);
    for reason in command.reasons().iter() {
        cdr.text(reason.name());
    }
    COMMAND_INTEGERS
        .iter()
        .for_each(|(_, of)| cdr.u32(of(command)));
    COMMAND_COUNTS
        .iter()
        .for_each(|(_, of)| cdr.u64(of(command)));
    COMMAND_TIMES
        .iter()
        .for_each(|(_, of)| cdr.i64(of(command)));
    let actuators = (command.actuator_count as usize).min(MAX_ACTUATORS);
    let lists = COMMAND_LISTS.iter();
    lists.for_each(|(_, of)| cdr.list(&of(command)[..actuators]));
    cdr.f64(command.cost);
    cdr.finish()
}

/// The message that tells of a loss.
pub(super) fn gap_message(session_ns: i64, log_time_ns: i64, dropped: Dropped) -> Encoded {
    Encoded {
        kind: Kind::Gap,
        sequence: 0,
        session_ns,
        log_time_ns,
        publish_time_ns: log_time_ns,
        data: gap(log_time_ns, dropped.samples, dropped.verdicts),
    }
}

/// A gap: messages that could not be written.
fn gap(stamp_ns: i64, samples: u64, verdicts: u64) -> Vec<u8> {
    let mut cdr = Cdr::with_capacity(64);
    cdr.header(stamp_ns, "");
    cdr.u64(samples);
    cdr.u64(verdicts);
    cdr.finish()
}
