//! The record of a finished log: one small document.

use serde::{Deserialize, Serialize};
use tipwatch_binding::sha256;

use super::failure::FailureKind;
use crate::analysis::calendar::YEARS_NS;
use crate::base::frame::Day;
use crate::base::shared::{Pool, Shared};
use crate::policy::facts::{EventFacts, LogFacts};

/// Version of the document.
pub(super) const RECORD_SCHEMA: u32 = 6;
/// The oldest version that is still read: what it does not tell is unknown.
pub(super) const OLDEST_SCHEMA: u32 = 3;

/// A finished log: analysed or failed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    /// Version of this document's keys.
    pub(super) schema: u32,
    /// Absolute path of the log.
    pub(super) path: String,
    /// SHA-256 of its content; `None` if it cannot be read.
    pub(super) log_id: Option<Shared<str>>,
    /// Length of its files (bytes).
    pub(super) bytes: Option<u64>,
    /// The machine; `None` if unknown.
    pub(super) machine: Option<Shared<MachineName>>,
    /// See [`super::version`]; `None` without a machine.
    pub(super) analysis_version: Option<Shared<str>>,
    /// Version of the program.
    pub(super) tipwatch_version: Shared<str>,
    /// Hash of its sources; `None` in records of before it was kept.
    #[serde(default)]
    pub(super) sources: Option<Shared<str>>,
    /// Name of the model.
    pub(super) model: Shared<str>,
    /// Time at which the log was finished (ns since 1970, UTC). It only orders the records of one path; the data set does not
    /// contain it.
    pub(super) finished_ns: i64,
    /// The result.
    pub(super) result: Outcome,
}

/// Records of many logs. A sort moves none of them, and no second list holds them themselves.
#[allow(clippy::vec_box, reason = "see above")]
pub(super) type Records = Vec<Box<Record>>;

/// The machine that a log was analysed with.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) struct MachineName {
    /// Its name.
    pub(super) name: String,
    /// SHA-256 of its machine file.
    pub(super) sha256: String,
    /// Identity of the URDF and DBC files that it names, see [`super::version::named_files`]; `None` in records of before it
    /// was kept.
    #[serde(default)]
    pub(super) named_files: Option<String>,
    /// Its type; `None` if the fleet file states none and the machine file names no URDF.
    pub(super) kind: Option<String>,
}

impl MachineName {
    /// Whether both were made from one machine file and the same files that it names. Files that an older record does not name
    /// count as the same.
    pub(super) fn is_of_same_files(&self, other: &Self) -> bool {
        let named = self.named_files.as_ref().zip(other.named_files.as_ref());
        self.sha256 == other.sha256 && named.is_none_or(|(a, b)| a == b)
    }
}

/// The result of a log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub(super) enum Outcome {
    /// The log was analysed.
    Analysed {
        /// Its facts.
        facts: Box<LogFacts>,
        /// Its events.
        events: Vec<EventFacts>,
        /// Whether a report was written.
        has_report: bool,
    },
    /// The log could not be analysed.
    Failed {
        /// Kind of the failure.
        kind: FailureKind,
        /// The reason.
        reason: String,
    },
}

/// Values that many records have in common.
#[derive(Debug, Default)]
pub(super) struct Common {
    machines: Pool<MachineName>,
    joints: Pool<[String]>,
    texts: Pool<str>,
}

impl Record {
    /// Compacts the record, for a hundred thousand of them in memory: values that others have as well are held once, and no list
    /// has room for more.
    pub(super) fn compact(mut self, common: &Common) -> Self {
        if let Some(machine) = &mut self.machine {
            common.machines.share(machine);
        }
        let versions = self.analysis_version.iter_mut().chain(&mut self.sources);
        let texts = versions.chain([&mut self.tipwatch_version, &mut self.model]);
        texts.for_each(|text| common.texts.share(text));
        if let Outcome::Analysed { facts, events, .. } = &mut self.result {
            if let Some(worst) = &mut facts.worst {
                common.texts.share(&mut worst.wheel);
                if let Some(moment) = &mut worst.moment {
                    common.joints.share(&mut moment.joints);
                }
            }
            let wheels = facts.wheels.iter_mut().map(|wheel| &mut wheel.name);
            let of_events = events.iter_mut().flat_map(|event| {
                let optional = event.main_cause.iter_mut().chain(&mut event.other_edge);
                optional.chain([&mut event.subject, &mut event.unit])
            });
            let texts = facts.notes.iter_mut().chain(wheels).chain(of_events);
            texts.for_each(|text| common.texts.share(text));
        }
        // a clone is as large as its content; shrinking would leave up to half of it unused
        self.clone()
    }

    /// Forgets what no other part of a gathering needs once the tables are written.
    pub(super) fn leave_to_the_tables(&mut self) {
        if let Outcome::Analysed { facts, .. } = &mut self.result {
            (facts.findings, facts.notes, facts.wheels) = Default::default();
        }
    }

    /// Name in the store. An analysed log has one name per content, version and path, so that its record
    /// is written once; a failed one has one name per path, so that the last attempt replaces the others.
    pub(super) fn key(&self) -> String {
        let path = path_key(&self.path);
        match (&self.result, &self.log_id, &self.analysis_version) {
            (Outcome::Analysed { .. }, Some(content), Some(version)) => {
                format!("{}{path}", content_key(content, version))
            }
            _ => format!("{path}{FAILED}"),
        }
    }

    /// The order of two records of one path: by version of the program, then by time.
    pub(super) fn age(&self) -> (Option<semver::Version>, i64) {
        (self.program(), self.finished_ns)
    }

    /// The version of the program; `None` if it is none, which sorts as the oldest.
    pub(super) fn program(&self) -> Option<semver::Version> {
        semver::Version::parse(&self.tipwatch_version).ok()
    }

    /// Folder of the report within the output folder; `None` without a report.
    pub(super) fn report_folder(&self) -> Option<String> {
        let Outcome::Analysed {
            has_report: true, ..
        } = &self.result
        else {
            return None;
        };
        let log_id = self.log_id.as_deref()?;
        let version = self.analysis_version.as_deref()?;
        Some(match (self.schema, &self.machine) {
            (FIRST_WITH_VERSION.., _) => report_folder(log_id, version),
            (4, Some(machine)) => format!(
                "{REPORTS}/{}{}",
                beginning(log_id, DIGITS - 4),
                beginning(&sha256(machine.name.as_bytes()), 4)
            ),
            _ => format!("{REPORTS}/{}", beginning(log_id, DIGITS)),
        })
    }

    pub(super) fn is_failed(&self) -> bool {
        matches!(self.result, Outcome::Failed { .. })
    }

    /// The facts and events; `None` for a failed log.
    pub(super) fn analysed(&self) -> Option<(&LogFacts, &[EventFacts])> {
        match &self.result {
            Outcome::Analysed { facts, events, .. } => Some((facts, events)),
            Outcome::Failed { .. } => None,
        }
    }

    /// The day of its first row (UTC); `None` if no clock tells the date.
    pub(super) fn day(&self) -> Option<Day> {
        let since = self.date()?.since(jiff::civil::date(1970, 1, 1)).ok()?;
        Some(Day(since.get_days()))
    }

    /// Returns the day of the log's first row as a date (UTC), by the recorder's clock where its stamps are no dates; `None` if neither
    /// tells it.
    pub(super) fn date(&self) -> Option<jiff::civil::Date> {
        let (facts, _) = self.analysed()?;
        // older records have the stamps alone
        let stamped = || Some(facts.start_ns).filter(|start| YEARS_NS.contains(start));
        let start = facts.start_utc_ns.or_else(stamped)?;
        let stamp = jiff::Timestamp::from_nanosecond(start.into()).ok()?;
        Some(stamp.to_zoned(jiff::tz::TimeZone::UTC).date())
    }
}

/// End of the names of failed logs.
pub(super) const FAILED: &str = ".failed";
/// Digits of a hash in a name.
const DIGITS: usize = 16;

/// First part of the names of all records of this content and version.
pub(super) fn content_key(log_id: &str, version: &str) -> String {
    format!("{}-{version}-", beginning(log_id, DIGITS))
}

/// The part of a record's name that its path determines.
pub(super) fn path_key(path: &str) -> String {
    let mut key = sha256(path.as_bytes());
    key.truncate(DIGITS);
    key
}

/// Folder of all reports, and of the scripts that they share.
pub(super) const REPORTS: &str = "reports";
/// The page of a report.
pub(super) const REPORT_PAGE: &str = "report.html";
/// The files of a report, the page last: if it exists, the report is complete.
pub(super) const REPORT_FILES: [&str; 3] = ["summary.json", "events.parquet", REPORT_PAGE];

/// The first version in which the folder of a report depends on the version of the analysis.
const FIRST_WITH_VERSION: u32 = 5;

/// Folder of a log's report within the output folder: one content may be analysed with two machine files before that is found
/// to be a mistake, and each has a report of its own.
pub(super) fn report_folder(log_id: &str, version: &str) -> String {
    format!(
        "{REPORTS}/{}-{}",
        beginning(log_id, DIGITS),
        beginning(version, 8)
    )
}

/// The first digits of a hash.
pub(super) fn beginning(hash: &str, digits: usize) -> &str {
    hash.get(..digits).unwrap_or(hash)
}
