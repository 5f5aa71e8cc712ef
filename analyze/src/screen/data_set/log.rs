//! A row of `logs`: a log, with all that is known of it.

use tipwatch_language::word;
use tipwatch_mechanics::number::SURE_SIGMAS;

use crate::analysis::margin::WorstMargin;
use crate::base::frame::{Day, record};
use crate::events::EventKind;
use crate::policy::facts::{EXPOSURE_CAUSES, EventFacts, LogFacts, WheelFacts};
use crate::screen::merge::LogRow;
use crate::screen::record::Outcome;

record! {
    /// A row of `logs`.
    pub(in crate::screen) struct FleetLog of (row: &LogRow, min_valid: f64) {
        let record = &row.record;
        let (facts, events) = record
            .analysed()
            .map_or((None, None), |(facts, events)| (Some(facts), Some(events)));
        let machine = record.machine.as_ref();
        let (kind, why) = match &record.result {
            Outcome::Failed { kind, reason } => (Some(kind.to_string()), Some(reason.clone())),
            Outcome::Analysed { .. } => (None, None),
        };
        let worst = facts.and_then(|facts| facts.worst.as_ref());
        let moment = worst.and_then(|worst| worst.moment.as_ref());
        let coverage = facts.map(|facts| facts.coverage);
        let exposure = facts.map(|facts| &facts.exposure);
        let by_cause = |cause: &str| {
            let place = EXPOSURE_CAUSES.iter().position(|known| *known == cause)?;
            let seconds = exposure?.exposed_by_cause_s.as_ref()?;
            seconds.get(place).copied()
        };
        let count = |kind: EventKind| facts?.events_of(kind);
        let by_wheel = |of: fn(&WheelFacts) -> Option<f64>| {
            let wheels = facts?.wheels.iter();
            Some(wheels.map(of).collect::<Vec<_>>())
        };
        let lifts = || lifts(events.unwrap_or_default());
        let surest = |of: fn(&EventFacts) -> Option<f64>| lifts().filter_map(of).reduce(f64::max);
    } {
        /// name of the machine; null if none was assigned
        machine: Option<String> = machine.map(|machine| machine.name.clone()),
        /// type of the machine: `type` of the fleet file, else its URDF (unified robot description format); null without
        /// both
        machine_type: Option<String> = machine.and_then(|machine| machine.kind.clone()),
        /// day of the first row (UTC), by the clock of the stamps or, where those are no dates, by the recorder's; null if neither tells it, and of failed logs
        day: Option<Day> = record.day(),
        /// SHA-256 of the content. In a bucket, where only parts of a log are read: SHA-256 of its length and tag
        /// (ETag) in S3, whose tags are made of the bytes; elsewhere of its name, too
        log_id: Option<String> = record.log_id.as_deref().map(str::to_owned),
        /// absolute path or URL
        path: String = record.path.clone(),
        /// number of other paths with the same content
        copies: u64 ["files"] = row.copies,
        /// size
        bytes: Option<u64> ["bytes"] = record.bytes,
        /// `analysed` or `failed`
        status: String = match record.is_failed() {
            true => "failed".into(),
            false => "analysed".into(),
        },
        /// kind of [failure](#kinds-of-failure)
        failure: Option<String> = kind,
        /// why it failed, without the log's path: equal reasons are equal texts
        reason: Option<String> = why,
        /// path of the report within the folder
        report: Option<String> = record
            .report_folder()
            .map(|folder| format!("{folder}/report.html")),
        /// why the log decides nothing, by the rules of the run that wrote the data set; null if it does, and of failed logs
        undecided: Option<String> = facts
            .and_then(|facts| facts.undecided(min_valid))
            .map(|reason| reason.to_string()),
        /// SHA-256 of the machine file that the log was analysed with
        machine_file_sha256: Option<String> = machine.map(|machine| machine.sha256.clone()),
        /// version of the analysis: of program, machine file, URDF and options
        analysis_version: Option<String> = record.analysis_version.as_deref().map(str::to_owned),
        /// version of the program
        tipwatch_version: String = record.tipwatch_version.to_string(),
        /// the model
        model: String = record.model.to_string(),
        /// time of the first row
        start_ns: Option<i64> ["ns"] = facts.map(|facts| facts.start_ns),
        /// time of the last row
        end_ns: Option<i64> ["ns"] = facts.map(|facts| facts.end_ns),
        /// time between them
        duration_s: Option<f64> ["s"] = facts.map(|facts| facts.duration_s),
        /// number of rows
        rows: Option<u64> ["rows"] = facts.map(|facts| facts.rows),
        /// number of valid rows
        valid_rows: Option<u64> ["rows"] = facts.map(|facts| facts.valid_rows),
        /// time that the log covers, see [Valid share](columns.md#valid-share)
        covered_s: Option<f64> ["s"] = coverage.map(|coverage| coverage.covered_s),
        /// time of it in which wheel loads could be computed
        computable_s: Option<f64> ["s"] = coverage.map(|coverage| coverage.computable_s),
        /// `computable_s / covered_s`: all other columns speak of this share of the log alone
        valid_share: Option<f64> ["-"] = coverage.and_then(|coverage| coverage.valid_share),
        /// smallest OTF of any wheel as a share of its static load, under the stated split: 0 is a wheel about to lift
        worst_margin: Option<f64> ["-"] = worst.map(|worst| worst.margin),
        /// its standard deviation
        worst_margin_sigma: Option<f64> ["-"] = worst.and_then(|worst| worst.sigma),
        /// the same under any split of the load: smallest of the largest loads that equilibrium allows the wheels, as a share
        /// of the static load, at most 1: 0 where a wheel was off the ground under every split
        margin_any_split: Option<f64> ["-"] = facts.and_then(|facts| facts.margin_any_split),
        /// the wheel with the worst margin
        worst_wheel: Option<String> = worst.map(|worst| worst.wheel.to_string()),
        /// when that was
        worst_ns: Option<i64> ["ns"] = worst.map(|worst| worst.time_ns),
        /// its OTF at that time
        worst_otf: Option<f64> ["N"] = worst.map(|worst| worst.otf_n),
        /// standard deviation of that
        worst_otf_sigma: Option<f64> ["N"] = worst.and_then(|worst| worst.otf_sigma_n),
        /// speed of the machine at that time
        worst_speed: Option<f64> ["m/s"] = moment.and_then(|moment| moment.speed_m_s),
        /// angle of the platform against the vertical at that time
        worst_tilt: Option<f64> ["rad"] = moment.and_then(|moment| moment.tilt_rad),
        /// names of the joints other than those that turn wheels
        joints: Option<Vec<String>> = moment.map(|moment| moment.joints.to_vec()),
        /// their positions at that time (rad or m)
        worst_posture: Option<Vec<Option<f64>>> ["rad or m"] = moment.map(|moment| moment.positions.clone()),
        /// time with a wheel off the ground under the stated split, by the lifts that are more likely than not
        lifted_s: Option<f64> ["s"] = count(EventKind::WheelLift).map(|_| lifted(events.unwrap_or_default()).0),
        /// confidence of the surest lift under the stated split; null without a lift
        lift_certainty: Option<f64> ["-"] = surest(|event| event.certainty),
        /// the same under any split
        lift_certainty_any_split: Option<f64> ["-"] = surest(|event| event.certainty_any_split),
        /// what casts doubt on the loads: signals that were implausible or contradict each other during events, inputs that are
        /// grossly wrong or contradict the machine file, loads that nobody stated, measured loads that differ from computed ones
        doubted: Option<Vec<String>> = facts.map(|facts| doubted(facts, events.unwrap_or_default(), str::to_owned)),
        /// largest `1 - (OTF - 2 sigma) / static load`
        largest_utilisation: Option<f64> ["-"] = facts.and_then(|facts| facts.largest_utilisation),
        /// names of the wheels
        wheels: Option<Vec<String>> = facts.map(|facts| {
            let names = facts.wheels.iter().map(|wheel| wheel.name.to_string());
            names.collect()
        }),
        /// by wheel, the static load
        static_loads: Option<Vec<Option<f64>>> ["N"] = by_wheel(|wheel| wheel.static_load_n),
        /// by wheel, the smallest OTF
        least_otfs: Option<Vec<Option<f64>>> ["N"] = by_wheel(|wheel| wheel.least_otf_n),
        /// by wheel, the smallest load
        least_loads: Option<Vec<Option<f64>>> ["N"] = by_wheel(|wheel| wheel.least_load_n),
        /// by wheel, the largest load
        largest_loads: Option<Vec<Option<f64>>> ["N"] = by_wheel(|wheel| wheel.largest_load_n),
        /// seconds in each of 22 bins of the margin: below 0, twenty of width 0.05, 1 and above
        margin_s: Option<Vec<Option<f64>>> ["s"] = exposure.and_then(|exposure| {
            let seconds = exposure.margin_s.as_ref()?.iter();
            Some(seconds.copied().map(Some).collect())
        }),
        /// seconds of `covered_s` in which the margin is not known
        unknown_s: Option<f64> ["s"] = exposure.map(|exposure| exposure.unknown_s),
        /// seconds with a margin below 1 minus `notice`
        exposed_s: Option<f64> ["s"] = exposure.and_then(|exposure| exposure.exposed_s),
        /// of `exposed_s`, by weight of chassis, wheels and arm other than in the static posture
        exposed_posture_s: Option<f64> ["s"] = by_cause("posture"),
        /// of `exposed_s`, by the slope
        exposed_slope_s: Option<f64> ["s"] = by_cause("slope"),
        /// of `exposed_s`, by the motion of the arm
        exposed_arm_motion_s: Option<f64> ["s"] = by_cause("arm_motion"),
        /// of `exposed_s`, by acceleration of the platform
        exposed_platform_acceleration_s: Option<f64> ["s"] = by_cause("platform_acceleration"),
        /// of `exposed_s`, by cornering
        exposed_cornering_s: Option<f64> ["s"] = by_cause("cornering"),
        /// of `exposed_s`, by the force on the tool
        exposed_tool_force_s: Option<f64> ["s"] = by_cause("tool_force"),
        /// of `exposed_s`, by the specific force, where the attitude is unknown
        exposed_specific_force_s: Option<f64> ["s"] = by_cause("specific_force"),
        /// number of [events](events.md) of this kind; null if no row is computable; a lower bound if `valid_share` is
        /// below 1
        wheel_light_events: Option<u64> ["events"] = count(EventKind::WheelLight),
        /// the same
        wheel_lift_events: Option<u64> ["events"] = count(EventKind::WheelLift),
        /// the same
        edge_tipping_events: Option<u64> ["events"] = count(EventKind::EdgeTipping),
        /// the same
        tip_over_events: Option<u64> ["events"] = count(EventKind::TipOver),
        /// number of gaps in the inputs
        input_gap_events: Option<u64> ["events"] = count(EventKind::InputGap),
        /// number of faults of the inputs
        input_fault_events: Option<u64> ["events"] = count(EventKind::InputFault),
        /// number of times between sparse rows in which a lift cannot be excluded
        lift_not_excluded_events: Option<u64> ["events"] = count(EventKind::LiftNotExcluded),
        /// lost ranges of the log
        lost_ranges: Option<u64> ["ranges"] = facts.map(|facts| facts.lost_ranges),
        /// bytes in them
        lost_bytes: Option<u64> ["bytes"] = facts.map(|facts| facts.lost_bytes),
        /// messages that the recorder counted and the log does not hold; null if a part was lost whose messages nobody
        /// counted
        missing_messages: Option<u64> ["messages"] = facts.and_then(|facts| facts.missing_messages),
        /// messages that could not be decoded
        undecodable_messages: Option<u64> ["messages"] = facts.map(|facts| facts.undecodable_messages),
        /// longest time without samples of a signal
        longest_gap_s: Option<f64> ["s"] = facts.map(|facts| facts.longest_gap_s),
        /// the main findings, as texts
        findings: Option<Vec<String>> = facts.map(|facts| facts.findings.clone()),
        /// notes of the analysis, as texts
        notes: Option<Vec<String>> = facts.map(|facts| facts.notes.iter().map(|note| note.to_string()).collect()),
    }
}

/// The events in which a wheel is off the ground.
fn lifts(events: &[EventFacts]) -> impl Iterator<Item = &EventFacts> {
    events.iter().filter(|event| event.kind.is_lift())
}

/// Time in which at least one wheel was off the ground, and its standard deviation (s), by the lifts that are more likely than
/// not: an end is taken to be known as well as the start.
pub(in crate::screen) fn lifted(events: &[EventFacts]) -> (f64, f64) {
    let mut spans: Vec<(i64, i64, f64)> = lifts(events)
        .filter(|event| event.is_fact())
        .map(|event| {
            let lasts_ns = (event.duration_s * 1e9).round() as i64;
            let end_ns = event.start_ns.saturating_add(lasts_ns);
            (event.start_ns, end_ns, event.start_sigma_s.unwrap_or(0.0))
        })
        .collect();
    spans.sort_unstable_by_key(|&(start, end, _)| (start, end));
    let (mut seconds, mut variance, mut until) = (0.0, 0.0, i64::MIN);
    for (start, end, sigma_s) in spans {
        let from = start.max(until);
        if start > until {
            variance += 2.0 * sigma_s.powi(2);
        }
        if end > from {
            seconds += (end - from) as f64 * 1e-9;
            until = end;
        }
    }
    (seconds, f64::sqrt(variance))
}

/// Whether a lift or fall that was found shows that the worst margin is too large: the loads before the event do not lead there.
pub(in crate::screen) fn contradicts_margin(facts: &LogFacts, events: &[EventFacts]) -> bool {
    let is_positive = |worst: &WorstMargin| worst.margin > SURE_SIGMAS * worst.sigma.unwrap_or(0.0);
    facts.worst.as_ref().is_some_and(is_positive) && lifts(events).any(EventFacts::is_fact)
}

/// Returns the doubts about a log, each once, with the signals by this name.
pub(in crate::screen) fn doubted(
    facts: &LogFacts,
    events: &[EventFacts],
    name: impl Fn(&str) -> String,
) -> Vec<String> {
    let signals = events.iter().flat_map(|event| {
        let is_implausible = event.kind == EventKind::InputFault;
        let own = is_implausible.then_some(&*event.subject);
        let others = event.doubted_by.iter().flatten();
        others.map(String::as_str).chain(own)
    });
    let mut doubted: Vec<String> = signals.map(name).collect();
    doubted.extend(facts.gross_inputs.iter().chain(&facts.doubts).cloned());
    if contradicts_margin(facts, events) {
        doubted.push(
            word!("The worst margin is above zero, and what was found contradicts it").into(),
        );
    }
    doubted.sort();
    doubted.dedup();
    doubted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::frame::Record;

    #[test]
    fn every_kind_of_event_and_every_cause_has_a_column() {
        let has = |name: String| FleetLog::columns().iter().any(|column| column.name == name);
        for kind in EventKind::ALL {
            assert!(has(format!("{}_events", kind.name())), "{}", kind.name());
        }
        for cause in EXPOSURE_CAUSES {
            assert!(has(format!("exposed_{cause}_s")), "{cause}");
        }
    }
}
