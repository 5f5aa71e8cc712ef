//! Builds data set and page from records, without reading any log.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::Path;

use anyhow::{Context, Result, bail};
use rayon::prelude::*;
use tipwatch_storage::{Folder, Location};

use super::failure::FailureKind;
use super::inputs::{self, Presence};
use super::merge::{ByPresence, LogRow, by_presence, latest, merge};
use super::one_log::{add_unreadable, empty_record};
use super::outliers::comparisons;
use super::place::Place;
use super::policy_result::{judge, write_policy};
use super::record::{Outcome, REPORT_FILES, REPORTS, Record, Records};
use super::request::{Gate, Gathering, Screen, Update};
use super::store::Store;
use super::totals::Totals;
use super::{data_set, page};
use crate::base::file_hash::hash_file;
use crate::base::files::{make_folder, write_atomically};
use crate::policy::Judgement;

/// Builds data set and page from the records of a place.
///
/// # Errors
/// The place holds no records, a named log does not exist, or the output folder cannot be written.
pub fn gather(
    asked: &Gathering<'_>,
    gate: Gate<'_>,
    notify: &(dyn Fn(Update<'_>) + Sync),
) -> Result<Screen> {
    let (place, out) = (Place::at(asked.records)?, Place::at(asked.out)?);
    let store = Store::of(&place);
    // a list of all names is a request for a thousand of them, one after the other
    let names = store.names()?;
    if names.is_empty() {
        let text = format!("{place}: expected the records of an earlier run, found none");
        return Err(io::Error::new(io::ErrorKind::NotFound, text).into());
    }
    let _lock = lock(&out, false)?;
    let mut missing = Vec::new();
    let (records, unusable) = store.load(&names)?;
    drop(names);
    let searched;
    let found = match (asked.found, asked.logs) {
        (Some(found), _) => Some(found),
        (None, []) => None,
        (None, logs) => {
            searched = inputs::find(logs, asked.out)?;
            let notes = searched.notes().into_iter();
            notes.for_each(|note| notify(Update::Note(note)));
            Some(&searched)
        }
    };
    if let Some(found) = found {
        let done: BTreeSet<&str> = records.iter().map(|record| record.path.as_str()).collect();
        for log in &found.logs {
            let mut record = Box::new(empty_record(log, &asked.options));
            if !done.contains(record.path.as_str()) {
                let (kind, reason) = match found.refusal(log) {
                    Some(reason) => (FailureKind::Storage, reason),
                    None => (FailureKind::NoRecord, "no process finished this log"),
                };
                let reason = reason.into();
                record.result = Outcome::Failed { kind, reason };
                missing.push(record);
            }
        }
    }
    add_unreadable(&mut missing, unusable, &records, &asked.options, notify);
    let records = latest(records, missing);
    let records = match found {
        Some(found) => present(
            records,
            |path| found.presence(path),
            asked.prune,
            &store,
            notify,
        )?,
        // the logs may be where this process cannot see them
        None => records,
    };
    let finished = finish(records, &place, &out, gate, notify)?;
    Ok(Screen {
        from_before: finished.totals.logs,
        totals: finished.totals,
        analysed_now: 0,
        failed_now: 0,
        unaccepted_now: 0,
        undecided: finished.undecided,
        not_delivered: 0,
        page: Some(asked.out.join(PAGE)),
    })
}

/// Reads the totals of a data set that was built before (`screen.json`).
///
/// # Errors
/// There is no data set, or it is not complete.
pub fn totals_of(data_set: &Path) -> Result<String> {
    let place = Place::at(data_set)?;
    let read = place.read(TOTALS);
    let text = read.with_context(|| {
        format!("{place}: expected a complete data set of tipwatch screen ({TOTALS}), found none")
    })?;
    String::from_utf8(text).with_context(|| format!("{place}: {TOTALS} cannot be read"))
}

/// The page.
pub const PAGE: &str = "fleet.html";
/// Counts; written last.
const TOTALS: &str = "screen.json";

/// Result of building a data set.
pub(super) struct Finished {
    pub(super) totals: Totals,
    pub(super) undecided: Vec<(String, String)>,
}

/// The records of logs that still exist or may do so, and of deleted ones unless they are pruned. Of a log that moved the record
/// of its new path stays.
pub(super) fn present(
    records: Records,
    presence: impl Fn(&str) -> Presence,
    prune: bool,
    store: &Store,
    notify: &(dyn Fn(Update<'_>) + Sync),
) -> Result<Records> {
    let ByPresence {
        mut kept,
        outdated,
        reassigned,
        deleted,
        out_of_reach,
    } = by_presence(records, presence);
    // also without `prune`: nothing is lost, and who gathers the records elsewhere cannot know it
    store.remove(&outdated)?;
    store.remove(&reassigned)?;
    let note = |logs: &[Box<Record>], what: &str| {
        if let Some(first) = logs.first() {
            let (count, first) = (logs.len(), &first.path);
            notify(Update::Note(format!(
                "logs {what}: {count}, the first {first}"
            )));
        }
    };
    note(
        &reassigned,
        "that are gone, and whose content counts for another machine at the path that is left",
    );
    if prune {
        store.remove(&deleted)?;
        note(
            &deleted,
            "that no longer exist and were removed from the data set",
        );
    } else {
        note(
            &deleted,
            "that no longer exist and stay in the data set (--prune removes them)",
        );
        kept.extend(deleted);
    }
    note(
        &out_of_reach,
        "out of reach (in a folder that is not among those named, or is not there), which stay in the data set",
    );
    kept.extend(out_of_reach);
    kept.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(kept)
}

/// Builds everything from the records of different paths, sorted by path.
pub(super) fn finish(
    records: Records,
    place: &Place,
    out: &Place,
    gate: Gate<'_>,
    notify: &(dyn Fn(Update<'_>) + Sync),
) -> Result<Finished> {
    let reports: BTreeSet<String> = (records.iter())
        .filter_map(|record| record.report_folder())
        .collect();
    let failed: BTreeSet<String> = (records.iter().filter(|record| record.is_failed()))
        .map(|record| record.path.clone())
        .collect();
    let mut rows = merge(records);
    for record in rows.iter().map(|row| &row.record) {
        if let Outcome::Failed { reason, .. } = &record.result
            && !failed.contains(&record.path)
        {
            notify(Update::Conflict {
                log: &record.path,
                reason,
            });
        }
    }
    note_versions(&rows, notify);
    // written again when the data set is complete
    out.remove(TOTALS)?;
    let finished = match out.local() {
        Some(folder) => {
            let (finished, totals) = build(&mut rows, folder, gate)?;
            copy_reports(&rows, place, out)?;
            remove_other_reports(&reports, folder);
            write_atomically(&folder.join(TOTALS), totals.as_bytes())?;
            finished
        }
        None => {
            let folder = tempfile::tempdir().context("no temporary folder can be made")?;
            let (finished, totals) = build(&mut rows, folder.path(), gate)?;
            copy_reports(&rows, place, out)?;
            publish(folder.path(), out)?;
            out.put(TOTALS, totals.as_bytes())?;
            finished
        }
    };
    Ok(finished)
}

/// Builds data set and page in a local folder; returns the totals as text, which are written last.
fn build(rows: &mut [LogRow], out: &Path, gate: Gate<'_>) -> Result<(Finished, String)> {
    let judgements = gate.judge(rows);
    let totals = Totals::of(rows, &judgements, gate.min_valid);
    // one after the other: of a large fleet each takes a second, and a hundred megabytes beside the records
    data_set::write(rows, gate.min_valid, out)?;
    write_policy(rows, &judgements, gate.policy, gate.min_valid, out)?;
    // what the tables alone tell is half of the records, and the page needs its memory
    rows.par_iter_mut()
        .for_each(|row| row.record.leave_to_the_tables());
    let compared = comparisons(rows, gate.min_valid);
    let html = page::render(rows, &judgements, &totals, &compared, gate.min_valid);
    data_set::write_comparisons(compared.into_iter().map(Into::into).collect(), out)?;
    write_atomically(&out.join(PAGE), html.as_bytes())?;
    let text = serde_json::to_string_pretty(&totals)?;
    let finished = Finished {
        totals,
        undecided: gate.undecided(rows),
    };
    Ok((finished, text))
}

/// Hashes of the files that were built, by name: what a bucket holds already is not uploaded again.
const FILES: &str = "files.json";

/// Writes the files of a folder that changed into a bucket, and removes tables that are no longer part of the data set.
fn publish(folder: &Path, out: &Place) -> Result<()> {
    let built = Folder::open(&Location::local(folder))?.list("**/*")?;
    let built: Vec<String> = built.into_iter().map(|entry| entry.key).collect();
    let hashes = built.par_iter().map(|name| {
        let hash = hash_file(&folder.join(name))?.identity();
        Ok((name.clone(), hash))
    });
    let hashes: BTreeMap<String, String> = hashes.collect::<Result<_>>()?;
    // without the list, or with one that is not valid, everything is written
    let known: BTreeMap<String, String> = (out.read(FILES).ok())
        .and_then(|text| serde_json::from_slice(&text).ok())
        .unwrap_or_default();
    // if this run ends before its end, the next one trusts nothing
    out.remove(FILES)?;
    let is_changed = |name: &&String| known.get(*name) != hashes.get(*name);
    let changed: Vec<&String> = built.iter().filter(is_changed).collect();
    out.in_parallel(&changed, |name| out.put_file(name, &folder.join(name)))?;
    let mut outdated = Vec::new();
    for (kind, _) in &*data_set::TABLES {
        let names = out.below(kind)?.into_iter();
        let is_table = |name: &String| data_set::is_table(Path::new(name));
        outdated.extend(names.filter(|name| is_table(name) && !hashes.contains_key(name)));
    }
    if !hashes.contains_key("policy.json") {
        outdated.push("policy.json".into());
    }
    out.in_parallel(&outdated, |name| out.remove(name))?;
    out.put(FILES, serde_json::to_string_pretty(&hashes)?.as_bytes())
}

/// Says that rows of one machine were analysed in different ways: they do not compare.
fn note_versions(rows: &[LogRow], notify: &(dyn Fn(Update<'_>) + Sync)) {
    let mut versions = BTreeMap::<&str, BTreeSet<&str>>::new();
    for record in rows.iter().map(|row| &row.record) {
        if let (Some(machine), Some(version), Some(_)) =
            (&record.machine, &record.analysis_version, record.analysed())
        {
            versions.entry(&machine.name).or_default().insert(version);
        }
    }
    for (machine, versions) in versions.iter().filter(|(_, versions)| versions.len() > 1) {
        notify(Update::Note(format!(
            "machine {machine}: its rows come from {} versions of the analysis (program, options, machine file), the \
             latest of each log; analyse all logs again to compare them",
            versions.len()
        )));
    }
}

/// Copies the reports of the rows from another place into the output folder.
fn copy_reports(rows: &[LogRow], place: &Place, out: &Place) -> Result<()> {
    let real = |place: &Place| place.local().and_then(|folder| folder.canonicalize().ok());
    let is_same = match (real(place), real(out)) {
        (Some(place), Some(out)) => place == out,
        _ => place.to_string() == out.to_string(),
    };
    if is_same {
        return Ok(());
    }
    let folders = rows.iter().filter_map(|row| row.record.report_folder());
    let mut names: Vec<String> = folders
        .flat_map(|folder| REPORT_FILES.map(|name| format!("{folder}/{name}")))
        .collect();
    if names.is_empty() {
        return Ok(());
    }
    // the scripts that they share, those of each version of the program
    let shared = place.list(REPORTS)?.into_iter();
    let shared = shared.filter(|name| name.ends_with(".js"));
    names.extend(shared.map(|name| format!("{REPORTS}/{name}")));
    let copied = match place.local() {
        Some(_) => out,
        None => place,
    };
    copied.in_parallel(&names, |name| out.put(name, &place.read(name)?))?;
    Ok(())
}

/// Removes the reports that no record names: those of earlier versions of an analysis, and of logs that are gone. In a bucket
/// nobody sees them.
fn remove_other_reports(named: &BTreeSet<String>, out: &Path) {
    // a folder that cannot be listed or removed harms nobody
    for entry in fs::read_dir(out.join(REPORTS))
        .into_iter()
        .flatten()
        .flatten()
    {
        let name = format!("{REPORTS}/{}", entry.file_name().to_string_lossy());
        if named.contains(&name) || !entry.path().is_dir() {
            continue;
        }
        for file in REPORT_FILES {
            let _ = fs::remove_file(entry.path().join(file));
        }
        // what somebody else put there keeps it
        let _ = fs::remove_dir(entry.path());
    }
}

impl Gate<'_> {
    pub(super) fn judge(&self, rows: &[LogRow]) -> Vec<Option<Judgement>> {
        judge(rows, self.policy, self.min_valid)
    }

    /// Whether the failure of a log is accepted.
    pub(super) fn accepts(&self, reason: &str) -> bool {
        (self.policy).is_some_and(|policy| policy.judge_failed(reason).passed)
    }

    /// The analysed logs that decide nothing, by path, with the reason.
    pub(super) fn undecided(&self, rows: &[LogRow]) -> Vec<(String, String)> {
        let analysed = rows.iter().filter_map(|row| {
            let reason = row.record.analysed()?.0.undecided(self.min_valid)?;
            Some((row.record.path.clone(), reason.to_string()))
        });
        analysed.collect()
    }
}

/// Locks a local folder until dropped; shards share the lock among themselves. A bucket has no locks, and
/// its records need none.
pub(super) fn lock(place: &Place, is_shared: bool) -> Result<Option<File>> {
    let Some(folder) = place.local() else {
        return Ok(None);
    };
    let state = folder.join("state");
    make_folder(&state)?;
    let path = state.join("lock");
    let file = File::options()
        .create(true)
        .truncate(false)
        .write(true)
        .open(&path)
        .with_context(|| format!("{}: cannot be created", path.display()))?;
    let locked = match is_shared {
        true => file.try_lock_shared(),
        false => file.try_lock(),
    };
    match locked {
        Err(TryLockError::WouldBlock) => bail!(
            "{}: another run writes to this folder; wait for it, or split the logs with --shard",
            folder.display()
        ),
        // a file system without locks: the user must avoid concurrent runs
        Err(TryLockError::Error(_)) | Ok(()) => Ok(Some(file)),
    }
}
