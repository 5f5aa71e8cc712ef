//! Analyses one log of a fleet; success and failure both become a record.

use std::any::Any;
use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::{Arc, Mutex};

use anyhow::{Context, Result};
use tipwatch_binding::{MachineFile, sha256};
use tipwatch_ingest::Log;
use tipwatch_storage::Location;

use super::attempts::{Attempt, Attempts};
use super::failure::FailureKind;
use super::fleet_file::Fleet;
use super::inputs::RequestedLogs;
use super::place::Place;
use super::record::{
    MachineName, Outcome, RECORD_SCHEMA, REPORT_PAGE, REPORTS, Record, Records, path_key,
    report_folder,
};
use super::request::{Reports, Update};
use super::store::{Before, Store, Unreadable};
use super::version::{SOURCES, analysis_version, machine_sha256, named_files, urdf_hash};
use crate::analysis::Analysis;
use crate::analysis::run::{Prepared, analyse_opened};
use crate::base::error_text::{error_text, without_path};
use crate::base::file_hash::{FileHash, hash_file, hash_log};
use crate::base::lock::lock;
use crate::base::options::Options;
use crate::policy::facts::{LogFacts, event_facts};
use crate::report::{self, LateSketch, Sketch};
use crate::tables::events::events;
use crate::tables::parquet;
use crate::tables::summary::Summary;

/// Common data of all logs of a run.
pub(super) struct Screening<'a> {
    pub(super) fleet: &'a Fleet,
    /// Results of the search for the logs; `None` in a task, which knows its log alone.
    pub(super) found: Option<&'a RequestedLogs>,
    pub(super) options: Options,
    /// Which logs get a report.
    pub(super) reports: Reports,
    /// Place of records and reports.
    pub(super) place: Place,
    pub(super) store: Store,
    /// Records of earlier runs.
    pub(super) before: Before,
    /// Marks of attempts, where processes may be lost.
    pub(super) attempts: Option<Attempts>,
    /// Work of this run.
    pub(super) current: CurrentRun,
}

/// Contents that are finished or in progress. Copies of a log wait for the first and reuse its result,
/// because two workers would write the same report.
#[derive(Debug, Default)]
pub(super) struct CurrentRun {
    done: Mutex<BTreeMap<String, Record>>,
    locks: Mutex<BTreeMap<String, Arc<Mutex<()>>>>,
    /// The name of the scripts that the reports share, once they are written.
    library: Mutex<Option<String>>,
}

impl CurrentRun {
    /// The lock held while a content is analysed.
    fn lock_of(&self, log_id: &str) -> Arc<Mutex<()>> {
        Arc::clone(lock(&self.locks).entry(log_id.to_owned()).or_default())
    }

    /// The name of the scripts that the reports share; the first report writes them.
    fn library(&self, place: &Place) -> Result<String> {
        let mut written = lock(&self.library);
        if let Some(name) = &*written {
            return Ok(name.clone());
        }
        let (name, script) = report::shared_library();
        place.put_if_absent(&format!("{REPORTS}/{name}"), script.as_bytes())?;
        Ok(written.insert(name).clone())
    }
}

/// A log's record, and whether it is from an earlier run.
pub(super) struct Screened {
    pub(super) record: Record,
    pub(super) is_from_before: bool,
}

impl Screening<'_> {
    /// Analyses one log and writes its record. A log that cannot be analysed is no error: its record says why.
    ///
    /// # Errors
    /// The record cannot be written.
    pub(super) fn screen(&self, path: &Path) -> Result<Screened> {
        let mut attempt = None;
        let screened = self.analysed_or_failed(path, &mut attempt);
        if !screened.is_from_before {
            self.store.save(&screened.record)?;
        }
        if let (Some(attempts), Some(attempt)) = (&self.attempts, &attempt) {
            attempts.finish(attempt)?;
        }
        if !screened.record.is_failed() {
            self.store
                .forget_failure(&self.before, &screened.record.path)?;
        }
        Ok(screened)
    }

    fn analysed_or_failed(&self, path: &Path, attempt: &mut Option<Attempt>) -> Screened {
        let mut record = empty_record(path, &self.options);
        // only the record survives a panic, filled as far as it got
        let screened = catch_unwind(AssertUnwindSafe(|| self.fill(path, &mut record, attempt)));
        record.finished_ns = now_ns();
        let (kind, reason) = match screened {
            Ok(Ok(is_from_before)) => {
                return Screened {
                    record,
                    is_from_before,
                };
            }
            Ok(Err(error)) => {
                let text = without_path(&error_text(&error), path);
                (FailureKind::of(&error), self.fleet.without_folders(&text))
            }
            Err(panic) => {
                let message = panic_message(panic.as_ref());
                let reason = format!("internal error of tipwatch: {message}");
                (FailureKind::Internal, reason)
            }
        };
        record.result = Outcome::Failed { kind, reason };
        Screened {
            record,
            is_from_before: false,
        }
    }

    /// Fills the record of a log; returns whether it is from an earlier run.
    fn fill(
        &self,
        path: &Path,
        record: &mut Record,
        attempt: &mut Option<Attempt>,
    ) -> Result<bool> {
        if let Some(reason) = self.found.and_then(|found| found.refusal(path)) {
            return Err(FailureKind::Storage.error(reason.into()));
        }
        let (identity, mut opened) = identify(path)?;
        record.log_id = Some(identity.id.as_str().into());
        record.bytes = Some(identity.bytes);
        let assigned = self.fleet.machine_of(path, &mut opened)?;
        let machine = assigned.machine;
        let urdf = urdf_hash(machine);
        let known = urdf.as_ref().ok().and_then(Option::as_ref);
        let name = MachineName {
            name: machine.spec.name.clone(),
            sha256: machine_sha256(machine),
            named_files: named_files(machine, known).ok(),
            kind: assigned.kind(known),
        };
        record.machine = Some(name.into());
        let version = urdf
            .and_then(|urdf| analysis_version(machine, urdf.as_ref(), &self.options))
            .map_err(|error| FailureKind::Machine.error(error_text(&error)))?;
        record.analysis_version = Some(version.clone().into());
        let one_at_a_time = self.current.lock_of(&identity.id);
        let _guard = lock(&one_at_a_time);
        let known = self
            .store
            .analysed(&self.before, &identity.id, &version, &record.path)?;
        let known = known.filter(|known| !self.lacks_report(known));
        if let Some(known) = known {
            let is_own = known.path == record.path;
            let is_same = known.machine == record.machine;
            record.result = known.result;
            if !is_own {
                record.finished_ns = now_ns();
                self.store.save(record)?;
            } else if !is_same {
                // the fleet file states another type now
                self.store.replace(record)?;
            }
            return Ok(true);
        }
        let of_copy = lock(&self.current.done).get(&identity.id).cloned();
        let of_copy = of_copy.filter(|known| known.analysis_version == record.analysis_version);
        record.result = match of_copy {
            Some(known) => known.result,
            None => {
                if let Some(attempts) = &self.attempts {
                    *attempt = Some(attempts.begin(record)?);
                }
                self.analyse(path, opened, machine, &identity, &version)?
            }
        };
        lock(&self.current.done).insert(identity.id, record.clone());
        Ok(false)
    }

    /// Whether a report is asked for now that an earlier run did not write.
    fn lacks_report(&self, known: &Record) -> bool {
        let asked = known
            .analysed()
            .is_some_and(|(facts, _)| self.is_reported(facts));
        asked && known.report_folder().is_none()
    }

    fn is_reported(&self, facts: &LogFacts) -> bool {
        match self.reports {
            Reports::None => false,
            Reports::Events => facts.has_findings(),
            Reports::All => true,
        }
    }

    fn analyse(
        &self,
        path: &Path,
        opened: Option<Log>,
        machine: &MachineFile,
        identity: &Identity,
        version: &str,
    ) -> Result<Outcome> {
        let begin = |prepared: &Prepared<'_>| Ok(LateSketch::begin(prepared));
        let log = match opened {
            Some(log) => machine.decode_can(log)?,
            None => machine.open_log(path)?,
        };
        let (analysis, sketch) =
            analyse_opened(path, log, machine, self.options, &mut |_| {}, begin)?;
        let read = analysis.provenance.log.iter().map(FileHash::identity);
        if !read.eq(identity.files.iter().cloned()) {
            let text = format!(
                "{}: the log changed while it was being read",
                path.display()
            );
            return Err(FailureKind::Changed.error(text));
        }
        let facts = LogFacts::of(
            &analysis,
            &report::findings(&analysis),
            report::doubts(&analysis),
        );
        let has_report = self.is_reported(&facts);
        if has_report {
            let library = self.current.library(&self.place)?;
            let folder = report_folder(&identity.id, version);
            write_report(&analysis, &sketch.finish(), &self.place, &folder, &library)?;
        }
        Ok(Outcome::Analysed {
            events: event_facts(&analysis),
            facts: Box::new(facts),
            has_report,
        })
    }
}

/// The record of a log of which nothing is known but its path.
pub(super) fn empty_record(path: &Path, options: &Options) -> Record {
    Record {
        schema: RECORD_SCHEMA,
        path: path.to_string_lossy().into(),
        log_id: None,
        bytes: None,
        machine: None,
        analysis_version: None,
        tipwatch_version: env!("CARGO_PKG_VERSION").into(),
        sources: Some(SOURCES.into()),
        model: options.model.name().into(),
        finished_ns: now_ns(),
        result: Outcome::Failed {
            kind: FailureKind::Internal,
            reason: String::new(),
        },
    }
}

/// Adds a failed row for every record that cannot be read, in place of the log that nobody can name any more; of a log that another
/// record tells of, old or new, there is a note instead.
pub(super) fn add_unreadable(
    new: &mut Records,
    unreadable: Vec<Unreadable>,
    old: &[Box<Record>],
    options: &Options,
    notify: &(dyn Fn(Update<'_>) + Sync),
) {
    let known = old.iter().chain(&*new);
    let known: BTreeSet<String> = known.map(|record| path_key(&record.path)).collect();
    for record in unreadable {
        let (place, reason) = (record.place, record.reason);
        if known.contains(&record.path_key) {
            notify(Update::Note(format!("{place}: {reason}")));
            continue;
        }
        let mut failed = empty_record(Path::new(&place), options);
        failed.result = Outcome::Failed {
            kind: FailureKind::NoRecord,
            reason: format!("the record of a log cannot be read: {reason}"),
        };
        new.push(Box::new(failed));
    }
}

/// Time of the clock (ns since 1970, UTC).
fn now_ns() -> i64 {
    // the clock of a machine is neither before 1970 nor after 2262
    i64::try_from(jiff::Timestamp::now().as_nanosecond()).unwrap_or(i64::MAX)
}

fn write_report(
    analysis: &Analysis,
    sketch: &Sketch,
    place: &Place,
    folder: &str,
    library: &str,
) -> Result<()> {
    let summary = Summary::of(analysis, report::main_findings(analysis));
    let summary = serde_json::to_string_pretty(&summary)?;
    place.put(&format!("{folder}/summary.json"), summary.as_bytes())?;
    let unfinished = tempfile::NamedTempFile::new().context("no temporary file can be made")?;
    let table = events(&analysis.events);
    parquet::write(&table, &analysis.provenance, unfinished.path())?;
    let table = std::fs::read(unfinished.path()).context("a temporary file cannot be read")?;
    place.put(&format!("{folder}/events.parquet"), &table)?;
    let page = report::render_beside(analysis, sketch, library);
    place.put(&format!("{folder}/{REPORT_PAGE}"), page.as_bytes())
}

fn panic_message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message")
}

/// Hashes of a log.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Identity {
    /// SHA-256 of its file, or of the hashes of its files in order. In a bucket, where only parts are read, of the
    /// lengths and versions (ETag) of its files, with their names where a version says nothing of the bytes.
    id: String,
    /// SHA-256 of each file, or its length and version in a bucket, with its name where that is needed.
    files: Vec<String>,
    /// Total length of its files (bytes).
    bytes: u64,
}

/// Hashes all files of a log. One in a bucket or in several files had to be opened for it, and is returned too: what was
/// transferred need not be fetched again.
fn identify(path: &Path) -> Result<(Identity, Option<Log>)> {
    let is_remote = Location::is_remote_path(path);
    let log = match path.is_dir() || is_remote {
        true => Some(Log::open(path)?),
        false => None,
    };
    let hashes = match &log {
        Some(log) => hash_log(log)?,
        None => vec![hash_file(path)?],
    };
    let files: Vec<String> = hashes.iter().map(FileHash::identity).collect();
    let id = match (files.as_slice(), path.is_dir()) {
        ([file], false) if !is_remote => file.clone(),
        (files, _) => {
            // the metadata of a rosbag2 folder is part of the log
            let metadata =
                hash_file(&path.join("metadata.yaml")).map_or(String::new(), |h| h.identity());
            sha256(format!("{}\n{metadata}", files.join("\n")).as_bytes())
        }
    };
    let identity = Identity {
        id,
        files,
        bytes: hashes.iter().map(|hash| hash.bytes).sum(),
    };
    Ok((identity, log))
}
