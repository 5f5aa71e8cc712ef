//! Angles that the machine file binds one by one: roll and pitch beyond half a turn are in degrees.

use anyhow::Result;
use tipwatch_binding::{MachineFile, number_field};
use tipwatch_ingest::{FieldRequest, Log, record_fields};
use tipwatch_mechanics::machine::{NumberSpec, SignalSpec};

use super::proportion::digits;
use super::windows::quantile;
use super::{GrossInput, GrossInputKind};
use crate::base::number::short;

/// Largest roll and pitch, and largest yaw, which may count turns (rad).
const LARGEST_RAD: [f64; 3] = [3.2, 3.2, 40.0];

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
    for ((name, number), largest) in ["roll", "pitch", "yaw"].iter().zip(angles).zip(LARGEST_RAD) {
        let Some(field) = number.field() else {
            continue;
        };
        let request = FieldRequest {
            topic: field.topic.clone(),
            number: number_field(field, ""),
        };
        let (recordings, _) = record_fields(log, &[request], None)?;
        let sizes = recordings
            .iter()
            .flat_map(|r| r.values.iter().map(|v| v.abs()));
        let sizes: Vec<f64> = sizes.collect();
        // a single outlier is a fault of its own
        let Some(size) = quantile(sizes, 0.95) else {
            continue;
        };
        if size > largest {
            beyond.push(format!(
                "{name}: up to {} (95 % of the samples), topic {}",
                short(size),
                field.topic
            ));
        }
    }
    Ok((!beyond.is_empty()).then(|| GrossInput {
        kind: GrossInputKind::Attitude,
        headline: format!(
            "The angles of signals.{signal}.roll_pitch_yaw are beyond a full circle: they look like degrees"
        ),
        evidence: beyond,
        fix: format!(
            "add scale = {} to each of the three fields",
            digits(std::f64::consts::PI / 180.0)
        ),
    }))
}
