//! One of two compared results.

use std::cmp::Reverse;
use std::path::Path;

use anyhow::{Context, Result, bail};
use serde::Serialize;
use serde_json::Value;
use tipwatch_binding::MachineFile;
use tipwatch_language::{say, tag, word};
use tipwatch_storage::Location;

use crate::analysis::run::analyse;
use crate::analysis::{Analysis, Coverage, Sources, Undecided};
use crate::base::built::built;
use crate::base::fetched::{Fetched, has_file};
use crate::base::number::{input_in_words, known, probability, readable};
use crate::base::options::{Options, Precision};
use crate::events::support_words::{edge_word, support_word};
use crate::events::{Bound, Event, EventKind, EventTimes};
use crate::report;
use crate::tables::summary::{self, Summary};
use crate::tables::table::{Column, Table, Value as Cell};
use crate::tables::{events, parquet, samples};

/// A result: its summary and its rows.
#[derive(Debug)]
pub struct Side {
    /// As given on the command line.
    pub(super) name: String,
    /// `summary.json`.
    pub(super) summary: Value,
    /// Machine file and URDF, where the log was analysed here.
    pub(super) sources: Option<Sources>,
    /// `time_ns` of each row.
    pub(super) times_ns: Vec<i64>,
    /// Whether each row is valid.
    pub(super) valid: Vec<bool>,
    /// Columns of numbers, NaN where unknown.
    pub(super) columns: Vec<SideColumn>,
    /// All events.
    pub(super) events: Vec<SideEvent>,
}

/// A row of `events.parquet`: what is compared of an event.
#[derive(Debug)]
pub(super) struct SideEvent {
    pub(super) event: Event,
    /// Unit of its worst value, as the row has it.
    pub(super) unit: String,
    /// Whether the result says more of it than what happened, when and how sure that is: ground that may have given way, another edge,
    /// signals that contradict each other, another load split.
    pub(super) is_qualified: bool,
}

/// A column of `samples.parquet`.
#[derive(Debug)]
pub(super) struct SideColumn {
    pub(super) name: String,
    pub(super) unit: String,
    pub(super) values: Vec<f64>,
    /// Whether the values were rounded to 32 bits.
    pub(super) is_single: bool,
}

built! {
    /// Origin of a side.
    #[derive(Debug, Clone, PartialEq, Serialize)]
    pub struct SideSummary: pub(super) fn of(side: &Side) {
        let text = |value: &Value| value.as_str().unwrap_or(UNKNOWN).to_string();
        let (provenance, options) = (&side.summary["provenance"], &side.summary["options"]);
        let of_files = |key: &str| -> Vec<String> {
            let files = provenance["log"].as_array().into_iter().flatten();
            let name = |file: &Value| match (&file[key], &file["e_tag"]) {
                // of a log in a bucket only the version is known
                (Value::Null, Value::String(tag)) => format!("{} {tag}", text(&file["path"])),
                (value, _) => text(value),
            };
            files.map(name).collect()
        };
        let finding = text(&side.summary["findings"][0]);
        let is_in_our_language = provenance["language"].as_str().unwrap_or(ENGLISH) == tag();
        let rows = ["valid", "count"].map(|key| side.summary["rows"][key].as_u64());
    } {
        /// As given on the command line.
        pub name: String = side.name.clone(),
        /// The log's files.
        pub log: Vec<String> = of_files("path"),
        /// SHA-256 of the log's files; name and version of a file in a bucket of which only parts were read.
        pub log_sha256: Vec<String> = of_files("sha256"),
        /// The machine's name.
        pub machine: String = text(&side.summary["machine"]["name"]),
        /// SHA-256 of the machine file.
        pub machine_file_sha256: String = text(&provenance["machine_file"]["sha256"]),
        /// SHA-256 of the URDF.
        pub urdf_sha256: String = text(&provenance["urdf"]["sha256"]),
        /// The model.
        pub model: String = text(&side.summary["model"]["name"]),
        /// The estimator.
        pub estimator: String = text(&options["estimator"]),
        /// The first finding.
        pub finding: String = match is_in_our_language {
            true => finding,
            false => side.gravest_event().unwrap_or_else(|| {
                say!("{finding} (in the language of its analysis)")
            }),
        },
        /// The rows that its figures are of: "199 of 299". In the others loads are not known, or the machine tips.
        pub valid_rows: String = match rows {
            [Some(valid), Some(count)] => say!("{valid} of {count}"),
            _ => word!("unknown").into(),
        },
    }
}

/// Language of a result that names none.
const ENGLISH: &str = "en";
/// Text for an unknown value.
const UNKNOWN: &str = "unknown";

impl SideSummary {
    /// Whether both are of the same log, by content; of an unknown log nothing is the same.
    pub(super) fn is_of_same_log(&self, other: &Self) -> bool {
        let of = &self.log_sha256;
        of == &other.log_sha256 && !of.is_empty() && !of.iter().any(|hash| hash == UNKNOWN)
    }
}

impl Side {
    /// Converts an analysis to its documents.
    ///
    /// # Errors
    /// The tables cannot be built.
    pub fn of_analysis(analysis: &Analysis, name: &str) -> Result<Self> {
        let summary = serde_json::to_value(Summary::of(analysis, report::main_findings(analysis)))?;
        let (machine, loads) = (&analysis.machine, &analysis.measured_loads);
        let samples = samples::samples(machine, analysis.rows.whole(), Precision::Double, loads);
        let mut side = Self::new(name, summary, &samples, &events::events(&analysis.events))?;
        side.sources = Some(analysis.sources.clone());
        Ok(side)
    }

    /// An output folder of an analysis, or the analysis of a log with this machine.
    ///
    /// # Errors
    /// There is no machine for a log, it cannot be analysed, or the folder cannot be read.
    pub fn of(path: &Path, machine: Option<&MachineFile>, options: Options) -> Result<Self> {
        if Self::is_folder(path) {
            return Self::of_folder(path);
        }
        let file = machine.with_context(|| {
            let place = path.display();
            format!("{place}: expected a machine file for a log (--machine), found none")
        })?;
        let analysis = analyse(path, file, options, &mut |_| {})?;
        Self::of_analysis(&analysis, &path.display().to_string())
    }

    /// Whether the path is an output folder of an analysis.
    #[must_use]
    pub fn is_folder(path: &Path) -> bool {
        if Location::is_remote_path(path) {
            return has_file(path, "summary.json");
        }
        path.is_dir() && path.join("summary.json").is_file()
    }

    /// Reads an output folder with `summary.json`, `samples.parquet` and `events.parquet`.
    ///
    /// # Errors
    /// The folder is not a result, or has another schema version.
    pub fn of_folder(folder: &Path) -> Result<Self> {
        let named = folder;
        let fetched = Fetched::folder(folder, "*.[jp]*")?;
        let folder = fetched.path();
        let path = folder.join("summary.json");
        let place = named.join("summary.json");
        let place = place.display();
        let text = std::fs::read(&path).with_context(|| format!("{place}: cannot be read"))?;
        let document: Value = serde_json::from_slice(&text)
            .with_context(|| format!("{place}: not a valid summary"))?;
        let expected = u64::from(summary::SCHEMA);
        if document["schema"].as_u64() != Some(expected) {
            bail!(
                "{place}: expected a summary of schema {expected}, found {}; analyse the log again",
                document["schema"]
            );
        }
        let samples = parquet::read(&folder.join("samples.parquet"))?;
        let events = parquet::read(&folder.join("events.parquet"))?;
        Self::new(&named.display().to_string(), document, &samples, &events)
    }

    fn new(name: &str, summary: Value, samples: &Table, events: &Table) -> Result<Self> {
        let times_ns = samples.column("time_ns").and_then(Column::integers);
        let valid = samples.column("valid").and_then(Column::booleans);
        let numbers = |column: &Column| {
            Some(SideColumn {
                name: column.name().to_string(),
                unit: column.unit().unwrap_or_default().to_string(),
                values: column.numbers()?,
                is_single: column.is_single(),
            })
        };
        Ok(Self {
            name: name.into(),
            summary,
            sources: None,
            times_ns: times_ns.context("expected times in column time_ns, found none")?,
            valid: valid.context("expected truth values in column valid, found none")?,
            columns: samples.columns().iter().filter_map(numbers).collect(),
            events: events_of(events)?,
        })
    }

    /// Time of its first row (ns).
    pub(super) fn first_ns(&self) -> i64 {
        let of_event = || Some(self.events.first()?.event.start_ns);
        let first = self.times_ns.first().copied();
        first.or_else(of_event).unwrap_or_default()
    }

    fn coverage(&self) -> Option<Coverage> {
        serde_json::from_value(self.summary["coverage"].clone()).ok()
    }

    /// Returns the wording of the times of its events, from a time on (ns).
    pub(super) fn times(&self, zero_ns: i64) -> EventTimes {
        let coverage = self.coverage();
        let coverage = coverage.as_ref();
        EventTimes {
            zero_ns,
            is_sparse: coverage.is_some_and(|of| of.between_rows.is_some()),
            goes_on: coverage.is_some_and(|of| of.after_rows_s > 0.0),
        }
    }

    /// Returns the reason why this result decides nothing; `None` if it decides. At least `min_valid` of the log's time must be
    /// computable.
    #[must_use]
    pub fn undecided(&self, min_valid: f64) -> Option<String> {
        let Some(coverage) = self.coverage() else {
            return Some("expected coverage in summary.json, found none".into());
        };
        let gross_inputs = self.summary["gross_inputs"]
            .as_array()
            .into_iter()
            .flatten();
        let headline = |input: &Value| {
            let text = input.as_str().or(input["headline"].as_str());
            text.unwrap_or(word!("an input is wrong")).to_owned()
        };
        let gross_inputs: Vec<String> = gross_inputs.map(headline).collect();
        let undecided = Undecided::of(&coverage, &gross_inputs, min_valid);
        undecided.map(|reason| reason.to_string())
    }

    /// Whether data of the log was lost.
    #[must_use]
    pub fn has_losses(&self) -> bool {
        let losses = &self.summary["losses"];
        let ranges = losses["ranges"]
            .as_array()
            .is_some_and(|ranges| !ranges.is_empty());
        let counts = ["undecodable_messages", "missing_messages"];
        let is_counted = |name: &str| losses[name].as_object().is_some_and(|of| !of.is_empty());
        ranges || counts.into_iter().any(is_counted)
    }

    /// As given on the command line.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The gravest event in words of the reader; `None` without one that is a fact, where its own finding says more of it, or where
    /// another finding comes first.
    fn gravest_event(&self) -> Option<String> {
        let gross_inputs = self.summary["gross_inputs"].as_array();
        let has_gross_inputs = gross_inputs.is_some_and(|inputs| !inputs.is_empty());
        let ends_in_a_fall = !self.summary["turning_at_end"].is_null();
        if self.has_losses() || has_gross_inputs || ends_in_a_fall {
            return None;
        }
        let events = self.events.iter();
        let facts = events.filter(|of| of.event.kind.is_observed() && of.event.is_fact());
        let gravest = facts.max_by_key(|of| (of.event.kind, Reverse(of.event.start_ns)))?;
        let event = &gravest.event;
        if gravest.is_qualified || event.is_undecided() {
            return None;
        }
        let certainty = event.certainty.map_or(String::new(), |certainty| {
            say!(" (confidence {})", probability(certainty))
        });
        let what = event_in_words(event.kind, &event.subject);
        let times = self.times(self.first_ns());
        Some(format!("{what}, {}{certainty}", times.told(event)))
    }

    pub(super) fn column(&self, name: &str) -> Option<&SideColumn> {
        self.columns.iter().find(|column| column.name == name)
    }
}

/// Describes an event: what happened, and to what.
pub(super) fn event_in_words(kind: EventKind, subject: &str) -> String {
    let (wheel, input) = (support_word(subject), subject);
    let subject = edge_word(subject);
    match kind {
        EventKind::WheelLight => say!("{} light", wheel),
        EventKind::WheelLift => say!("{} off the ground", wheel),
        EventKind::EdgeTipping => say!("tipping about the {subject} edge"),
        EventKind::TipOver => say!("tipping over about the {subject} edge"),
        EventKind::LiftNotExcluded => say!("lift of {} not excluded", wheel),
        EventKind::InputGap | EventKind::InputFault => {
            let kind = readable(kind.name());
            format!("{kind}: {}", input_in_words(input))
        }
    }
}

/// Columns of a table of events that say more of an event than what happened, when and how sure that is.
const QUALIFIES: [&str; 4] = [
    "rested_ns",
    "rotation_other_edge",
    "doubted_by",
    "split_dependent",
];

/// The rows of a table of events.
///
/// # Errors
/// It is none, or has a kind or a bound that is not known.
fn events_of(table: &Table) -> Result<Vec<SideEvent>> {
    fn read<T>(table: &Table, name: &str, values: fn(&Column) -> Option<T>) -> Result<T> {
        let values = table.column(name).and_then(values);
        values.with_context(|| format!("expected the column {name} of events.parquet, found none"))
    }
    let texts = |name| read(table, name, Column::texts);
    let numbers = |name| read(table, name, Column::numbers);
    let (kinds, subjects, units) = (texts("kind")?, texts("subject")?, texts("unit")?);
    let starts_ns = read(table, "start_ns", Column::integers)?;
    let ends_ns = read(table, "end_ns", Column::optional_integers)?;
    let (start_bounds, end_bounds) = (texts("start_bound")?, texts("end_bound")?);
    let (sigmas_s, rotations_rad) = (numbers("start_sigma_s")?, numbers("rotation")?);
    let (worst, certainty) = (numbers("worst")?, numbers("certainty")?);
    let mut is_qualified = vec![false; table.rows()];
    // of an older result a column may be missing
    for column in QUALIFIES.iter().filter_map(|name| table.column(name)) {
        for (is_qualified, value) in is_qualified.iter_mut().zip(column.values()) {
            *is_qualified |= !matches!(value, Cell::Null | Cell::Boolean(false));
        }
    }
    let unknown = |what: &str, name: &Option<String>| {
        let name = name.as_deref().unwrap_or("none");
        format!("expected a known {what} in events.parquet, found {name}; analyse the log again")
    };
    let bound = |name: &Option<String>| {
        let mut all = Bound::ALL.into_iter();
        let found = all.find(|bound| Some(bound.name()) == name.as_deref());
        found.with_context(|| unknown("bound", name))
    };
    let event = |row: usize| -> Result<SideEvent> {
        let mut all = EventKind::ALL.into_iter();
        let kind = all.find(|kind| Some(kind.name()) == kinds[row].as_deref());
        let kind = kind.with_context(|| unknown("kind of event", &kinds[row]))?;
        let subject = subjects[row].clone().unwrap_or_default();
        Ok(SideEvent {
            event: Event {
                start_sigma_s: known(sigmas_s[row]),
                start_bound: bound(&start_bounds[row])?,
                end_ns: ends_ns[row],
                end_bound: bound(&end_bounds[row])?,
                worst: worst[row],
                certainty: known(certainty[row]),
                rotation_rad: known(rotations_rad[row]),
                ..Event::blank(kind, starts_ns[row], subject)
            },
            unit: units[row].clone().unwrap_or_default(),
            is_qualified: is_qualified[row],
        })
    };
    (0..table.rows()).map(event).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// "Option Modell: whole-body" stood beside an English headline, in a German comparison.
    #[test]
    fn a_finding_in_another_language_is_told_as_such() {
        let finding = |language: Value| {
            let side = Side {
                name: String::new(),
                summary: serde_json::json!({
                    "findings": ["a finding"],
                    "provenance": { "language": language },
                }),
                sources: None,
                times_ns: Vec::new(),
                valid: Vec::new(),
                columns: Vec::new(),
                events: Vec::new(),
            };
            SideSummary::of(&side).finding
        };
        assert_eq!(finding(Value::Null), "a finding");
        assert_ne!(finding("de".into()), "a finding");
    }

    #[test]
    fn the_gravest_event_of_a_result_in_another_language_is_told_in_ours() {
        let second = |s: i64| s * 1_000_000_000;
        let event = |kind, start_s: i64, certainty: f64| SideEvent {
            event: Event {
                certainty: Some(certainty),
                ..Event::blank(kind, second(start_s), "rl".into())
            },
            unit: "N".into(),
            is_qualified: false,
        };
        let mut side = Side {
            name: String::new(),
            summary: serde_json::json!({
                "findings": ["ein Befund"],
                "provenance": { "language": "de" },
            }),
            sources: None,
            times_ns: vec![0],
            valid: vec![true],
            columns: Vec::new(),
            events: vec![
                event(EventKind::EdgeTipping, 1, 0.2),
                event(EventKind::WheelLight, 2, 0.9),
                event(EventKind::WheelLift, 4, 0.9),
                event(EventKind::WheelLift, 3, 0.9),
            ],
        };
        let lift = event_in_words(EventKind::WheelLift, "rl");
        let times = side.times(0).told(&side.events[3].event);
        let told = SideSummary::of(&side).finding;
        assert!(told.contains(&lift) && told.contains(&times), "{told}");
        // a finding that is none of an event comes first
        let gross_inputs = ("gross_inputs", serde_json::json!(["an input"]));
        let open_fall = ("turning_at_end", serde_json::json!({ "edge": "left" }));
        for (key, value) in [gross_inputs, open_fall] {
            side.summary[key] = value;
            assert!(
                SideSummary::of(&side).finding.contains("ein Befund"),
                "{key}"
            );
            side.summary[key] = Value::Null;
        }
        // its own finding says more of it: ground that may have given way, another edge, a doubt, another split
        side.events[3].is_qualified = true;
        assert!(SideSummary::of(&side).finding.contains("ein Befund"));
        side.events[3].is_qualified = false;
        // the machine was tipping when its log ended
        side.events.push(event(EventKind::EdgeTipping, 5, 0.9));
        assert!(SideSummary::of(&side).finding.contains("ein Befund"));
    }

    #[test]
    fn what_a_result_says_beside_an_event_is_read() {
        let blank = || Event::blank(EventKind::WheelLift, 0, "rl".into());
        let doubted = Event {
            doubt: Some(crate::events::Doubt {
                subjects: vec!["imu".into()],
                loads_are_right: 0.9,
            }),
            ..blank()
        };
        let of_split = |split_dependent| Event {
            split_dependent: Some(split_dependent),
            ..blank()
        };
        let all = [blank(), doubted, of_split(true), of_split(false)];
        let read = events_of(&events::events(&all)).unwrap();
        let found: Vec<bool> = read.iter().map(|of| of.is_qualified).collect();
        assert_eq!(found, [false, true, true, false]);
    }

    #[test]
    fn what_is_not_known_is_not_the_same_log() {
        let is_same_as_itself = |log: Value| {
            let side = Side {
                name: String::new(),
                summary: serde_json::json!({ "provenance": { "log": log } }),
                sources: None,
                times_ns: Vec::new(),
                valid: Vec::new(),
                columns: Vec::new(),
                events: Vec::new(),
            };
            let about = SideSummary::of(&side);
            about.is_of_same_log(&about)
        };
        let log = |file: Value| Value::Array(vec![file]);
        let hashed = serde_json::json!({ "path": "a", "sha256": "ab" });
        let of_bucket = serde_json::json!({ "path": "a", "sha256": null, "e_tag": "1" });
        let unknown = serde_json::json!({ "path": "a", "sha256": null });
        assert!(is_same_as_itself(log(hashed)));
        assert!(is_same_as_itself(log(of_bucket)));
        assert!(!is_same_as_itself(log(unknown)));
        assert!(!is_same_as_itself(Value::Null));
    }
}
