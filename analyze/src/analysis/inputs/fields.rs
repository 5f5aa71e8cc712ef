//! Angles that the machine file binds one by one: roll and pitch beyond a full circle are in degrees.

use std::f64::consts::PI;

use anyhow::Result;
use tipwatch_binding::{MachineFile, number_field};
use tipwatch_ingest::{FieldRequest, LARGEST_TILT_RAD, Log, record_fields};
use tipwatch_language::say;
use tipwatch_mechanics::machine::{NumberSpec, SignalSpec};

use super::proportion::digits;
use super::{GrossInput, GrossInputKind};
use crate::base::number::{percent, short};

/// Largest roll, pitch and yaw, which may count turns (rad).
const LARGEST_RAD: [f64; 3] = [LARGEST_TILT_RAD, LARGEST_TILT_RAD, 40.0];
/// Largest roll and pitch in degrees. A value beyond marks a missing one.
const LARGEST_TILT_DEG: f64 = 361.0;
/// Share of values beyond that from which the unit is wrong.
const LEAST_SHARE: f64 = 0.05;

/// Attitudes bound as roll, pitch and yaw whose values are no angles in radians.
///
/// # Errors
/// The log cannot be read.
pub(super) fn angles_in_degrees(log: &Log, file: &MachineFile) -> Result<Vec<GrossInput>> {
    let signals = &file.spec.signals;
    let of_imu = (signals.imu.as_ref())
        .and_then(SignalSpec::fields)
        .and_then(|imu| imu.roll_pitch_yaw.as_ref());
    let of_odometry = (signals.odometry.as_ref())
        .and_then(SignalSpec::fields)
        .and_then(|odometry| odometry.roll_pitch_yaw.as_ref());
    let mut found = Vec::new();
    for (signal, angles) in [("imu", of_imu), ("odometry", of_odometry)] {
        if let Some(angles) = angles {
            found.extend(in_degrees(log, signal, angles)?);
        }
    }
    Ok(found)
}

fn in_degrees(log: &Log, signal: &str, angles: &[NumberSpec; 3]) -> Result<Option<GrossInput>> {
    let mut beyond = Vec::new();
    let mut is_scaled = false;
    for ((name, number), largest) in ["roll", "pitch", "yaw"].iter().zip(angles).zip(LARGEST_RAD) {
        let Some(field) = number.field() else {
            continue;
        };
        let request = FieldRequest {
            topic: field.topic.clone(),
            number: number_field(field, ""),
        };
        let (recordings, _) = record_fields(log, &[request], None)?;
        let values = recordings.iter().flat_map(|r| r.values.iter().copied());
        let values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
        let is_degrees = |value: &f64| {
            value.abs() > largest && (*name == "yaw" || value.abs() < LARGEST_TILT_DEG)
        };
        let wrong: Vec<f64> = values.iter().copied().filter(is_degrees).collect();
        let share = wrong.len() as f64 / values.len() as f64;
        // one value again and again stands for none
        let varies = wrong.windows(2).any(|pair| pair[0] != pair[1]);
        if share < LEAST_SHARE || !varies {
            continue;
        }
        let size = wrong
            .iter()
            .fold(0.0, |size: f64, value| size.max(value.abs()));
        beyond.push(say!(
            "{name}: up to {} in {} of the samples, topic {}",
            short(size),
            percent(share),
            field.topic
        ));
        is_scaled |= field.scale != 1.0;
    }
    let in_radians = digits(PI / 180.0);
    Ok((!beyond.is_empty()).then(|| GrossInput {
        kind: GrossInputKind::Attitude,
        headline: say!(
            "The angles of signals.{signal}.roll_pitch_yaw are beyond a full circle: they look like degrees"
        ),
        evidence: beyond,
        fix: match is_scaled {
            true => say!("multiply the scale of each of the three fields by {in_radians}"),
            false => say!("add scale = {in_radians} to each of the three fields"),
        },
    }))
}
