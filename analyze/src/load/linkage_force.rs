//! Actuator forces of linkages from a log: measured directly, or from chamber pressures.

use std::collections::BTreeMap;

use anyhow::{Result, bail};
use tipwatch_binding::{MachineFile, monitor_topic, number_field};
use tipwatch_ingest::{FieldRequest, Log, Losses, SensorRecording, TimeBase, record_fields};
use tipwatch_mechanics::machine::{FieldSpec, LinkageSpec, MachineSpec};

use super::LoadedLog;

/// Longest gap (ns) between samples that is interpolated.
const LONGEST_GAP_NS: i64 = 100_000_000;

/// Measured force of a linkage's actuator.
#[derive(Debug)]
pub(crate) struct LinkageForce {
    /// Index of the linkage.
    pub(crate) linkage: usize,
    /// Its topic; for pressures, that of the piston side.
    pub(crate) topic: String,
    /// The force, or the reason why the log does not have it.
    pub(crate) series: Result<Series>,
}

/// Reads the forces of all linkages for which the machine file binds one.
pub(crate) fn read_all(log: &Log, file: &MachineFile, loaded: &LoadedLog) -> Vec<LinkageForce> {
    let clocks = Clocks::of(file, loaded);
    let bound = monitor_topic::bound(log, &file.spec);
    let forces = bound.linkage.iter().enumerate();
    forces
        .filter_map(|(linkage, spec)| {
            let pressure = spec.pressure.as_ref().map(|pressure| &pressure.piston);
            let topic = bound.force_of(spec).or(pressure)?.topic.clone();
            Some(LinkageForce {
                linkage,
                topic,
                series: measured_force(log, &bound, spec, &clocks),
            })
        })
        .collect()
}

impl LinkageForce {
    /// Shifts the stamps (s).
    pub(crate) fn shift(&mut self, seconds: f64) {
        if let Ok((stamps_ns, _)) = &mut self.series {
            let shift_ns = (seconds * 1e9).round() as i64;
            for stamp in stamps_ns {
                *stamp = stamp.saturating_add(shift_ns);
            }
        }
    }
}

/// The clock to which the stamps of numbers are converted.
pub(super) struct Clocks<'a> {
    time_base: Option<&'a TimeBase>,
    /// Clock offsets (s) from the machine file, by topic.
    offsets_s: &'a BTreeMap<String, f64>,
}

impl<'a> Clocks<'a> {
    pub(super) fn of(file: &'a MachineFile, loaded: &'a LoadedLog) -> Self {
        let first = loaded.signals.first();
        Self {
            time_base: first.map(|signal| &signal.recording.reading.time_base),
            offsets_s: &file.spec.clock.offset,
        }
    }
}

/// The numbers of one field, in order of time.
pub(super) fn series_of(log: &Log, field: &FieldSpec, clocks: &Clocks<'_>) -> Result<Series> {
    let (recordings, _) = read(log, &[field], clocks)?;
    Ok(series(&recordings[0], field, clocks))
}

/// The numbers of one field of a loaded log, in order of time.
pub(crate) fn series_in(
    log: &Log,
    file: &MachineFile,
    loaded: &LoadedLog,
    field: &FieldSpec,
) -> Result<Series> {
    series_of(log, field, &Clocks::of(file, loaded))
}

/// The positions of a joint that is bound by itself, in order of time.
pub(crate) fn positions_of(
    log: &Log,
    file: &MachineFile,
    loaded: &LoadedLog,
    field: &FieldSpec,
) -> Result<Series> {
    let clocks = Clocks::of(file, loaded);
    let request = FieldRequest {
        topic: field.topic.clone(),
        number: number_field(field, "position"),
    };
    let (recordings, _) = record_fields(log, &[request], clocks.time_base)?;
    Ok(series(&recordings[0], field, &clocks))
}

/// A force over time: stamps (ns) and values (N).
pub(crate) type Series = (Vec<i64>, Vec<f64>);

fn measured_force(
    log: &Log,
    machine: &MachineSpec,
    spec: &LinkageSpec,
    clocks: &Clocks<'_>,
) -> Result<Series> {
    if let Some(field) = machine.force_of(spec) {
        let (recordings, _) = read(log, &[field], clocks)?;
        return Ok(series(&recordings[0], field, clocks));
    }
    let Some(pressure) = &spec.pressure else {
        bail!("linkage {}: expected a bound force, found none", spec.name);
    };
    let (recordings, _) = read(log, &[&pressure.piston, &pressure.rod], clocks)?;
    let (stamps, piston) = series(&recordings[0], &pressure.piston, clocks);
    let rod = series(&recordings[1], &pressure.rod, clocks);
    let force = stamps.iter().zip(piston).filter_map(|(&stamp, piston)| {
        let rod = at(&rod, stamp)?;
        Some((
            stamp,
            piston * pressure.piston_area - rod * pressure.rod_area,
        ))
    });
    Ok(force.unzip())
}

fn read(
    log: &Log,
    fields: &[&FieldSpec],
    clocks: &Clocks<'_>,
) -> Result<(Vec<SensorRecording>, Losses)> {
    let request = |spec: &&FieldSpec| FieldRequest {
        topic: spec.topic.clone(),
        number: number_field(spec, "effort"),
    };
    let requests: Vec<FieldRequest> = fields.iter().map(request).collect();
    Ok(record_fields(log, &requests, clocks.time_base)?)
}

/// Sorts by time and applies the stated clock offset.
fn series(recording: &SensorRecording, spec: &FieldSpec, clocks: &Clocks<'_>) -> Series {
    let offset_s = clocks.offsets_s.get(&spec.topic).copied().unwrap_or(0.0);
    let shift_ns = (offset_s * 1e9).round() as i64;
    let stamps = recording.stamps_ns.iter();
    let stamps = stamps.map(|stamp| stamp.saturating_add(shift_ns));
    let mut pairs: Vec<(i64, f64)> = stamps.zip(recording.values.iter().copied()).collect();
    pairs.sort_by_key(|(stamp, _)| *stamp);
    pairs.into_iter().unzip()
}

/// Linear interpolation at a time; `None` in gaps and beyond the ends.
pub(crate) fn at((stamps, values): &Series, stamp: i64) -> Option<f64> {
    interpolated(stamps, values, stamp, LONGEST_GAP_NS)
}

/// The same of values in order of their stamps, with the longest gap (ns).
pub(crate) fn interpolated(
    stamps: &[i64],
    values: &[f64],
    stamp: i64,
    longest_gap_ns: i64,
) -> Option<f64> {
    let next = stamps.partition_point(|&s| s < stamp);
    if stamps.get(next) == Some(&stamp) {
        return values.get(next).copied();
    }
    let before = next.checked_sub(1)?;
    let gap_ns = stamps.get(next)?.saturating_sub(stamps[before]);
    (gap_ns <= longest_gap_ns).then(|| {
        let share = (stamp - stamps[before]) as f64 / gap_ns as f64;
        values[before] + share * (values[next] - values[before])
    })
}
