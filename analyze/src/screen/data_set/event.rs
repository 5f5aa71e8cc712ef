//! A row of `events`: an event of a log.

use crate::policy::facts::EventFacts;
use crate::screen::merge::LogRow;
use crate::tables::frame::{Day, record};

record! {
    /// A row of `events`.
    pub(in crate::screen) struct FleetEvent {
        /// name of the machine
        machine: Option<String>,
        /// day of the log's first stamp (UTC)
        day: Option<Day>,
        /// the log, as in `logs`
        log_id: Option<String>,
        /// its path
        path: String,
        /// as in [Events](events.md)
        kind: String,
        /// the wheel, edge or signal
        subject: String,
        /// start
        start_ns: i64 ["ns"],
        /// end; null if it lasts until the log ends
        end_ns: Option<i64> ["ns"],
        /// how long it lasted, until the log ends if it is still active
        duration_s: f64 ["s"],
        /// the worst value
        worst: Option<f64> ["column unit"],
        /// unit of `worst`
        unit: String,
        /// time of the worst value
        worst_ns: i64 ["ns"],
        /// time from the onset of the first `wheel_light`
        lead_s: Option<f64> ["s"],
        /// confidence: probability that the finding is true under the stated split
        certainty: Option<f64> ["-"],
        /// whether another admissible split of the load would undo it
        split_dependent: Option<bool>,
        /// the cause that took most of the load
        main_cause: Option<String>,
        /// its share
        main_cause_percent: Option<f64> ["%"],
        /// probability that the finding is true under any split
        certainty_any_split: Option<f64> ["-"],
        /// standard deviation of the start
        start_sigma_s: Option<f64> ["s"],
        /// signals that contradict each other during the event
        doubted_by: Option<Vec<String>>,
    }
}

impl FleetEvent {
    /// The events of a log.
    pub(super) fn all_of(row: &LogRow) -> impl Iterator<Item = Self> {
        let events = row.record.analysed().map_or(&[][..], |(_, events)| events);
        events.iter().map(|event| Self::of(row, event))
    }

    fn of(row: &LogRow, event: &EventFacts) -> Self {
        let (record, event) = (&row.record, event.clone());
        Self {
            machine: record.machine.as_ref().map(|machine| machine.name.clone()),
            day: record.day(),
            log_id: record.log_id.clone(),
            path: record.path.clone(),
            kind: event.kind,
            subject: event.subject,
            start_ns: event.start_ns,
            end_ns: event.end_ns,
            duration_s: event.duration_s,
            worst: event.worst,
            unit: event.unit,
            worst_ns: event.worst_ns,
            lead_s: event.lead_s,
            certainty: event.certainty,
            split_dependent: event.split_dependent,
            main_cause: event.main_cause,
            main_cause_percent: event.main_cause_percent,
            certainty_any_split: event.certainty_any_split,
            start_sigma_s: event.start_sigma_s,
            doubted_by: Some(event.doubted_by),
        }
    }
}
