//! The analysis of one log: load, estimate, evaluate, detect.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Result, bail};
use tipwatch_binding::{MachineFile, NOT_COMMISSIONED, Urdf, commissioning_of};
use tipwatch_ingest::{Log, metadata_records};
use tipwatch_mechanics::estimation::plausibility::{FaultSpan, FaultSpans};
use tipwatch_mechanics::estimation::{CausalEstimator, Estimate, RowClock};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::{Reason, SampleError, Sensor, StreamCounts};
use tipwatch_mechanics::{State, StateColumns, standing_posture};

use super::advice::advise;
use super::clock;
use super::clock::ClockOffsets;
use super::evaluation;
use super::evaluation::OtherModels;
use super::folds::gather;
pub use super::folds::{Prepared, RowSink};
use super::imu_check;
use super::inputs;
use super::inputs::GrossInput;
use super::measured_loads::{Comparison, LoadComparison, sampled_rows};
use super::notes;
use super::payload;
use super::quasi_static::{QuasiStatic, choose};
use super::redundancy;
use super::size;
use super::states::{self, KeptStates};
use super::supports;
use super::verdicts;
use crate::analysis::Analysis;
use crate::analysis::Coverage;
use crate::analysis::Input;
use crate::analysis::Sources;
use crate::base::clip;
use crate::base::estimated::{EstimatedRows, StateSource};
use crate::base::file_hash::hash_file;
use crate::base::file_hash::hash_log;
use crate::base::file_hash::hash_of;
use crate::base::file_hash::{FileHash, program};
use crate::base::options::{ApplyClockOffsets, Estimator, Options};
use crate::base::provenance::Provenance;
use crate::base::recovered::RecoveredFrom;
use crate::base::rows::Rows;
use crate::base::support_sets::SupportSets;
use crate::base::table::Table;
use crate::base::verdicts::MonitorRecord;
use crate::events;
use crate::events::OnSet;
use crate::load::LoadedLog;
use crate::load::LogTimes;
use crate::load::MeasuredLoads;
use crate::load::block_smoother;
use crate::load::linkage_force;
use crate::load::linkage_force::LinkageForce;
use crate::load::load;
use crate::load::recorder_gaps;

/// Default limit of a light wheel, as a share of its static load.
const DEFAULT_MIN_LOAD_SHARE: f64 = 0.05;

/// Analyses one log and keeps the whole table; `progress` receives the number of bytes read so far.
///
/// # Errors
/// The log cannot be read, the machine does not fit it, or no row remains.
pub fn analyse(
    path: &Path,
    file: &MachineFile,
    options: Options,
    progress: &mut dyn FnMut(u64),
) -> Result<Analysis> {
    let begin = |_: &Prepared<'_>| Ok(Whole::default());
    let (analysis, whole) = analyse_with(path, file, options, progress, true, begin)?;
    if let Some(rows) = whole.rows {
        analysis.rows.keep(rows);
    }
    Ok(analysis)
}

/// Analyses one log without keeping its table. The sink that `begin` makes receives the rows block by block.
///
/// # Errors
/// The log cannot be read, the machine does not fit it, no row remains, or the sink fails.
pub fn analyse_into<S: RowSink>(
    path: &Path,
    file: &MachineFile,
    options: Options,
    progress: &mut dyn FnMut(u64),
    begin: impl FnOnce(&Prepared<'_>) -> Result<S>,
) -> Result<(Analysis, S)> {
    analyse_with(path, file, options, progress, false, begin)
}

fn analyse_with<S: RowSink>(
    path: &Path,
    file: &MachineFile,
    options: Options,
    progress: &mut dyn FnMut(u64),
    is_kept: bool,
    begin: impl FnOnce(&Prepared<'_>) -> Result<S>,
) -> Result<(Analysis, S)> {
    let log = file.open_log(path)?;
    let mut loaded = load(&log, file, progress)?;
    loaded.notes.extend(recorder_gaps::note(&log)?);
    let quasi_static = choose(&mut loaded, &options)?;
    let scope = QuasiStatic::scope(quasi_static.as_ref(), evaluation::scope(&options));
    size::check(&loaded, &options, scope, is_kept, path)?;
    let mut forces = linkage_force::read_all(&log, file, &loaded);
    // parts of the estimate take one core
    let (estimated, log_hashes) = rayon::join(
        || estimate_on_one_clock(&mut loaded, &mut forces, &options),
        || hash_log(&log),
    );
    let (mut rows, quality, clock) = estimated?;
    let log_hashes = log_hashes?;
    let gross_inputs = inputs::gross_inputs(&log, file, &loaded, &rows)?;
    let note_on_slope = inputs::notes_on_slope(&loaded);
    loaded.check_read()?;
    loaded.forget_samples();
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
    let measured_loads = Arc::new(MeasuredLoads::read(&log, file, &loaded));
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
    let load_comparison = match scope.sensitivities {
        true => compare_loads(&loaded.machine, &mut rows, &measured_loads),
        false => LoadComparison::default(),
    };
    let contradicted = match scope.sensitivities && gross_inputs.is_empty() {
        true => redundancy::contradictions(&log, file, &loaded, &forces, &rows, &payloads),
        false => Vec::new(),
    };
    let posture = first_posture(&loaded.machine, &rows);
    supports::check_options(&loaded, &options)?;
    let has_odometry = loaded.matched.sensors.odometry;
    let model = evaluation::model(
        &loaded.machine,
        options.model,
        &posture,
        has_odometry,
        &options,
    )?;
    let on_supports = supports::of_rows(&mut loaded, &rows.times_ns, scope);
    let machine = on_supports
        .as_ref()
        .map_or(&loaded.machine, |(named, _)| named);
    let record = match scope.sensitivities {
        true => verdicts::monitor_record(&log)?,
        false => MonitorRecord::default(),
    };
    let mut table = Table::new(machine, rows, scope, &model, record);
    if let Some((named, sets)) = &on_supports {
        table = table.on_supports(named, SupportSets::clone(sets));
    }
    if options.estimator == Estimator::Causal {
        // the smoother knows what follows: its states would predict what they have seen
        table = table.predicting();
    }
    let notes_on_static_rows = (quasi_static.as_ref()).map_or(Vec::new(), |it| it.notes.clone());
    QuasiStatic::apply(quasi_static, &mut table);
    let min_loads_n = min_loads(machine);
    let mut input_events = events::of_inputs(&loaded, &quality.faults, &table);
    input_events.extend(contradicted);
    let prepared = Prepared {
        machine,
        table: &table,
        options: &options,
        input_events: &input_events,
        measured_loads: &measured_loads,
    };
    let mut sink = begin(&prepared)?;
    let others = match &on_supports {
        Some(_) => OtherModels::none(),
        None => OtherModels::new(machine, &posture, has_odometry, &options),
    };
    let sets = OnSet::all(&table, min_loads);
    let gathered = gather(
        prepared,
        min_loads_n.as_deref(),
        &sets,
        scope,
        &others,
        &mut sink,
    )?;
    drop(sets);
    let provenance = provenance(&log, log_hashes, file, &loaded)?;
    table.check()?;
    table.reasons = gathered.found.reasons;
    let mut coverage = Coverage::of(&loaded, &table, &options, log.span_ns());
    coverage.between_rows = gathered.exclusion;
    // what is only possible has no lead time
    let others = [input_events, gathered.not_excluded].concat();
    let events = events::sorted(gathered.found.events, others);
    let sensitivity = (gathered.sensitivity).and_then(|found| found.table(machine, &table));
    let advice = advise(
        machine,
        &table,
        min_loads_n.as_deref(),
        &events,
        gathered.found.lowest.as_ref(),
        sensitivity.as_ref(),
        &gathered.seen.positions,
    );
    let clock_findings = clock::text::of_signals(&loaded.signals);
    let mut notes = notes::of(&loaded, &payloads, &clock_findings, &clock, &gathered.seen);
    notes.splice(0..0, notes_on_static_rows);
    notes.splice(0..0, note_on_slope);
    notes.extend(notes::of_measured_loads(
        &measured_loads,
        &load_comparison,
        table.times_ns[0],
    ));
    if loaded.matched.sensors.imu {
        notes.splice(0..0, imu_check::note(machine, &gathered.seen.mounting));
    }
    let sources = Sources {
        machine_file: file.text.clone(),
        urdf: loaded.urdf_text,
    };
    let signals = loaded.signals.iter().map(|signal| Input {
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
        topic: signal.topic.clone(),
        type_name: signal.type_name.clone(),
        why: signal.why.clone(),
        statistics: signal.recording.statistics.clone(),
        correction: signal.recording.correction,
        undecodable: signal.recording.undecodable,
    });
    let analysis = Analysis {
        sources,
        inputs: signals.collect(),
        machine: match on_supports {
            Some((named, _)) => named,
            None => loaded.machine,
        },
        options,
        transfers: log.transfers(),
        provenance,
        notes,
        losses: loaded.losses,
        gross_inputs,
        rows: table,
        digest: gathered.digest,
        coverage,
        min_loads_n,
        events,
        sensitivity,
        advice,
        monte_carlo: gathered.monte_carlo,
        payloads,
        comparisons: gathered.comparisons,
        clock,
        clock_findings,
        measured_loads,
        load_comparison,
        log_times: (loaded.signals.first()).map_or_else(LogTimes::default, |signal| {
            signal.recording.log_times.clone()
        }),
        clips: None,
    };
    Ok((analysis, sink))
}

/// Collects all rows.
#[derive(Default)]
struct Whole {
    rows: Option<Rows>,
}

impl RowSink for Whole {
    fn take(&mut self, rows: &Arc<Rows>) -> Result<()> {
        let next = Rows::clone(rows);
        match &mut self.rows {
            Some(rows) => rows.append(next),
            None => self.rows = Some(next),
        }
        Ok(())
    }
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
    let (log, loaded, rows) = open(path, file, &Options::default())?;
    let gross_inputs = inputs::gross_inputs(&log, file, &loaded, &rows)?;
    loaded.check_read()?;
    let posture = first_posture(&loaded.machine, &rows);
    Ok((loaded.machine, posture, gross_inputs))
}

/// The states of a log's rows: its sensors on one clock, smoothed or causal. No loads are computed.
///
/// # Errors
/// The machine does not fit the log, or it cannot be read.
pub fn states(
    path: &Path,
    file: &MachineFile,
    options: &Options,
) -> Result<(Machine, EstimatedRows)> {
    let (_, loaded, rows) = open(path, file, options)?;
    loaded.check_read()?;
    Ok((loaded.machine, rows))
}

/// A log as the machine file binds it, and the states of its rows in the requested time range.
fn open(
    path: &Path,
    file: &MachineFile,
    options: &Options,
) -> Result<(Log, LoadedLog, EstimatedRows)> {
    let log = file.open_log(path)?;
    let loaded = load(&log, file, &mut |_| {})?;
    let (rows, _) = estimate(&loaded, options)?;
    Ok((log, loaded, rows))
}

/// Compares measured with computed loads. Rows in which they contradict each other are not valid: either may be wrong.
fn compare_loads(
    machine: &Machine,
    rows: &mut EstimatedRows,
    measured: &MeasuredLoads,
) -> LoadComparison {
    let comparison = Comparison {
        machine,
        rows,
        measured,
    }
    .compare();
    for span in &comparison.contradictions {
        let pairs = rows.times_ns.iter().zip(&mut rows.reasons);
        for (_, reasons) in pairs.filter(|(time, _)| (span.start_ns..=span.end_ns).contains(time)) {
            reasons.add(Reason::Contradiction);
        }
    }
    comparison
}

/// A log's machine and rows with what was measured beside them, for validation and identification.
pub(crate) struct MeasuredLog {
    pub(crate) loaded: LoadedLog,
    pub(crate) rows: EstimatedRows,
    pub(crate) forces: Vec<LinkageForce>,
    pub(crate) loads: MeasuredLoads,
    pub(crate) gross_inputs: Vec<GrossInput>,
    /// Hashes of the files of the log.
    pub(crate) files: Vec<FileHash>,
}

impl MeasuredLog {
    /// # Errors
    /// The log cannot be read, or the machine does not fit it.
    pub(crate) fn read(path: &Path, file: &MachineFile) -> Result<Self> {
        let (log, mut loaded, rows) = open(path, file, &Options::default())?;
        let forces = linkage_force::read_all(&log, file, &loaded);
        let loads = MeasuredLoads::read(&log, file, &loaded);
        let gross_inputs = inputs::gross_inputs(&log, file, &loaded, &rows)?;
        loaded.check_read()?;
        if rows.is_empty() {
            bail!(
                "{}: expected usable joint states, found none",
                path.display()
            );
        }
        if loaded
            .machine
            .payloads()
            .iter()
            .any(|payload| payload.is_estimated)
        {
            payload::estimate_all(file, &mut loaded.machine, &forces, &rows)?;
        }
        Ok(Self {
            loaded,
            rows,
            forces,
            loads,
            gross_inputs,
            files: hash_log(&log)?,
        })
    }

    /// Measured against computed loads.
    pub(crate) fn compare(&self) -> LoadComparison {
        Comparison {
            machine: &self.loaded.machine,
            rows: &self.rows,
            measured: &self.loads,
        }
        .compare()
    }
}

/// Estimates the offsets between the clocks of a log's topics that remain after those of the machine file.
///
/// # Errors
/// The machine does not fit the log, or it cannot be read.
pub fn clock_offsets(log: &Log, file: &MachineFile) -> Result<ClockOffsets> {
    let loaded = load(log, file, &mut |_| {})?;
    let (rows, _) = smoothed(&loaded, RowClock::JointStates)?;
    let forces = linkage_force::read_all(log, file, &loaded);
    let offsets = clock::estimate(&loaded, &forces, &rows);
    loaded.check_read()?;
    Ok(offsets)
}

/// States of all rows in the requested time range, and the offsets between the clocks of their topics,
/// corrected beforehand if requested.
fn estimate_on_one_clock(
    loaded: &mut LoadedLog,
    forces: &mut [LinkageForce],
    options: &Options,
) -> Result<(EstimatedRows, SignalQuality, ClockOffsets)> {
    let (rows, quality) = estimate(loaded, options)?;
    // the causal estimator lags behind its signals, and a time range may leave few rows
    let is_usual = options.estimator == Estimator::Smoother && options.rate_hz.is_none();
    let mut clock = if is_usual && options.from_s.is_none() && options.to_s.is_none() {
        clock::estimate(loaded, forces, &rows)
    } else {
        let (smoothed, _) = smoothed(loaded, RowClock::JointStates)?;
        clock::estimate(loaded, forces, &smoothed)
    };
    if options.apply_clock_offsets == ApplyClockOffsets::Stated {
        return Ok((rows, quality, clock));
    }
    // the rows share the samples, whose stamps change
    drop(rows);
    if let Some(signals) = Arc::get_mut(&mut loaded.signals) {
        clock.apply(signals, forces);
    }
    let (rows, quality) = estimate(loaded, options)?;
    Ok((rows, quality, clock))
}

/// States of all rows in the requested time range.
fn estimate(loaded: &LoadedLog, options: &Options) -> Result<(EstimatedRows, SignalQuality)> {
    let clock = options
        .rate_hz
        .map_or(RowClock::JointStates, RowClock::Rate);
    let (rows, quality) = match options.estimator {
        Estimator::Smoother => smoothed(loaded, clock)?,
        Estimator::Causal => causal(loaded, clock)?,
    };
    Ok((within(rows, options), quality))
}

fn smoothed(loaded: &LoadedLog, clock: RowClock) -> Result<(EstimatedRows, SignalQuality)> {
    let machine = &loaded.machine;
    let smoother = block_smoother(loaded, clock)?;
    let quality = SignalQuality {
        counts: smoother.counts().collect(),
        faults: smoother.faults().to_vec(),
    };
    let times_ns = smoother.row_times_ns().to_vec();
    let states = states::smoothed(machine, smoother);
    Ok((estimated(machine, times_ns, states), quality))
}

/// The rows with what is asked of all their states before outcomes are computed.
fn estimated(machine: &Machine, times_ns: Vec<i64>, states: Arc<dyn StateSource>) -> EstimatedRows {
    let mut kept = inputs::looked_at(&times_ns);
    if !machine.load_sensors().is_empty() {
        kept.extend(sampled_rows(times_ns.len()));
        kept.sort_unstable();
        kept.dedup();
    }
    EstimatedRows::new(machine, times_ns, states, &kept, |machine, state| {
        clock::activity(machine, state, inputs::is_quiet(machine, state))
    })
}

/// Same as live: sample by sample, in the order in which the recorder received them.
fn causal(loaded: &LoadedLog, clock: RowClock) -> Result<(EstimatedRows, SignalQuality)> {
    let machine = &loaded.machine;
    let mut estimator = CausalEstimator::new(machine, &loaded.matched.sensors, clock);
    let mut estimates: Vec<Estimate> = Vec::new();
    let mut faults = FaultSpans::default();
    loaded.for_each_arrival(|sample| {
        // the estimator counts rejected samples
        let pushed = estimator.push(machine, sample, &mut |row| estimates.push(row.clone()));
        if matches!(pushed, Ok(()) | Err(SampleError::NotFinite)) {
            faults.take(sample.sensor, sample.stamp_ns, estimator.findings());
        }
    })?;
    let mut states = StateColumns::unknown(machine, estimates.len());
    for (row, estimate) in estimates.iter_mut().enumerate() {
        states.set(row, &mut estimate.state);
    }
    let times_ns = estimates.iter().map(|e| e.time_ns).collect();
    let states = Arc::new(KeptStates {
        states,
        reasons: estimates.iter().map(|e| e.reasons).collect(),
        failure: None,
    });
    let quality = SignalQuality {
        counts: estimator.counts().to_vec(),
        faults: faults.finish(),
    };
    Ok((estimated(machine, times_ns, states), quality))
}

/// Keeps the rows between `from_s` and `to_s`.
fn within(rows: EstimatedRows, options: &Options) -> EstimatedRows {
    let (from, to) = (
        options.from_s.unwrap_or(f64::NEG_INFINITY),
        options.to_s.unwrap_or(f64::INFINITY),
    );
    // times rise from row to row
    let kept: Vec<bool> = (0..rows.len())
        .map(|row| (from..=to).contains(&rows.seconds(row)))
        .collect();
    let first = kept.iter().position(|&kept| kept).unwrap_or(0);
    let last = kept
        .iter()
        .rposition(|&kept| kept)
        .map_or(first, |last| last + 1);
    rows.cut(first..last)
}

/// The first posture in which the machine can stand: joint positions; NaN if there is none.
fn first_posture(machine: &Machine, rows: &EstimatedRows) -> Vec<f64> {
    let mut state = State::zero(machine);
    let mut postures = (0..rows.len()).filter_map(|row| {
        rows.state(row, &mut state);
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

fn provenance(
    log: &Log,
    log_hashes: Vec<FileHash>,
    file: &MachineFile,
    loaded: &LoadedLog,
) -> Result<Provenance> {
    let urdf = Urdf {
        name: loaded.urdf.path.clone(),
        text: loaded.urdf_text.clone(),
    };
    let commissioning = commissioning_of(file, &urdf)?;
    let records = metadata_records(log)?;
    Ok(Provenance {
        clip_of: clip::origin(&records),
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
        recovered_from: RecoveredFrom::all(&records),
        log: log_hashes,
        log_format: log.format().to_string(),
        machine_file: hash_of(file.path.display().to_string(), file.text.as_bytes()),
        urdf: loaded.urdf.clone(),
        dbc_files: file
            .dbc_files()
            .iter()
            .map(|file| hash_file(file))
            .collect::<Result<_>>()?,
        imu_mounting: loaded.machine.imu().source.clone(),
    })
}
