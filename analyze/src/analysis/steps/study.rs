//! Last step: results of the rows: events and their causes, advice, sensitivities, key figures, notes.

use anyhow::Result;
use rayon::prelude::*;
use tipwatch_mechanics::machine::{Machine, Proofs};
use tipwatch_mechanics::state::StreamCounts;

use super::super::advice::{Advice, advise, ask_all};
use super::super::clock::text::Clocks;
use super::super::estimate::SignalQuality;
use super::super::gather::{Prepared, RowSink, gather};
use super::super::monte_carlo::DrawnMachines;
use super::super::notes::{Assumptions, NotedLog, Notes, UnusedMessages};
use super::super::provenance::provenance;
use super::super::result::InputNoise;
use super::super::sensitivity::{SensitivityPass, SensitivityTable};
use super::super::standing_rows::{StandingRows, min_loads};
use super::super::study::StudiedLog;
use super::super::task::Task;
use super::super::unstated_load::{self, ExplainedFall};
use super::check::CheckedLog;
use super::estimate::SampleFindings;
use super::evaluate::EvaluatedLog;
use super::prepare::PreparedMachine;
use super::read::ReadLog;
use crate::analysis::{Analysis, Coverage, Input, Sources};
use crate::base::table::Table;
use crate::events::{self, Event, FoundRotation, LowestOtf, ShownBy, Stories};
use crate::load::LoadedLog;

/// Computes all rows once, block by block, and studies them. The sink that `begin` makes receives the blocks.
///
/// # Errors
/// The sink fails, or states or files cannot be read.
pub(in crate::analysis) fn study<S: RowSink>(
    task: &Task<'_>,
    read: ReadLog,
    prepared: PreparedMachine,
    checked: CheckedLog,
    evaluated: EvaluatedLog,
    begin: impl FnOnce(&Prepared<'_>) -> Result<S>,
) -> Result<(Analysis, S)> {
    let ReadLog {
        loaded,
        quasi_static,
        scope,
        hashes,
        ..
    } = read;
    let EvaluatedLog {
        mut table,
        mut samples,
        rotations,
        turning,
        others,
        commissioning,
    } = evaluated;
    let machine = prepared.named(&loaded.machine);
    let min_loads_n = min_loads(machine);
    let mut input_events = events::of_inputs(&loaded, &samples.quality.faults, &table);
    input_events.extend(checked.contradicted);
    let mut sink = begin(&Prepared {
        machine,
        table: &table,
        options: &task.options,
        input_events: &input_events,
        measured_loads: &prepared.measured_loads,
    })?;
    let drawn = (task.options.monte_carlo).map(|draws| DrawnMachines::new(machine, draws));
    let standing = StandingRows::all(machine, &table, min_loads);
    let studied = StudiedLog {
        machine,
        table: &table,
        scope,
        min_loads_n: min_loads_n.as_deref(),
        standing: &standing,
        rotations: &rotations,
        measured_loads: &prepared.measured_loads,
        others: &others,
    };
    let found = gather(&studied, drawn.as_ref(), &mut sink)?;
    drop(standing);
    let provenance = provenance(
        &task.log,
        hashes.finish()?,
        task.file,
        &loaded,
        commissioning.as_ref(),
    )?;
    table.check()?;
    table.reasons = found.reasons;
    let mut coverage = Coverage::of(&loaded, &table, &rotations, &task.options);
    let (not_excluded, exclusion) = found.exclusion;
    coverage.between_rows = exclusion.map(|found| found.within(coverage.covered_s));
    // what is only possible has no lead time
    input_events.extend(not_excluded);
    let mut events = all_events(machine, found.events.all, input_events, &rotations);
    checked.load_comparison.weigh(&mut events);
    // with the reasons that the events added
    let standing = StandingRows::all(machine, &table, min_loads);
    let told = Told {
        table: &table,
        standing: &standing,
        stories: Stories {
            machine,
            table: &table,
            scope,
            rotations: &rotations,
        },
    };
    let is_explained = scope.sensitivities && task.is_recorded() && samples.gross_inputs.is_empty();
    let explained_falls = match is_explained {
        true => told.explain(&mut events),
        false => Vec::new(),
    };
    let reversed = match task.supposed {
        Some((_, recorded)) => recorded.reversed.clone(),
        None => std::mem::take(&mut samples.quality.reversed),
    };
    if scope.sensitivities {
        // a sign is the same at every position
        let commissioned = (commissioning.as_ref())
            .map_or(Proofs::NONE, |(_, found)| found.proven(machine).proofs());
        unstated_load::weigh_signs(&standing, &table, &reversed, commissioned, &mut events);
    }
    let mut turning = turning.into_iter();
    let turning =
        turning.find(|turning| !turning.is_known(&events) && events::may_be_fall(turning, &table));
    let tables = told.sensitivities(&found.sensitivity);
    let lowest = found.events.lowest.as_ref();
    let advice = told.prevent(&tables, lowest, &found.postures, &explained_falls, &events);
    let sensitivity = (tables.into_iter().flatten())
        .min_by(|one, other| one.worst_share.total_cmp(&other.worst_share));
    drop(standing);
    let monte_carlo = drawn.map(|drawn| drawn.finish(machine, found.bands));
    let inputs = inputs(&loaded, &samples);
    let clock = Clocks::new(&loaded.signals, samples.clock);
    let of_zeros = found.signs.of_zeros(&loaded.machine, table.shown());
    // those that concern every number first
    let told: [&dyn Notes; 18] = [
        &found.mounting,
        &samples.note_on_slope,
        &samples.note_on_ground,
        &quasi_static,
        &Assumptions,
        &found.torques,
        &found.bias,
        &found.signs,
        &found.predictions,
        &UnusedMessages,
        &clock,
        &prepared.payloads,
        &loaded.losses,
        &of_zeros,
        &samples.untested_mounting,
        &samples.quality.noise,
        &*prepared.measured_loads,
        &checked.load_comparison,
    ];
    let noted = NotedLog {
        loaded: &loaded,
        machine: prepared.named(&loaded.machine),
        is_recorded: task.is_recorded(),
        start_ns: table.times_ns[0],
    };
    let notes = told.iter().flat_map(|found| found.notes(&noted)).collect();
    let log_times = loaded
        .signals
        .first()
        .map(|first| first.recording.log_times.clone());
    let analysis = Analysis {
        sources: Sources {
            machine_file: task.file.effective_text().into_owned(),
            urdf: loaded.urdf_text,
        },
        inputs,
        health: samples.health,
        machine: match prepared.on_supports {
            Some((named, _)) => named,
            None => loaded.machine,
        },
        options: task.options,
        transfers: task.log.transfers(),
        provenance,
        notes,
        losses: loaded.losses,
        gross_inputs: samples.gross_inputs,
        rows: table,
        digest: found.digest,
        torques: found.torques,
        margins: found.margins,
        coverage,
        min_loads_n,
        events,
        reversed,
        turning,
        sensitivity,
        advice,
        explained_falls,
        monte_carlo,
        payloads: prepared.payloads,
        comparisons: found.comparisons,
        clock,
        measured_loads: prepared.measured_loads,
        load_comparison: checked.load_comparison,
        log_times: log_times.unwrap_or_default(),
        clips: None,
    };
    Ok((analysis, sink))
}

/// The rows of a log whose events are known.
struct Told<'a> {
    table: &'a Table,
    /// Rows on each set of supports.
    standing: &'a [StandingRows<'a>],
    stories: Stories<'a>,
}

impl Told<'_> {
    /// Explains the falls among the events, and adds to each event its counterfactuals and its doubts.
    fn explain(&self, events: &mut [Event]) -> Vec<ExplainedFall> {
        let Self {
            table,
            standing,
            stories,
        } = self;
        ask_all(stories.machine, standing, table, events);
        let falls = unstated_load::study(table, &unstated_load::falls(table, events));
        unstated_load::set_no_returns(stories, &falls, events);
        unstated_load::doubt_contradicted(stories.machine, &falls, events);
        falls
    }

    /// Derivatives of the loads where they change most, on each set of supports.
    fn sensitivities(&self, passes: &[SensitivityPass]) -> Vec<Option<SensitivityTable>> {
        let passes = passes.iter().zip(self.standing);
        passes
            .map(|(pass, standing)| pass.table(standing, self.stories.machine))
            .collect()
    }

    /// The changes that would have prevented the worst event.
    fn prevent(
        &self,
        sensitivities: &[Option<SensitivityTable>],
        lowest: Option<&LowestOtf>,
        postures: &[[f64; 2]],
        falls: &[ExplainedFall],
        events: &[Event],
    ) -> Option<Advice> {
        // what would have kept another machine on its wheels is no advice for the one that fell
        let is_as_stated = falls.iter().all(ExplainedFall::is_as_stated);
        let lowest = lowest.filter(|lowest| {
            // nor is what follows an onset that the log does not show
            let at_ns = self.table.times_ns[lowest.row];
            is_as_stated && !Event::is_in_fall_under_way(events, at_ns)
        })?;
        let place = StandingRows::place_of(lowest.row, self.table)?;
        let (standing, sensitivities) = (self.standing.get(place)?, sensitivities.get(place)?);
        advise(standing, events, lowest, sensitivities.as_ref()?, postures)
    }
}

/// The events of the rows and those without a lead time, in order. Of a machine on its side, nothing is light.
fn all_events(
    machine: &Machine,
    mut found: Vec<Event>,
    others: Vec<Event>,
    rotations: &[FoundRotation],
) -> Vec<Event> {
    let on_side = rotations.iter().filter_map(FoundRotation::on_side_ns);
    let on_side: Vec<[i64; 2]> = on_side.collect();
    found.retain(|event| {
        let within = |[from, to]: &[i64; 2]| (*from..=*to).contains(&event.start_ns);
        matches!(event.shown_by, Some(ShownBy::Rotation | ShownBy::Both))
            || !on_side.iter().any(within)
    });
    events::sorted(machine, found, others)
}

/// The signals used, with the quality of their recording.
fn inputs(loaded: &LoadedLog, samples: &SampleFindings) -> Vec<Input> {
    let SignalQuality { counts, noise, .. } = &samples.quality;
    let signals = loaded.signals.par_iter().map(|signal| {
        let (reading, sensor) = (&signal.recording.reading, signal.sensor);
        let counts = counts.iter().find(|(of, _)| *of == sensor);
        let counts = counts.map_or_else(StreamCounts::default, |(_, counts)| *counts);
        let noise = noise.iter().filter(|noise| noise.sensor == sensor);
        Input {
            signal: signal.name,
            subject: signal.subject.clone(),
            clock: format!("{}: {}", reading.clock.source, reading.clock.reason),
            samples_used: counts.used,
            samples_not_later: counts.not_later,
            samples_not_finite: counts.not_finite,
            samples_implausible: counts.implausible,
            noise: noise
                .map(|noise| InputNoise {
                    key: noise.key,
                    stated: noise.stated,
                    shown: noise.shown,
                })
                .collect(),
            topic: signal.topic.clone(),
            type_name: signal.type_name.clone(),
            why: signal.why.clone(),
            timing: reading.statistics.timing(),
            correction: reading.correction,
            undecodable: reading.undecodable,
        }
    });
    signals.collect()
}
