//! A row of `logs`: a log, with all that is known of it.

use crate::analysis::margin::WorstMargin;
use crate::events::EventKind;
use crate::policy::facts::{EXPOSURE_CAUSES, EventFacts, LogFacts, WheelFacts};
use crate::screen::merge::LogRow;
use crate::screen::record::Outcome;
use crate::tables::frame::{Day, record};

record! {
    /// A row of `logs`.
    pub(in crate::screen) struct FleetLog {
        /// name of the machine; null if none was assigned
        machine: Option<String>,
        /// type of the machine: `type` of the fleet file, else its URDF (unified robot description format); null without
        /// both
        machine_type: Option<String>,
        /// day of the first stamp (UTC); null if the stamps are no dates, and of failed logs
        day: Option<Day>,
        /// SHA-256 of the content. In a bucket, where only parts of a log are read: SHA-256 of its length and tag
        /// (ETag) in S3, whose tags are made of the bytes; elsewhere of its name, too
        log_id: Option<String>,
        /// absolute path or URL
        path: String,
        /// number of other paths with the same content
        copies: u64 ["files"],
        /// size
        bytes: Option<u64> ["bytes"],
        /// `analysed` or `failed`
        status: String,
        /// kind of [failure](#kinds-of-failure)
        failure: Option<String>,
        /// why it failed, without the log's path: equal reasons are equal texts
        reason: Option<String>,
        /// path of the report within the folder
        report: Option<String>,
        /// why the log decides nothing, by the rules of the run that wrote the data set; null if it does, and of failed logs
        undecided: Option<String>,
        /// SHA-256 of the machine file that the log was analysed with
        machine_file_sha256: Option<String>,
        /// version of the analysis: of program, machine file, URDF and options
        analysis_version: Option<String>,
        /// version of the program
        tipwatch_version: String,
        /// the model
        model: String,
        /// time of the first row
        start_ns: Option<i64> ["ns"],
        /// time of the last row
        end_ns: Option<i64> ["ns"],
        /// time between them
        duration_s: Option<f64> ["s"],
        /// number of rows
        rows: Option<u64> ["rows"],
        /// number of valid rows
        valid_rows: Option<u64> ["rows"],
        /// time that the log covers, see [Valid share](columns.md#valid-share)
        covered_s: Option<f64> ["s"],
        /// time of it in which wheel loads could be computed
        computable_s: Option<f64> ["s"],
        /// `computable_s / covered_s`: all other columns speak of this share of the log alone
        valid_share: Option<f64> ["-"],
        /// smallest OTF of any wheel as a share of its static load, under the stated split: 0 is a wheel about to lift
        worst_margin: Option<f64> ["-"],
        /// its standard deviation
        worst_margin_sigma: Option<f64> ["-"],
        /// the same under any split of the load: smallest of the largest loads that equilibrium allows the wheels, as a share
        /// of the static load, at most 1: 0 where a wheel was off the ground under every split
        margin_any_split: Option<f64> ["-"],
        /// the wheel with the worst margin
        worst_wheel: Option<String>,
        /// when that was
        worst_ns: Option<i64> ["ns"],
        /// its OTF at that time
        worst_otf: Option<f64> ["N"],
        /// standard deviation of that
        worst_otf_sigma: Option<f64> ["N"],
        /// speed of the machine at that time
        worst_speed: Option<f64> ["m/s"],
        /// angle of the platform against the vertical at that time
        worst_tilt: Option<f64> ["rad"],
        /// names of the joints other than those that turn wheels
        joints: Option<Vec<String>>,
        /// their positions at that time (rad or m)
        worst_posture: Option<Vec<Option<f64>>> ["rad or m"],
        /// time with a wheel off the ground under the stated split, by the lifts that are more likely than not
        lifted_s: Option<f64> ["s"],
        /// confidence of the surest lift under the stated split; null without a lift
        lift_certainty: Option<f64> ["-"],
        /// the same under any split
        lift_certainty_any_split: Option<f64> ["-"],
        /// what casts doubt on the loads: signals that were implausible or contradict each other during events, inputs that are
        /// grossly wrong or contradict the machine file, loads that nobody stated, measured loads that differ from computed ones
        doubted: Option<Vec<String>>,
        /// largest `1 - (OTF - 2 sigma) / static load`
        largest_utilisation: Option<f64> ["-"],
        /// names of the wheels
        wheels: Option<Vec<String>>,
        /// by wheel, the static load
        static_loads: Option<Vec<Option<f64>>> ["N"],
        /// by wheel, the smallest OTF
        least_otfs: Option<Vec<Option<f64>>> ["N"],
        /// by wheel, the smallest load
        least_loads: Option<Vec<Option<f64>>> ["N"],
        /// by wheel, the largest load
        largest_loads: Option<Vec<Option<f64>>> ["N"],
        /// seconds in each of 22 bins of the margin: below 0, twenty of width 0.05, 1 and above
        margin_s: Option<Vec<Option<f64>>> ["s"],
        /// seconds of `covered_s` in which the margin is not known
        unknown_s: Option<f64> ["s"],
        /// seconds with a margin below 1 minus `notice`
        exposed_s: Option<f64> ["s"],
        /// of `exposed_s`, by weight of chassis, wheels and arm other than in the static posture
        exposed_posture_s: Option<f64> ["s"],
        /// of `exposed_s`, by the slope
        exposed_slope_s: Option<f64> ["s"],
        /// of `exposed_s`, by the motion of the arm
        exposed_arm_motion_s: Option<f64> ["s"],
        /// of `exposed_s`, by acceleration of the platform
        exposed_platform_acceleration_s: Option<f64> ["s"],
        /// of `exposed_s`, by cornering
        exposed_cornering_s: Option<f64> ["s"],
        /// of `exposed_s`, by the force on the tool
        exposed_tool_force_s: Option<f64> ["s"],
        /// of `exposed_s`, by the specific force, where the attitude is unknown
        exposed_specific_force_s: Option<f64> ["s"],
        /// number of [events](events.md) of this kind; null if no row is computable; a lower bound if `valid_share` is
        /// below 1
        wheel_light_events: Option<u64> ["events"],
        /// the same
        wheel_lift_events: Option<u64> ["events"],
        /// the same
        edge_tipping_events: Option<u64> ["events"],
        /// the same
        tip_over_events: Option<u64> ["events"],
        /// number of gaps in the inputs
        input_gap_events: Option<u64> ["events"],
        /// number of faults of the inputs
        input_fault_events: Option<u64> ["events"],
        /// number of times between sparse rows in which a lift cannot be excluded
        lift_not_excluded_events: Option<u64> ["events"],
        /// lost ranges of the log
        lost_ranges: Option<u64> ["ranges"],
        /// bytes in them
        lost_bytes: Option<u64> ["bytes"],
        /// messages that the recorder counted and the log does not hold; null if a part was lost whose messages nobody
        /// counted
        missing_messages: Option<u64> ["messages"],
        /// messages that could not be decoded
        undecodable_messages: Option<u64> ["messages"],
        /// longest time without samples of a signal
        longest_gap_s: Option<f64> ["s"],
        /// the main findings, as texts
        findings: Option<Vec<String>>,
        /// notes of the analysis, as texts
        notes: Option<Vec<String>>,
    }
}

impl FleetLog {
    pub(in crate::screen) fn of(row: &LogRow, min_valid: f64) -> Self {
        let record = &row.record;
        let (facts, events) = record
            .analysed()
            .map_or((None, None), |(facts, events)| (Some(facts), Some(events)));
        let machine = record.machine.as_ref();
        let (failure, reason) = match &record.result {
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
        Self {
            machine: machine.map(|machine| machine.name.clone()),
            machine_type: machine.and_then(|machine| machine.kind.clone()),
            day: record.day(),
            log_id: record.log_id.as_deref().map(str::to_owned),
            path: record.path.clone(),
            copies: row.copies,
            bytes: record.bytes,
            status: match record.is_failed() {
                true => "failed".into(),
                false => "analysed".into(),
            },
            failure,
            reason,
            report: record
                .report_folder()
                .map(|folder| format!("{folder}/report.html")),
            undecided: facts
                .and_then(|facts| facts.undecided(min_valid))
                .map(|reason| reason.to_string()),
            machine_file_sha256: machine.map(|machine| machine.sha256.clone()),
            analysis_version: record.analysis_version.as_deref().map(str::to_owned),
            tipwatch_version: record.tipwatch_version.to_string(),
            model: record.model.to_string(),
            start_ns: facts.map(|facts| facts.start_ns),
            end_ns: facts.map(|facts| facts.end_ns),
            duration_s: facts.map(|facts| facts.duration_s),
            rows: facts.map(|facts| facts.rows),
            valid_rows: facts.map(|facts| facts.valid_rows),
            covered_s: coverage.map(|coverage| coverage.covered_s),
            computable_s: coverage.map(|coverage| coverage.computable_s),
            valid_share: coverage.and_then(|coverage| coverage.valid_share),
            worst_margin: worst.map(|worst| worst.margin),
            worst_margin_sigma: worst.and_then(|worst| worst.sigma),
            margin_any_split: facts.and_then(|facts| facts.margin_any_split),
            worst_wheel: worst.map(|worst| worst.wheel.to_string()),
            worst_ns: worst.map(|worst| worst.time_ns),
            worst_otf: worst.map(|worst| worst.otf_n),
            worst_otf_sigma: worst.and_then(|worst| worst.otf_sigma_n),
            worst_speed: moment.and_then(|moment| moment.speed_m_s),
            worst_tilt: moment.and_then(|moment| moment.tilt_rad),
            joints: moment.map(|moment| moment.joints.to_vec()),
            worst_posture: moment.map(|moment| moment.positions.clone()),
            lifted_s: count(EventKind::WheelLift).map(|_| lifted(events.unwrap_or_default()).0),
            lift_certainty: surest(|event| event.certainty),
            lift_certainty_any_split: surest(|event| event.certainty_any_split),
            doubted: facts.map(|facts| doubted(facts, events.unwrap_or_default(), str::to_owned)),
            largest_utilisation: facts.and_then(|facts| facts.largest_utilisation),
            wheels: facts.map(|facts| {
                let names = facts.wheels.iter().map(|wheel| wheel.name.to_string());
                names.collect()
            }),
            static_loads: by_wheel(|wheel| wheel.static_load_n),
            least_otfs: by_wheel(|wheel| wheel.least_otf_n),
            least_loads: by_wheel(|wheel| wheel.least_load_n),
            largest_loads: by_wheel(|wheel| wheel.largest_load_n),
            margin_s: exposure.and_then(|exposure| {
                let seconds = exposure.margin_s.as_ref()?.iter();
                Some(seconds.copied().map(Some).collect())
            }),
            unknown_s: exposure.map(|exposure| exposure.unknown_s),
            exposed_s: exposure.and_then(|exposure| exposure.exposed_s),
            exposed_posture_s: by_cause("posture"),
            exposed_slope_s: by_cause("slope"),
            exposed_arm_motion_s: by_cause("arm_motion"),
            exposed_platform_acceleration_s: by_cause("platform_acceleration"),
            exposed_cornering_s: by_cause("cornering"),
            exposed_tool_force_s: by_cause("tool_force"),
            exposed_specific_force_s: by_cause("specific_force"),
            wheel_light_events: count(EventKind::WheelLight),
            wheel_lift_events: count(EventKind::WheelLift),
            edge_tipping_events: count(EventKind::EdgeTipping),
            tip_over_events: count(EventKind::TipOver),
            input_gap_events: count(EventKind::InputGap),
            input_fault_events: count(EventKind::InputFault),
            lift_not_excluded_events: count(EventKind::LiftNotExcluded),
            lost_ranges: facts.map(|facts| facts.lost_ranges),
            lost_bytes: facts.map(|facts| facts.lost_bytes),
            missing_messages: facts.and_then(|facts| facts.missing_messages),
            undecodable_messages: facts.map(|facts| facts.undecodable_messages),
            longest_gap_s: facts.map(|facts| facts.longest_gap_s),
            findings: facts.map(|facts| facts.findings.clone()),
            notes: facts.map(|facts| facts.notes.iter().map(|note| note.to_string()).collect()),
        }
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

/// Whether a lift or fall that was found shows that the worst margin is too large: the loads before it do not lead there.
pub(in crate::screen) fn contradicts_margin(facts: &LogFacts, events: &[EventFacts]) -> bool {
    let is_positive = |worst: &WorstMargin| worst.margin > 2.0 * worst.sigma.unwrap_or(0.0);
    facts.worst.as_ref().is_some_and(is_positive) && lifts(events).any(EventFacts::is_fact)
}

/// What casts doubt on a log, each once, with the signals by this name.
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
        doubted.push("The worst margin is above zero, and what was found contradicts it".into());
    }
    doubted.sort();
    doubted.dedup();
    doubted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::frame::Record;

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
