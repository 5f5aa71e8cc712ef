//! A row of `events`: an event of a log.

use crate::base::frame::{Day, record};
use crate::policy::facts::EventFacts;
use crate::screen::merge::LogRow;

record! {
    /// The log of an event.
    pub(in crate::screen) struct OfLog {
        /// name of the machine
        machine: Option<String>,
        /// day of the log's first row (UTC)
        day: Option<Day>,
        /// the log, as in `logs`
        log_id: Option<String>,
        /// its path
        path: String,
    }
}

/// A row of `events`.
pub(super) type FleetEvent<'a> = (OfLog, &'a EventFacts);

/// The events of a log.
pub(super) fn all_of(row: &LogRow) -> impl Iterator<Item = FleetEvent<'_>> {
    let record = &row.record;
    let events = record.analysed().map_or(&[][..], |(_, events)| events);
    let of_log = || OfLog {
        machine: record.machine.as_ref().map(|machine| machine.name.clone()),
        day: record.day(),
        log_id: record.log_id.as_deref().map(str::to_owned),
        path: record.path.clone(),
    };
    events.iter().map(move |event| (of_log(), event))
}
