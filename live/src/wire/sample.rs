//! Samples: conversion between the wire and the estimator.

use anyhow::{Result, ensure};
use tipwatch_mechanics::state::{NumberKind, Sample, Sensor};

use crate::wire::topics::{Kind, MAX_VALUES, Wire, WireSample};

/// Counts of a session's rows and samples.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SampleCounts {
    /// Rows completed.
    pub rows: u64,
    /// Samples sent before the first one received.
    pub before_joining: u64,
    /// Samples that never arrived since then.
    pub lost: u64,
    /// Samples that arrived but could not be used.
    pub refused: u64,
    /// Samples that arrived again, and were not used again.
    pub repeated: u64,
}

/// Content of a message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Message<'a> {
    /// A sample of a sensor.
    Sample(Sample<'a>),
    /// The end of the session.
    End,
}

/// The kind of a message is unknown, or it has too many values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("unknown kind of sensor, or too many values")]
pub struct Malformed;

impl WireSample {
    /// A sample without head.
    ///
    /// # Errors
    /// It has too many values for a message.
    pub fn new(sample: &Sample<'_>, log_time_ns: i64) -> Result<Self> {
        let count = sample.values.len();
        ensure!(
            count <= MAX_VALUES,
            "sample: expected no more than {MAX_VALUES} values, found {count}"
        );
        let (kind, stream) = match sample.sensor {
            Sensor::Joints(stream) => (Kind::Joints, stream),
            Sensor::Imu => (Kind::Imu, 0),
            Sensor::Odometry => (Kind::Odometry, 0),
            Sensor::ToolWrench => (Kind::ToolWrench, 0),
            Sensor::Number(kind, index) => (kind.into(), index),
        };
        let mut wire = Self {
            time_ns: sample.stamp_ns,
            log_time_ns,
            kind: kind as u32,
            stream: u32::try_from(stream)?,
            value_count: count as u32,
            ..Self::blank()
        };
        wire.values[..count].copy_from_slice(sample.values);
        Ok(wire)
    }

    /// The last message of a session, without head.
    #[must_use]
    pub fn end() -> Self {
        Self {
            kind: Kind::End as u32,
            ..Self::blank()
        }
    }
}

impl<'a> TryFrom<&'a WireSample> for Message<'a> {
    type Error = Malformed;

    fn try_from(wire: &'a WireSample) -> Result<Self, Malformed> {
        let number = |kind| Sensor::Number(kind, wire.stream as usize);
        let sensor = match Kind::try_from(wire.kind).map_err(|_| Malformed)? {
            Kind::Joints => Sensor::Joints(wire.stream as usize),
            Kind::Imu => Sensor::Imu,
            Kind::Odometry => Sensor::Odometry,
            Kind::ToolWrench => Sensor::ToolWrench,
            Kind::Actuator => number(NumberKind::Actuator),
            Kind::Switch => number(NumberKind::Switch),
            Kind::Load => number(NumberKind::Load),
            Kind::Command => number(NumberKind::Command),
            Kind::Payload => number(NumberKind::Payload),
            Kind::Force => number(NumberKind::Force),
            Kind::End => return Ok(Self::End),
        };
        let values = wire
            .values
            .get(..wire.value_count as usize)
            .ok_or(Malformed)?;
        Ok(Self::Sample(Sample::new(sensor, wire.time_ns, values)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::topics::Head;

    #[test]
    fn samples_survive_the_wire_bit_for_bit() {
        let values = [1.5, f64::NAN, -0.0, f64::INFINITY];
        for sensor in [
            Sensor::Joints(3),
            Sensor::Imu,
            Sensor::Odometry,
            Sensor::ToolWrench,
            Sensor::Number(NumberKind::Actuator, 2),
            Sensor::Number(NumberKind::Switch, 1),
            Sensor::Number(NumberKind::Load, 4),
            Sensor::Number(NumberKind::Command, 2),
            Sensor::Number(NumberKind::Payload, 1),
            Sensor::Number(NumberKind::Force, 3),
        ] {
            let sample = Sample::new(sensor, -7, &values);
            let wire = WireSample::new(&sample, 8).unwrap();
            assert_eq!(wire.log_time_ns, 8);
            let Ok(Message::Sample(sample)) = Message::try_from(&wire) else {
                panic!("no sample")
            };
            assert_eq!((sample.sensor, sample.stamp_ns), (sensor, -7));
            let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(sample.values), bits(&values));
        }
    }

    #[test]
    fn damage_is_detected() {
        let mut wire = WireSample::end();
        assert!(!wire.is_whole(), "all zeros");
        let head = Head {
            sequence: 3,
            time_ns: 4,
            ..Head::default()
        };
        wire.seal(head);
        assert!(wire.is_whole());
        assert_eq!(wire.head(), head);
        wire.values[MAX_VALUES - 1] = f64::MIN_POSITIVE;
        assert!(!wire.is_whole());
    }

    #[test]
    fn end_message_is_recognised() {
        assert_eq!(Message::try_from(&WireSample::end()), Ok(Message::End));
    }

    #[test]
    fn malformed_messages_are_rejected() {
        let too_many = Sample::new(Sensor::Imu, 0, &[0.0; MAX_VALUES + 1]);
        assert!(WireSample::new(&too_many, 0).is_err());
        let good = WireSample::end();
        assert_eq!(
            Message::try_from(&WireSample { kind: 99, ..good }),
            Err(Malformed)
        );
        let long = WireSample {
            kind: Kind::Imu as u32,
            value_count: 129,
            ..good
        };
        assert_eq!(Message::try_from(&long), Err(Malformed));
    }
}
