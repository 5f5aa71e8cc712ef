//! The analysis of one log: load, estimate, evaluate, detect.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Result, bail};
use rayon::prelude::*;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::{Machine, Note, Proofs};
use tipwatch_mechanics::state::{Reason, StreamCounts};

use super::advice::{Hypothesis, SupposedStates, advise, ask_all};
use super::clock;
use super::estimate::{estimate_on_one_clock, first_posture};
use super::evaluation::{self, OtherModels};
use super::folds::gather;
pub use super::folds::{Prepared, RowSink};
use super::measured_loads::{Comparison, LoadComparison};
use super::provenance::{commissioning, provenance};
use super::quasi_static::{QuasiStatic, StaticRows, choose};
use super::{
    health, imu_check, inputs, notes, payload, redundancy, size, supports, unstated_load, verdicts,
};
use crate::analysis::{Analysis, Coverage, Input, Sources};
use crate::base::estimated::EstimatedRows;
use crate::base::file_hash::LogHashes;
use crate::base::options::{Estimator, Options};
use crate::base::rows::Rows;
use crate::base::state_source::StateSource;
use crate::base::support_sets::SupportSets;
use crate::base::table::Table;
use crate::base::verdicts::{MonitorRecord, ProofRecord};
use crate::events::{self, Event, FoundRotation, OnSet, ShownBy};
use crate::load::{LogTimes, MeasuredLoads, Standing, linkage_force, load, recorder_gaps};

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
    analyse_whole(path, file, options, None, progress)
}

/// Analyses one log under hypotheses and keeps the whole table. Sensors are not compared with each other, and rotations of
/// the platform are not events: they are what was recorded.
///
/// # Errors
/// The log cannot be read, the machine does not fit it, or no row remains.
pub(crate) fn analyse_supposing(
    path: &Path,
    file: &MachineFile,
    options: Options,
    hypotheses: &[Hypothesis],
) -> Result<Analysis> {
    analyse_whole(path, file, options, Some(hypotheses), &mut |_| {})
}

fn analyse_whole(
    path: &Path,
    file: &MachineFile,
    options: Options,
    hypotheses: Option<&[Hypothesis]>,
    progress: &mut dyn FnMut(u64),
) -> Result<Analysis> {
    let begin = |_: &Prepared<'_>| Ok(Whole::default());
    let how = How {
        options,
        is_kept: true,
        hypotheses,
    };
    let (analysis, whole) = analyse_with(path, file, how, progress, begin)?;
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
    let how = How {
        options,
        is_kept: false,
        hypotheses: None,
    };
    analyse_with(path, file, how, progress, begin)
}

/// How a log is analysed.
struct How<'a> {
    options: Options,
    /// Whether the whole table is kept.
    is_kept: bool,
    /// What is supposed of it instead of what was recorded, if anything is.
    hypotheses: Option<&'a [Hypothesis]>,
}

fn analyse_with<S: RowSink>(
    path: &Path,
    file: &MachineFile,
    how: How<'_>,
    progress: &mut dyn FnMut(u64),
    begin: impl FnOnce(&Prepared<'_>) -> Result<S>,
) -> Result<(Analysis, S)> {
    let How {
        options,
        is_kept,
        hypotheses,
    } = how;
    let is_recorded = hypotheses.is_none();
    let log = Arc::new(file.open_log(path)?);
    let log_hashes = LogHashes::begin(&log);
    let mut loaded = load(&log, file, progress)?;
    loaded.notes.extend(recorder_gaps::note(&log)?);
    let quasi_static = choose(&mut loaded, &options)?;
    let scope = QuasiStatic::scope(quasi_static.as_ref(), evaluation::scope(&options));
    size::check(&loaded, &options, scope, is_kept, path)?;
    let mut forces = linkage_force::read_all(&log, file, &loaded);
    let (mut rows, quality, clock) = estimate_on_one_clock(&mut loaded, &mut forces, &options)?;
    let log_hashes = log_hashes.finish()?;
    let gross_inputs = inputs::gross_inputs(&log, file, &loaded, &rows)?;
    let note_on_slope = inputs::notes_on_slope(&loaded);
    let health = health::of(&loaded, &quality.counts);
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
    let of_payloads = payload::follow_signals(&log, file, &loaded, &mut rows)?;
    loaded.notes.extend(of_payloads);
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
    let load_comparison = match scope.sensitivities && is_recorded {
        true => {
            let motion = quasi_static.as_ref().map(|found| found.rows.as_ref());
            compare_loads(&loaded.standing(), &mut rows, &measured_loads, motion)
        }
        false => LoadComparison::default(),
    };
    let contradicted = match scope.sensitivities && is_recorded && gross_inputs.is_empty() {
        true => redundancy::contradictions(&log, file, &loaded, &forces, &rows, &payloads),
        false => Vec::new(),
    };
    if let Some(hypotheses) = hypotheses {
        let machine = loaded.machine.measured_at_base();
        let recorded_by = std::mem::replace(&mut loaded.machine, machine);
        let supposed = |recorded| -> Arc<dyn StateSource> {
            Arc::new(SupposedStates::new(
                recorded,
                recorded_by,
                hypotheses.to_vec(),
            ))
        };
        rows = rows.through(supposed);
    }
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
    // an IMU that is grossly wrong shows no rotation
    let shows_rotations = is_recorded && !gross_inputs.iter().any(|input| input.kind.is_of_imu());
    let (rotations, rotating) = match shows_rotations {
        true => (quality.rotations, quality.rotating),
        false => Default::default(),
    };
    let on_supports = supports::of_rows(&mut loaded, &rows.times_ns, scope);
    let machine = on_supports
        .as_ref()
        .map_or(&loaded.machine, |(named, _)| named);
    let record = match scope.sensitivities {
        true => verdicts::monitor_record(&log)?,
        false => MonitorRecord::default(),
    };
    if record.is_contradicted {
        let reasons = rows.reasons.iter_mut();
        reasons.for_each(|reasons| reasons.add(Reason::Contradiction));
    }
    let commissioning = commissioning(file, &loaded)?;
    let commissioned =
        (commissioning.as_ref()).map_or(Proofs::NONE, |(_, found)| found.proven(&loaded.machine));
    let needed = loaded.machine.needed_proofs(&loaded.matched.sensors);
    let mut table = Table::new(machine, rows, scope, &model, record)
        .rotating(rotating)
        .resting_on(ProofRecord {
            unproven: needed.without(commissioned),
            proven: quality.proven,
        });
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
        &rotations,
        scope,
        &others,
        &mut sink,
    )?;
    drop(sets);
    let provenance = provenance(&log, log_hashes, file, &loaded, commissioning.as_ref())?;
    table.check()?;
    table.reasons = gathered.found.reasons;
    let mut coverage = Coverage::of(&loaded, &table, &rotations, &options);
    coverage.between_rows = (gathered.exclusion).map(|found| found.within(coverage.covered_s));
    // what is only possible has no lead time
    let others = [input_events, gathered.not_excluded].concat();
    // of a machine on its side, nothing is light
    let on_side: Vec<[i64; 2]> = (rotations.iter())
        .filter_map(FoundRotation::on_side_ns)
        .collect();
    let is_of_wheels = |event: &Event| {
        let within = |[from, to]: &[i64; 2]| (*from..=*to).contains(&event.start_ns);
        matches!(event.shown_by, Some(ShownBy::Rotation | ShownBy::Both))
            || !on_side.iter().any(within)
    };
    let found = gathered.found.events.into_iter().filter(is_of_wheels);
    let mut events = events::sorted(found.collect(), others);
    if scope.sensitivities && is_recorded && gross_inputs.is_empty() && on_supports.is_none() {
        ask_all(machine, &table, &mut events);
    }
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
    let explained_falls = match scope.sensitivities && is_recorded && gross_inputs.is_empty() {
        true => unstated_load::study(&table, &unstated_load::falls(&table, &events)),
        false => Vec::new(),
    };
    let clock_findings = clock::text::of_signals(&loaded.signals);
    let mut notes = notes::of(&loaded, &payloads, &clock_findings, &clock, &gathered.seen);
    notes.extend(notes::of_noise(&quality.noise).map(Note::from));
    notes.splice(0..0, notes_on_static_rows.into_iter().map(Note::from));
    notes.splice(0..0, note_on_slope.into_iter().map(Note::from));
    let on_loads = notes::of_measured_loads(&measured_loads, &load_comparison, table.times_ns[0]);
    notes.extend(on_loads.into_iter().map(Note::from));
    if loaded.matched.sensors.imu && is_recorded {
        notes.splice(0..0, imu_check::note(machine, &gathered.seen.mounting));
    }
    let sources = Sources {
        machine_file: file.effective_text().into_owned(),
        urdf: loaded.urdf_text,
    };
    let signals = loaded.signals.par_iter().map(|signal| Input {
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
        noise: (quality.noise.iter())
            .filter(|noise| noise.sensor == signal.sensor)
            .copied()
            .collect(),
        topic: signal.topic.clone(),
        type_name: signal.type_name.clone(),
        why: signal.why.clone(),
        timing: signal.recording.statistics.timing(),
        correction: signal.recording.correction,
        undecodable: signal.recording.undecodable,
    });
    let analysis = Analysis {
        sources,
        inputs: signals.collect(),
        health,
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
        explained_falls,
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

/// Compares measured with computed loads. Where all supports are measured, the loads of rows in which they contradict the
/// computed ones follow them. Where no load on the tool explains the difference, either may be wrong: such rows are in
/// doubt.
fn compare_loads(
    standing: &Standing<'_>,
    rows: &mut EstimatedRows,
    measured: &MeasuredLoads,
    motion: Option<&StaticRows>,
) -> LoadComparison {
    let comparison = Comparison {
        standing,
        rows,
        measured,
        motion,
    }
    .compare();
    let followed = comparison.contradictions.iter();
    let followed = followed.filter(|span| span.is_followed());
    let spans: Vec<[i64; 2]> = followed.map(|span| [span.start_ns, span.end_ns]).collect();
    rows.change(standing.machine(), &spans, |_, state| {
        // what is unknown stays unknown
        state.follows_supports = state.follows_supports * 0.0 + 1.0;
    });
    let open = comparison.contradictions.iter();
    for span in open.filter(|span| !span.is_explained()) {
        let pairs = rows.times_ns.iter().zip(&mut rows.reasons);
        for (_, reasons) in pairs.filter(|(time, _)| (span.start_ns..=span.end_ns).contains(time)) {
            reasons.add(Reason::Contradiction);
        }
    }
    comparison
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
