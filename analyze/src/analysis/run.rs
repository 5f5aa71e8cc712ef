//! The analysis of one log: load, estimate, evaluate, detect.

use std::path::Path;

use anyhow::{Result, bail};
use tipwatch_binding::{MachineFile, NOT_COMMISSIONED, Urdf, commissioning_of};
use tipwatch_ingest::{Log, metadata_records};
use tipwatch_mechanics::estimation::plausibility::{FaultSpan, FaultSpans};
use tipwatch_mechanics::estimation::{CausalEstimator, Estimate, RowClock, SensorSamples, smooth};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::{Reason, SampleError, Sensor, StreamCounts};
use tipwatch_mechanics::{OutcomeColumns, Scope, State, StateColumns, standing_posture};

use super::advice::advise;
use super::clock;
use super::clock::ClockOffsets;
use super::evaluation;
use super::imu_check;
use super::inputs;
use super::inputs::GrossInput;
use super::monte_carlo;
use super::notes;
use super::payload;
use super::sensitivity;
use super::size;
use super::verdicts;
use crate::analysis::Analysis;
use crate::analysis::Coverage;
use crate::analysis::Input;
use crate::analysis::Sources;
use crate::base::file_hash::hash_file;
use crate::base::file_hash::hash_of;
use crate::base::file_hash::{FileHash, program};
use crate::base::options::{ApplyClockOffsets, Estimator, Options};
use crate::base::provenance::Provenance;
use crate::base::recovered::RecoveredFrom;
use crate::base::rows::Rows;
use crate::events::detect;
use crate::load::LoadedLog;
use crate::load::linkage_force;
use crate::load::linkage_force::LinkageForce;
use crate::load::load;
use crate::load::recorder_gaps;

/// Default limit of a light wheel, as a share of its static load.
const DEFAULT_MIN_LOAD_SHARE: f64 = 0.05;

/// Analyses one log; `progress` receives the number of bytes read so far.
///
/// # Errors
/// The log cannot be read, the machine does not fit it, or no row remains.
pub fn analyse(
    path: &Path,
    file: &MachineFile,
    options: Options,
    progress: &mut dyn FnMut(u64),
) -> Result<Analysis> {
    let log = Log::open(path)?;
    let mut loaded = load(&log, file, progress)?;
    loaded.notes.extend(recorder_gaps::note(&log)?);
    size::check(&loaded, &options, evaluation::scope(&options), path)?;
    let mut forces = linkage_force::read_all(&log, file, &loaded);
    let (mut rows, quality, clock) = estimate_on_one_clock(&mut loaded, &mut forces, &options);
    let gross_inputs = inputs::gross_inputs(&log, file, &loaded, &rows)?;
    let note_on_slope = inputs::notes_on_slope(&loaded);
    for signal in &mut loaded.signals {
        // the steps below need only the states
        signal.recording.values = Vec::new();
    }
    if !gross_inputs.is_empty() {
        for reasons in &mut rows.reasons {
            reasons.add(Reason::GrossInput);
        }
    }
    if rows.is_empty() {
        bail!(
            "{}: expected usable joint states in the requested time range, found none",
            path.display()
        );
    }
    let payloads = payload::estimate_all(file, &mut loaded.machine, &forces, &rows)?;
    if let Err(error) = loaded.machine.set_reference_loads() {
        let is_stated = loaded.machine.reference().posture.is_stated;
        // a gross input explains more than its consequence, and forbids every conclusion already
        if is_stated && gross_inputs.is_empty() {
            return Err(error.into());
        }
        // The loads do not need the reference. Without it utilisation is unknown, and no row is safe.
        loaded
            .notes
            .push(format!("Utilisation is unknown: {error}."));
    }
    let posture = first_posture(&loaded.machine, &rows);
    let machine = &loaded.machine;
    let has_odometry = loaded.matched.sensors.odometry;
    let model = evaluation::model(machine, options.model, &posture, has_odometry, &options)?;
    let scope = evaluation::scope(&options);
    rows.outcomes = evaluation::evaluate_all(machine, &rows.states, scope, &model);
    for row in 0..rows.len() {
        rows.reasons[row] = rows.outcomes.reasons(row, rows.reasons[row]);
    }
    let coverage = Coverage::of(&loaded, &rows, &options, log.span_ns());
    rows.verdicts = verdicts::of(&log, machine, &rows, scope)?;
    let comparisons = evaluation::compare_models(machine, &rows, &posture, has_odometry, &options);
    let min_loads_n = min_loads(machine);
    let events = detect::events(
        &loaded,
        &quality.faults,
        &rows,
        min_loads_n.as_deref(),
        scope,
    );
    let sensitivity = scope
        .sensitivities
        .then(|| sensitivity::table(machine, &rows))
        .flatten();
    let advice = advise(
        machine,
        &rows,
        min_loads_n.as_deref(),
        &events,
        sensitivity.as_ref(),
    );
    let draws = options.monte_carlo;
    let monte_carlo = draws.map(|draws| monte_carlo::run(machine, &rows.states, draws));
    let clock_findings = clock::text::of_signals(&loaded.signals);
    let mut notes = notes::of(&loaded, &payloads, &clock_findings, &clock, &rows);
    notes.splice(0..0, note_on_slope);
    if loaded.matched.sensors.imu {
        notes.splice(0..0, imu_check::note(machine, &rows));
    }
    let provenance = provenance(&log, file, &loaded)?;
    let sources = Sources {
        machine_file: file.text.clone(),
        urdf: loaded.urdf_text,
    };
    let signals = loaded.signals.into_iter().map(|signal| Input {
        signal: signal.name,
        clock: format!(
            "{}: {}",
            signal.recording.clock.source, signal.recording.clock.reason
        ),
        counts: quality
            .counts
            .iter()
            .find(|(sensor, _)| *sensor == signal.sensor)
            .map_or(StreamCounts::default(), |(_, c)| *c),
        topic: signal.topic,
        type_name: signal.type_name,
        why: signal.why,
        statistics: signal.recording.statistics,
        correction: signal.recording.correction,
        undecodable: signal.recording.undecodable,
    });
    Ok(Analysis {
        sources,
        inputs: signals.collect(),
        machine: loaded.machine,
        options,
        provenance,
        notes,
        losses: loaded.losses,
        gross_inputs,
        rows,
        coverage,
        min_loads_n,
        events,
        sensitivity,
        advice,
        monte_carlo,
        payloads,
        comparisons,
        clock,
        clock_findings,
    })
}

/// Quality of the signals behind the rows.
struct SignalQuality {
    counts: Vec<(Sensor, StreamCounts)>,
    faults: Vec<FaultSpan>,
}

/// A log's machine, its joint positions in the first valid row (NaN if there is none), and the gross inputs.
pub(crate) fn posture_in_log(
    path: &Path,
    file: &MachineFile,
) -> Result<(Machine, Vec<f64>, Vec<GrossInput>)> {
    let log = Log::open(path)?;
    let loaded = load(&log, file, &mut |_| {})?;
    let (rows, _) = estimate(&loaded, &Options::default());
    let gross_inputs = inputs::gross_inputs(&log, file, &loaded, &rows)?;
    let posture = first_posture(&loaded.machine, &rows);
    Ok((loaded.machine, posture, gross_inputs))
}

/// Estimates the offsets between the clocks of a log's topics that remain after those of the machine file.
///
/// # Errors
/// The machine does not fit the log, or it cannot be read.
pub fn clock_offsets(log: &Log, file: &MachineFile) -> Result<ClockOffsets> {
    let loaded = load(log, file, &mut |_| {})?;
    let (rows, _) = smoothed(&loaded, RowClock::JointStates);
    let forces = linkage_force::read_all(log, file, &loaded);
    Ok(clock::estimate(&loaded, &forces, &rows))
}

/// States of all rows in the requested time range, and the offsets between the clocks of their topics,
/// corrected beforehand if requested.
fn estimate_on_one_clock(
    loaded: &mut LoadedLog,
    forces: &mut [LinkageForce],
    options: &Options,
) -> (Rows, SignalQuality, ClockOffsets) {
    let (rows, quality) = estimate(loaded, options);
    // the causal estimator lags behind its signals, and a time range may leave few rows
    let is_usual = options.estimator == Estimator::Smoother && options.rate_hz.is_none();
    let mut clock = if is_usual && options.from_s.is_none() && options.to_s.is_none() {
        clock::estimate(loaded, forces, &rows)
    } else {
        let (smoothed, _) = smoothed(loaded, RowClock::JointStates);
        clock::estimate(loaded, forces, &smoothed)
    };
    let (rows, quality) = match options.apply_clock_offsets {
        ApplyClockOffsets::Estimated if clock.apply(&mut loaded.signals, forces) => {
            estimate(loaded, options)
        }
        _ => (rows, quality),
    };
    (rows, quality, clock)
}

/// States of all rows in the requested time range.
fn estimate(loaded: &LoadedLog, options: &Options) -> (Rows, SignalQuality) {
    let clock = options
        .rate_hz
        .map_or(RowClock::JointStates, RowClock::Rate);
    let (rows, quality) = match options.estimator {
        Estimator::Smoother => smoothed(loaded, clock),
        Estimator::Causal => causal(loaded, clock),
    };
    (within(rows, &loaded.machine, options), quality)
}

fn smoothed(loaded: &LoadedLog, clock: RowClock) -> (Rows, SignalQuality) {
    let samples: Vec<SensorSamples<'_>> = (loaded.signals.iter())
        .map(|signal| SensorSamples {
            sensor: signal.sensor,
            stamps_ns: &signal.recording.stamps_ns,
            values: &signal.recording.values,
        })
        .collect();
    let smoothed = smooth(&loaded.machine, &loaded.matched.sensors, &samples, clock);
    let rows = Rows {
        times_ns: smoothed.times_ns,
        reasons: smoothed.reasons,
        states: smoothed.states,
        outcomes: OutcomeColumns::empty(&loaded.machine, Scope::LOADS),
        verdicts: None,
    };
    let quality = SignalQuality {
        counts: smoothed.counts,
        faults: smoothed.faults,
    };
    (rows, quality)
}

/// Same as live: sample by sample, in the order in which the recorder received them.
fn causal(loaded: &LoadedLog, clock: RowClock) -> (Rows, SignalQuality) {
    let machine = &loaded.machine;
    let mut estimator = CausalEstimator::new(machine, &loaded.matched.sensors, clock);
    let mut estimates: Vec<Estimate> = Vec::new();
    let mut faults = FaultSpans::default();
    for sample in loaded.arrivals() {
        // the estimator counts rejected samples
        let pushed = estimator.push(machine, &sample, &mut |row| estimates.push(row.clone()));
        if matches!(pushed, Ok(()) | Err(SampleError::NotFinite)) {
            faults.take(sample.sensor, sample.stamp_ns, estimator.findings());
        }
    }
    let mut states = StateColumns::unknown(machine, estimates.len());
    for (row, estimate) in estimates.iter_mut().enumerate() {
        states.set(row, &mut estimate.state);
    }
    let rows = Rows {
        times_ns: estimates.iter().map(|e| e.time_ns).collect(),
        reasons: estimates.iter().map(|e| e.reasons).collect(),
        states,
        outcomes: OutcomeColumns::empty(machine, Scope::LOADS),
        verdicts: None,
    };
    let quality = SignalQuality {
        counts: estimator.counts().to_vec(),
        faults: faults.finish(),
    };
    (rows, quality)
}

/// Keeps the rows between `from_s` and `to_s`.
fn within(rows: Rows, machine: &Machine, options: &Options) -> Rows {
    let (from, to) = (
        options.from_s.unwrap_or(f64::NEG_INFINITY),
        options.to_s.unwrap_or(f64::INFINITY),
    );
    let kept: Vec<usize> = (0..rows.len())
        .filter(|&row| (from..=to).contains(&rows.seconds(row)))
        .collect();
    if kept.len() == rows.len() {
        return rows;
    }
    let mut states = StateColumns::unknown(machine, kept.len());
    let mut state = State::zero(machine);
    for (to, &from) in kept.iter().enumerate() {
        rows.states.get(from, &mut state);
        states.set(to, &mut state);
    }
    Rows {
        times_ns: kept.iter().map(|&row| rows.times_ns[row]).collect(),
        reasons: kept.iter().map(|&row| rows.reasons[row]).collect(),
        outcomes: OutcomeColumns::empty(machine, Scope::LOADS),
        verdicts: None,
        states,
    }
}

/// The first posture in which the machine can stand: joint positions; NaN if there is none.
fn first_posture(machine: &Machine, rows: &Rows) -> Vec<f64> {
    let mut state = State::zero(machine);
    let mut postures = (0..rows.len()).filter_map(|row| {
        rows.states.get(row, &mut state);
        standing_posture(machine, &state, rows.reasons[row])
    });
    let first = postures.next();
    first.unwrap_or_else(|| vec![f64::NAN; machine.joints().len()])
}

/// The load below which each wheel is light; `None` if it depends on unknown static loads.
fn min_loads(machine: &Machine) -> Option<Vec<f64>> {
    let (limits, static_load) = (machine.limits(), &machine.reference().static_load);
    if let Some(load) = limits.min_load {
        return Some(vec![load; static_load.len()]);
    }
    let share = limits.min_load_share.unwrap_or(DEFAULT_MIN_LOAD_SHARE);
    static_load
        .iter()
        .all(|load| load.is_finite())
        .then(|| static_load.iter().map(|load| load * share).collect())
}

fn provenance(log: &Log, file: &MachineFile, loaded: &LoadedLog) -> Result<Provenance> {
    let urdf = Urdf {
        name: loaded.urdf.path.clone(),
        text: loaded.urdf_text.clone(),
    };
    let commissioning = commissioning_of(file, &urdf)?;
    Ok(Provenance {
        commissioning: (commissioning.as_ref())
            .map_or(NOT_COMMISSIONED.into(), |(_, found)| found.statement()),
        commissioning_file: (commissioning.as_ref())
            .map(|(path, _)| hash_file(path))
            .transpose()?,
        tipwatch_version: env!("CARGO_PKG_VERSION").into(),
        program: program().map(|file| FileHash {
            path: "tipwatch".into(),
            ..file
        }),
        command_line: Vec::new(),
        case: None,
        examiner: None,
        recovered_from: RecoveredFrom::all(&metadata_records(log)?),
        log: log
            .files()
            .iter()
            .map(|f| hash_file(f))
            .collect::<Result<_>>()?,
        log_format: log.format().to_string(),
        machine_file: hash_of(file.path.display().to_string(), file.text.as_bytes()),
        urdf: loaded.urdf.clone(),
        imu_mounting: loaded.machine.imu().source.clone(),
    })
}
