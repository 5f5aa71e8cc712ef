//! Analyses one log of a fleet; success and failure both become a record.

use std::any::Any;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use anyhow::{Result, bail};
use tipwatch_binding::MachineFile;

use super::fleet_file::Fleet;
use super::identity::{Identity, identify};
use super::record::{MachineName, Outcome, RECORD_SCHEMA, Record, report_folder};
use super::version::{analysis_version, machine_sha256};
use crate::analysis::Analysis;
use crate::analysis::run::{Prepared, analyse_into};
use crate::base::error_text::{error_text, without_path};
use crate::base::file_hash::FileHash;
use crate::base::files::{make_atomically, write_atomically};
use crate::base::options::Options;
use crate::policy::facts::{LogFacts, event_facts};
use crate::report::{self, PlotLibrary, Sketch, SketchPass};
use crate::tables::events::events;
use crate::tables::parquet;
use crate::tables::summary::Summary;

/// What all logs of a run share.
pub(super) struct Screening<'a> {
    pub(super) fleet: &'a Fleet,
    pub(super) options: Options,
    pub(super) out: &'a Path,
    /// Records of earlier runs, by content.
    pub(super) done_before: BTreeMap<String, Record>,
    /// Work of this run.
    pub(super) current: CurrentRun,
}

/// Contents that are finished or in progress. Copies of a log wait for the first and reuse its result,
/// because two workers would write the same report.
#[derive(Debug, Default)]
pub(super) struct CurrentRun {
    done: Mutex<BTreeMap<String, Record>>,
    locks: Mutex<BTreeMap<String, Arc<Mutex<()>>>>,
}

impl CurrentRun {
    /// The lock held while a content is analysed.
    fn lock_of(&self, log_id: &str) -> Arc<Mutex<()>> {
        Arc::clone(lock(&self.locks).entry(log_id.to_owned()).or_default())
    }
}

/// A panic leaves no partial change behind these locks.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Path of the shared plot library within the output folder.
pub(super) const PLOT_LIBRARY: &str = "reports/plots.js";

/// A log's record, and whether it is from an earlier run.
pub(super) struct Screened {
    pub(super) record: Record,
    pub(super) is_from_before: bool,
}

impl Screening<'_> {
    /// Analyses one log. Never fails: an error becomes a record, too.
    pub(super) fn screen(&self, path: &Path) -> Screened {
        let mut record = Record {
            schema: RECORD_SCHEMA,
            path: path.to_string_lossy().into(),
            log_id: None,
            bytes: None,
            machine: None,
            analysis_version: None,
            tipwatch_version: env!("CARGO_PKG_VERSION").into(),
            model: self.options.model.name().into(),
            result: Outcome::Failed {
                reason: String::new(),
            },
        };
        // only the record survives a panic, filled as far as it got
        let screened = catch_unwind(AssertUnwindSafe(|| self.fill(path, &mut record)));
        let reason = match screened {
            Ok(Ok(is_from_before)) => {
                return Screened {
                    record,
                    is_from_before,
                };
            }
            Ok(Err(error)) => self
                .fleet
                .without_folders(&without_path(&error_text(&error), path)),
            Err(panic) => format!(
                "internal error of tipwatch: {}",
                panic_message(panic.as_ref())
            ),
        };
        record.result = Outcome::Failed { reason };
        Screened {
            record,
            is_from_before: false,
        }
    }

    /// Fills the record of a log; returns whether it is from an earlier run.
    fn fill(&self, path: &Path, record: &mut Record) -> Result<bool> {
        let identity = identify(path)?;
        record.log_id = Some(identity.id.clone());
        record.bytes = Some(identity.bytes);
        let machine = self.fleet.machine_of(path)?;
        record.machine = Some(MachineName {
            name: machine.spec.name.clone(),
            sha256: machine_sha256(machine),
        });
        let version = analysis_version(machine, &self.options)?;
        record.analysis_version = Some(version);
        let one_at_a_time = self.current.lock_of(&identity.id);
        let _guard = lock(&one_at_a_time);
        if let Some(known) = self.done_before.get(&identity.id)
            && self.is_reusable(known, record)
        {
            record.result = known.result.clone();
            return Ok(true);
        }
        let of_copy = lock(&self.current.done).get(&identity.id).cloned();
        record.result = match of_copy {
            Some(known) if self.is_reusable(&known, record) => known.result,
            _ => self.analyse(path, machine, &identity)?,
        };
        lock(&self.current.done).insert(identity.id, record.clone());
        Ok(false)
    }

    /// Whether the result of a record applies: same version, and its report still exists.
    fn is_reusable(&self, known: &Record, record: &Record) -> bool {
        let is_same = known.analysis_version == record.analysis_version && !known.is_failed();
        let page = known
            .report_folder()
            .map(|folder| self.out.join(folder).join("report.html"));
        is_same && page.is_none_or(|page| page.is_file())
    }

    fn analyse(&self, path: &Path, machine: &MachineFile, identity: &Identity) -> Result<Outcome> {
        let begin = |prepared: &Prepared<'_>| Ok(SketchPass::begin(prepared));
        let (analysis, sketch) = analyse_into(path, machine, self.options, &mut |_| {}, begin)?;
        let read = analysis.provenance.log.iter().map(FileHash::identity);
        if !read.eq(identity.files.iter().cloned()) {
            bail!(
                "{}: the log changed while it was being read",
                path.display()
            );
        }
        let facts = LogFacts::of(&analysis);
        let has_report = facts.has_findings();
        let folder = self.out.join(report_folder(&identity.id));
        if has_report {
            write_report(&analysis, &sketch.finish(), &folder)?;
        } else {
            remove_report(&folder);
        }
        Ok(Outcome::Analysed {
            events: event_facts(&analysis),
            facts: Box::new(facts),
            has_report,
        })
    }
}

fn write_report(analysis: &Analysis, sketch: &Sketch, folder: &Path) -> Result<()> {
    let summary = Summary::of(analysis, report::main_findings(analysis));
    let summary = serde_json::to_string_pretty(&summary)?;
    write_atomically(&folder.join("summary.json"), summary.as_bytes())?;
    make_atomically(&folder.join("events.parquet"), |path| {
        parquet::write(&events(&analysis.events), &analysis.provenance, path)
    })?;
    let page = report::render_sketch(analysis, sketch, PlotLibrary::Beside("../plots.js"));
    write_atomically(&folder.join("report.html"), page.as_bytes())
}

/// Removes the report of an earlier version that had findings.
fn remove_report(folder: &Path) {
    for name in ["summary.json", "events.parquet", "report.html"] {
        // usually there are no such files
        let _ = std::fs::remove_file(folder.join(name));
    }
    let _ = std::fs::remove_dir(folder);
}

fn panic_message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message")
}

/// Writes the plot library shared by the reports.
pub(super) fn write_plot_library(out: &Path) -> Result<PathBuf> {
    let path = out.join(PLOT_LIBRARY);
    write_atomically(&path, report::plot_library_script()?.as_bytes())?;
    Ok(path)
}
