//! The states of a log's rows: smoothed or causal, on one clock, in the requested time range.

use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use tipwatch_binding::MachineFile;
use tipwatch_ingest::Log;
use tipwatch_mechanics::estimation::plausibility::{Explanation, FaultSpan, FaultSpans};
use tipwatch_mechanics::estimation::{
    CausalEstimator, Estimate, EstimatedStates, RowClock, ShownNoise,
};
use tipwatch_mechanics::machine::{FaultKind, Machine, Proof, SessionProofs};
use tipwatch_mechanics::state::{NumberKind, Reason, SampleError, Sensor, StreamCounts};
use tipwatch_mechanics::studies::measured_forces::ForceWatch;
use tipwatch_mechanics::studies::measured_loads::{LoadWatch, measures_supports};
use tipwatch_mechanics::studies::payload_watch::PayloadWatch;
use tipwatch_mechanics::{State, StateColumns, standing_posture};

use super::clock::{self, ClockOffsets};
use super::inputs::{self, GrossInput};
use super::measured_loads::sampled_rows;
use super::rotations;
use super::state_blocks::{self, KeptStates};
use crate::base::estimated::EstimatedRows;
use crate::base::options::{ApplyClockOffsets, Estimator, Options};
use crate::base::state_source::StateSource;
use crate::events::{FoundRotation, Rotations, Turning};
use crate::load::linkage_force::{self, LinkageForce};
use crate::load::supports::SupportTimeline;
use crate::load::{LoadedLog, block_smoother, load};

/// Quality of the signals behind the rows.
pub(super) struct SignalQuality {
    pub(super) counts: Vec<(Sensor, StreamCounts)>,
    pub(super) faults: Vec<FaultSpan>,
    /// The noise that the samples show.
    pub(super) noise: Vec<ShownNoise>,
    /// Rotations of the platform about an edge, by gyro and attitude alone.
    pub(super) rotations: Vec<FoundRotation>,
    /// Rotation of the platform about each edge at the end of the log, if a fall may have begun.
    pub(super) turning: Vec<Turning>,
    /// Times of the first and the last row in each, as far as the estimator knew it in the row (ns); none if it knows the whole log.
    pub(super) rotating: Vec<[i64; 2]>,
    /// Proofs by the signals of the session, from the row at each time (ns) on.
    pub(super) shown: Vec<(i64, SessionProofs)>,
    /// The probability that each joint of the arm has the other sign, by the motion of the whole log.
    pub(super) reversed: Vec<(usize, f64)>,
    /// The rate that was asked of each joint, from the row at this time (ns) on; none if the estimator knows the whole log.
    pub(super) commands: Vec<(i64, Vec<f64>)>,
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
    let (_, loaded, rows, _) = open(path, file, options)?;
    loaded.check_read()?;
    Ok((loaded.machine, rows))
}

/// Opens a log as the machine file binds it, and returns it with the states of its rows in the requested time range and the
/// quality of its signals.
pub(super) fn open(
    path: &Path,
    file: &MachineFile,
    options: &Options,
) -> Result<(Log, LoadedLog, EstimatedRows, SignalQuality)> {
    let log = file.open_log(path)?;
    let mut loaded = load(&log, file, options.estimator, &mut |_| {})?;
    let (rows, quality) = estimate(&mut loaded, options)?;
    Ok((log, loaded, rows, quality))
}

/// A log's machine, its joint positions in the first valid row (NaN if there is none), and the gross inputs.
pub(crate) fn posture_in_log(
    path: &Path,
    file: &MachineFile,
) -> Result<(Machine, Vec<f64>, Vec<GrossInput>)> {
    let (log, loaded, rows, quality) = open(path, file, &Options::default())?;
    let gross_inputs = inputs::gross_inputs(&log, file, &loaded, &rows, &quality.rotations)?;
    loaded.check_read()?;
    let posture = first_posture(&loaded.machine, &rows);
    Ok((loaded.machine, posture, gross_inputs))
}

/// Estimates the offsets between the clocks of a log's topics that remain after those of the machine file.
///
/// # Errors
/// The machine does not fit the log, or it cannot be read.
pub fn clock_offsets(log: &Log, file: &MachineFile) -> Result<ClockOffsets> {
    let loaded = load(log, file, Estimator::Smoother, &mut |_| {})?;
    let (rows, _) = smoothed(&loaded, RowClock::JointStates)?;
    let forces = linkage_force::read_all(log, file, &loaded);
    let offsets = clock::estimate(&loaded, &forces, &rows);
    loaded.check_read()?;
    Ok(offsets)
}

/// States of all rows in the requested time range, and the offsets between the clocks of their topics,
/// corrected beforehand if requested.
pub(super) fn estimate_on_one_clock(
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
        let mut quality = quality;
        if clock.are_applicable() && quality.faults.iter().any(is_contradiction) {
            let on_one_clock = faults_on_one_clock(loaded, &clock, options)?;
            explain_by_clock(&mut quality.faults, &on_one_clock);
        }
        return Ok((rows, quality, clock));
    }
    drop(rows);
    loaded.signals = Arc::new(clock.corrected(&loaded.signals));
    clock.correct(forces);
    clock.set_applied();
    let (rows, quality) = estimate(loaded, options)?;
    Ok((rows, quality, clock))
}

/// Returns the faults that the checks would find if the estimated offsets between the clocks were applied.
fn faults_on_one_clock(
    loaded: &mut LoadedLog,
    clock: &ClockOffsets,
    options: &Options,
) -> Result<Vec<FaultSpan>> {
    let corrected = Arc::new(clock.corrected(&loaded.signals));
    let stated = std::mem::replace(&mut loaded.signals, corrected);
    let found = states_of_all_rows(loaded, options);
    let is_read = loaded.check_read();
    loaded.signals = stated;
    is_read?;
    found.map(|((_, quality), _)| quality.faults)
}

/// Blames the clock for contradictions between signals that vanish once the clocks agree.
fn explain_by_clock(faults: &mut [FaultSpan], on_one_clock: &[FaultSpan]) {
    let part_of = |span: &FaultSpan| (span.worst.part, span.worst.kind);
    for span in faults.iter_mut().filter(|span| is_contradiction(span)) {
        if !on_one_clock
            .iter()
            .any(|other| part_of(other) == part_of(span))
        {
            span.worst.explanation = Some(Explanation::Late);
        }
    }
}

fn is_contradiction(span: &FaultSpan) -> bool {
    span.worst.kind == FaultKind::Contradiction && span.worst.explanation.is_some()
}

/// Estimates the states of all rows in the requested time range. The sets of supports that the causal estimator knew replace
/// those that the whole log determines.
pub(super) fn estimate(
    loaded: &mut LoadedLog,
    options: &Options,
) -> Result<(EstimatedRows, SignalQuality)> {
    // where no end is asked for, rotations need no row
    let log = &*loaded;
    let (estimated, found) = rayon::join(
        || states_of_all_rows(log, options),
        || (options.to_s.is_none()).then(|| rotations::until(log, i64::MAX)),
    );
    let ((mut rows, mut quality), supports) = estimated?;
    loaded.supports = supports.or(loaded.supports.take());
    let first_ns = rows.times_ns.first().copied().unwrap_or(0);
    let at = |seconds: f64| first_ns.saturating_add((seconds * 1e9).round() as i64);
    let until_end = || rotations::until(loaded, options.to_s.map_or(i64::MAX, at));
    Rotations {
        found: quality.rotations,
        turning: quality.turning,
    } = found.unwrap_or_else(until_end)?;
    if let Some(from_ns) = options.from_s.map(at) {
        (quality.rotations).retain(|found| found.end_ns.is_none_or(|end_ns| end_ns >= from_ns));
    }
    if options.estimator == Estimator::Smoother {
        // each row knows what follows; where loads date the onset, it is known once they are computed
        let rotating: Vec<[i64; 2]> = (quality.rotations.iter())
            .map(FoundRotation::span_ns)
            .collect();
        rows.add_reason(&rotating, Reason::Tipping);
        let on_side: Vec<[i64; 2]> = (quality.rotations.iter())
            .filter_map(FoundRotation::on_side_ns)
            .collect();
        rows.add_reason(&on_side, Reason::SupportsUnknown);
    }
    Ok((within(rows, options), quality))
}

/// Estimates the states of all rows and, with the causal estimator, the supports that it knew in each row.
fn states_of_all_rows(
    loaded: &LoadedLog,
    options: &Options,
) -> Result<((EstimatedRows, SignalQuality), Option<SupportTimeline>)> {
    let clock = options
        .rate_hz
        .map_or(RowClock::JointStates, RowClock::Rate);
    match options.estimator {
        Estimator::Smoother => smoothed(loaded, clock).map(|estimated| (estimated, None)),
        Estimator::Causal => causal(loaded, clock),
    }
}

fn smoothed(loaded: &LoadedLog, clock: RowClock) -> Result<(EstimatedRows, SignalQuality)> {
    let machine = &loaded.machine;
    let smoother = block_smoother(loaded, clock)?;
    let mut shown = smoother.shown();
    // it takes no samples of payloads
    let payloads = loaded.beside.iter();
    let mut payloads =
        payloads.filter(|it| matches!(it.sensor, Sensor::Number(NumberKind::Payload, _)));
    if payloads.any(|it| !it.recording.has_changed()) {
        shown.unchanged.add(Proof::Payload);
    }
    let inherited = loaded.signal_doubts.inherited.doubts.iter();
    shown.disputed = inherited.fold(shown.disputed, |disputed, doubt| {
        disputed.with(doubt.disputed())
    });
    let quality = SignalQuality {
        counts: smoother.counts().collect(),
        faults: smoother.faults().to_vec(),
        noise: smoother.shown_noise(),
        rotations: Vec::new(),
        turning: Vec::new(),
        rotating: Vec::new(),
        // each row knows the whole log
        shown: vec![(i64::MIN, shown)],
        reversed: smoother.reversed().to_vec(),
        commands: Vec::new(),
    };
    let times_ns = smoother.row_times_ns().to_vec();
    let states = state_blocks::smoothed(machine, smoother);
    Ok((estimated(machine, times_ns, states), quality))
}

/// Reads the states of all rows once: keeps those that later checks need, and the activity of the machine in each row.
fn estimated(machine: &Machine, times_ns: Vec<i64>, states: Arc<dyn StateSource>) -> EstimatedRows {
    let mut kept = inputs::looked_at(&times_ns);
    if !machine.load_sensors().is_empty() || measures_supports(machine) {
        kept.extend(sampled_rows(times_ns.len()));
        kept.sort_unstable();
        kept.dedup();
    }
    EstimatedRows::new(machine, times_ns, states, &kept, |machine, state| {
        clock::activity(machine, state, inputs::is_quiet(machine, state))
    })
}

/// Same as live: sample by sample, in the order in which the recorder received them. With it, which supports were on the ground as
/// far as the estimator knew it in each row; `None` if they are always the same.
fn causal(
    loaded: &LoadedLog,
    clock: RowClock,
) -> Result<((EstimatedRows, SignalQuality), Option<SupportTimeline>)> {
    let machine = &loaded.machine;
    let mut estimator = CausalEstimator::new(machine, &loaded.matched.sensors, clock);
    let doubts = &loaded.signal_doubts;
    estimator.inherit(&doubts.inherited);
    if let Some(start_ns) = loaded.start_ns() {
        estimator.count_spans_from(start_ns);
    }
    let mut trusted = doubts.trusted.iter().peekable();
    let mut payloads = PayloadWatch::new(machine);
    let mut loads = LoadWatch::new(machine);
    let mut forces = ForceWatch::new(machine);
    let mut estimates: Vec<Estimate> = Vec::new();
    let mut faults = FaultSpans::default();
    loaded.for_each_arrival(|sample| {
        // somebody trusts a signal from the sample after a row on
        while let Some((_, signals)) = trusted
            .next_if(|(time_ns, _)| estimates.last().is_some_and(|row| *time_ns <= row.time_ns))
        {
            estimator.trust(*signals);
        }
        // the estimator counts rejected samples
        let pushed = estimator.push(machine, sample, &mut |row| {
            let mut row = row.clone();
            payloads.row(machine, &mut row);
            (loads.as_mut())
                .into_iter()
                .for_each(|loads| loads.row(machine, &mut row));
            (forces.as_mut())
                .into_iter()
                .for_each(|forces| forces.row(machine, &mut row));
            estimates.push(row);
        });
        if matches!(pushed, Ok(()) | Err(SampleError::NotFinite)) && !estimator.is_repeat() {
            faults.take(sample.sensor, sample.stamp_ns, estimator.findings());
        }
    })?;
    let mut states = StateColumns::unknown(machine, estimates.len());
    for (row, estimate) in estimates.iter_mut().enumerate() {
        states.set(row, &mut estimate.state);
    }
    let times_ns = estimates.iter().map(|e| e.time_ns).collect();
    let reasons = estimates.iter().map(|e| e.reasons).collect();
    let spells = estimates.chunk_by(|a, b| a.rotates == b.rotates);
    let spells = spells.filter(|spell| spell[0].rotates);
    let rotating = spells.map(|spell| [spell[0].time_ns, spell[spell.len() - 1].time_ns]);
    let rotating = rotating.collect();
    let changes = estimates.chunk_by(|a, b| a.shown == b.shown);
    let shown = changes.map(|rows| (rows[0].time_ns, rows[0].shown));
    let shown = shown.collect();
    let bits = |row: &Estimate| {
        row.commands
            .iter()
            .map(|rate| rate.to_bits())
            .collect::<Vec<_>>()
    };
    let commands = match machine.joint_commands().is_empty() {
        true => Vec::new(),
        false => (estimates.chunk_by(|a, b| bits(a) == bits(b)))
            .map(|rows| (rows[0].time_ns, rows[0].commands.clone()))
            .collect(),
    };
    let stands = |row: &Estimate| Some((row.time_ns, row.stands_on?));
    let supports = (loaded.supports.is_some())
        .then(|| SupportTimeline::of_rows(machine.supports(), estimates.iter().filter_map(stands)));
    let kept = KeptStates::of(machine, EstimatedStates { states, reasons });
    let quality = SignalQuality {
        counts: estimator.counts().to_vec(),
        faults: faults.finish(),
        noise: estimator.shown_noise(machine),
        rotations: Vec::new(),
        turning: Vec::new(),
        rotating,
        shown,
        reversed: estimator.plausibility().reversed(),
        commands,
    };
    let rows = estimated(machine, times_ns, Arc::new(kept));
    Ok(((rows, quality), supports))
}

/// Keeps the rows between `from_s` and `to_s`.
fn within(rows: EstimatedRows, options: &Options) -> EstimatedRows {
    let (from, to) = (
        options.from_s.unwrap_or(f64::NEG_INFINITY),
        options.to_s.unwrap_or(f64::INFINITY),
    );
    // Times rise from row to row. A limit that is not a number leaves none.
    let times = &rows.times_ns;
    let first = times.partition_point(|&time_ns| !(rows.seconds_at(time_ns) >= from));
    let last = times.partition_point(|&time_ns| rows.seconds_at(time_ns) <= to);
    rows.cut(first..last.max(first))
}

/// The first posture in which the machine can stand: joint positions; NaN if there is none.
pub(super) fn first_posture(machine: &Machine, rows: &EstimatedRows) -> Vec<f64> {
    let mut state = State::zero(machine);
    let mut postures = (0..rows.len()).filter_map(|row| {
        rows.state(row, &mut state);
        standing_posture(machine, &state, rows.reasons[row])
    });
    let first = postures.next();
    first.unwrap_or_else(|| vec![f64::NAN; machine.joints().len()])
}

#[cfg(test)]
mod tests {
    use tipwatch_mechanics::estimation::plausibility::{Amount, Component, Finding, Part};
    use tipwatch_mechanics::machine::Policy;

    use super::*;

    fn contradiction(part: Part, explanation: Explanation) -> FaultSpan {
        FaultSpan {
            worst: Finding {
                sensor: Sensor::Imu,
                part,
                kind: FaultKind::Contradiction,
                component: Component::Value,
                policy: Policy::Invalid,
                since_ns: 0,
                possible_since_ns: 0,
                stamp_ns: 1,
                measure: 30.0,
                limit: 22.5,
                amount: Amount::default(),
                explanation: Some(explanation),
            },
            start_ns: 0,
            end_ns: 1,
            until_ns: None,
            samples: 1,
        }
    }

    #[test]
    fn what_contradicts_on_one_clock_no_longer_is_told_by_the_clock() {
        let (arm, wheels) = (Part::Lean, Part::Rolling);
        let mut faults = [
            contradiction(arm, Explanation::UnstatedLoad),
            contradiction(wheels, Explanation::Signs),
        ];
        let on_one_clock = [contradiction(wheels, Explanation::Signs)];
        explain_by_clock(&mut faults, &on_one_clock);
        let told = faults.map(|span| span.worst.explanation);
        assert_eq!(told, [Some(Explanation::Late), Some(Explanation::Signs)]);
    }
}
