//! Analyses the logs of a fleet, or of one part of it, on the threads of this process.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::Ordering;

use anyhow::{Result, bail};

use super::attempts::Attempts;
use super::failure::FailureKind;
use super::fleet_file::Fleet;
use super::gather::{PAGE, finish, lock, present};
use super::inputs::Presence;
use super::merge::{latest, merge};
use super::one_log::{CurrentRun, Screened, Screening, add_unreadable};
use super::place::Place;
use super::record::{Outcome, Record, Records};
use super::request::{Gate, Output, Request, Screen, Update};
use super::store::{Before, Store};
use super::totals::Totals;
use super::{inputs, workers};
use crate::base::files::remove_unfinished;
use crate::base::number::count_of;

/// Analyses the logs of a fleet. The workers call `notify`.
///
/// # Errors
/// There is no log, the output folder cannot be used, or it holds an earlier run that is not resumed. A
/// log that cannot be analysed is not an error: the data set contains it with the reason.
pub fn screen(
    request: &Request<'_>,
    fleet: &Fleet,
    gate: Gate<'_>,
    notify: &(dyn Fn(Update<'_>) + Sync),
) -> Result<Screen> {
    inputs::require_any(request.logs)?;
    let found = inputs::find(request.logs, request.out)?;
    let notes = found.notes().into_iter().chain(fleet.note());
    notes.for_each(|note| notify(Update::Note(note)));
    let logs = found.logs.clone();
    let logs = match request.shard {
        Some(shard) => shard.of(logs),
        None => logs,
    };
    let place = Place::at(request.out)?;
    let store = Store::of(&place);
    let is_part = request.shard.is_some() || request.output != Output::DataSet;
    let _lock = lock(&place, is_part)?;
    // records in a shared place are written once: there is nothing to begin anew
    let reuses = request.resume || request.output != Output::DataSet;
    let before = match (reuses, is_part && place.local().is_none()) {
        (true, false) => Before::Listed(store.index()?),
        // a list of all names would cost each of many parts more than to ask for its own
        (true, true) => Before::OnDemand,
        (false, _) => Before::Ignored,
    };
    if !reuses && !is_part {
        let index = store.index()?;
        if !index.is_empty() {
            let text = format!(
                "{}: expected an empty folder, found {} of an earlier run; use --resume to continue it",
                request.out.display(),
                count_of(index.len(), "log")
            );
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, text).into());
        }
    }
    if !is_part {
        tidy(request.out, &place);
    }
    let attempts = match request.output {
        Output::DataSet => None,
        Output::Records { attempts } => Some(Attempts::of(&place, attempts)?),
    };
    notify(Update::Begin(logs.len()));
    let (first, suspects) = match &attempts {
        Some(attempts) => attempts.suspects_apart(logs),
        None => (logs, Vec::new()),
    };
    let screening = Screening {
        fleet,
        found: Some(&found),
        options: request.options,
        reports: request.reports,
        place: place.clone(),
        store,
        before,
        attempts,
        current: CurrentRun::default(),
    };
    let finished = screen_all(request, &screening, &first, request.jobs, notify)?;
    let mut all = finished;
    all.extend(screen_all(request, &screening, &suspects, 1, notify)?);
    let from_before = all.iter().filter(|log| log.is_from_before).count();
    let failed_now = all.iter().filter(|log| log.record.is_failed()).count();
    let is_not_delivered = |log: &&Screened| {
        let kind = FailureKind::Storage;
        matches!(&log.record.result, Outcome::Failed { kind: found, .. } if *found == kind)
    };
    let not_delivered = all.iter().filter(is_not_delivered).count();
    let unaccepted_now = all.iter().filter(|log| match &log.record.result {
        Outcome::Failed { reason, .. } => !gate.accepts(reason),
        Outcome::Analysed { .. } => false,
    });
    let unaccepted_now = unaccepted_now.count();
    let analysed_now = all.len() - from_before - failed_now;
    let mut now: Records = all.into_iter().map(|log| Box::new(log.record)).collect();
    now.sort_by(|a, b| a.path.cmp(&b.path));
    let (totals, undecided, page) = if is_part {
        let rows = merge(now);
        let totals = Totals::of(&rows, &gate.judge(&rows), gate.min_valid);
        (totals, gate.undecided(&rows), None)
    } else {
        let (records, unusable) = screening.store.load(&screening.store.names()?)?;
        add_unreadable(&mut now, unusable, &records, &request.options, notify);
        // what a manifest names and was deleted has a record of this run, too
        let screened = now.iter().map(|record| record.path.clone());
        let screened: BTreeSet<String> = screened
            .filter(|path| !found.is_missing(Path::new(path)))
            .collect();
        let presence = |path: &str| match screened.contains(path) {
            true => Presence::Here,
            false => found.presence(path),
        };
        let failed: BTreeMap<String, String> =
            now.iter().filter_map(|record| failure(record)).collect();
        let records = latest(records, now);
        let records = present(records, presence, request.prune, &screening.store, notify)?;
        note_hidden(&records, &failed, notify);
        let built = finish(records, &place, &place, gate, notify)?;
        (built.totals, built.undecided, Some(request.out.join(PAGE)))
    };
    Ok(Screen {
        totals,
        analysed_now,
        failed_now,
        unaccepted_now,
        not_delivered,
        from_before,
        undecided,
        page,
    })
}

/// Path of a failed log, and why it failed.
fn failure(record: &Record) -> Option<(String, String)> {
    match &record.result {
        Outcome::Failed { reason, .. } => Some((record.path.clone(), reason.clone())),
        Outcome::Analysed { .. } => None,
    }
}

/// Says which logs failed in this run and keep an earlier result.
fn note_hidden(
    records: &[Box<Record>],
    failed: &BTreeMap<String, String>,
    notify: &(dyn Fn(Update<'_>) + Sync),
) {
    let kept = records.iter().filter(|record| !record.is_failed());
    let hidden: Vec<_> = kept
        .filter_map(|record| failed.get_key_value(&record.path))
        .collect();
    if let Some((path, reason)) = hidden.first() {
        notify(Update::Note(format!(
            "logs that failed in this run and keep their earlier result: {}, the first {path}: {reason}",
            hidden.len()
        )));
    }
}

/// Analyses logs in parallel; each is finished with its record.
fn screen_all(
    request: &Request<'_>,
    screening: &Screening<'_>,
    logs: &[PathBuf],
    jobs: usize,
    notify: &(dyn Fn(Update<'_>) + Sync),
) -> Result<Vec<Screened>> {
    let finished: Mutex<Vec<Screened>> = Mutex::new(Vec::new());
    let size_of = |log: &Path| screening.found.map_or(0, |found| found.size_of(log));
    workers::for_each_log(logs, size_of, jobs, request.memory_bytes, |log| {
        if request
            .stop
            .is_some_and(|stop| stop.load(Ordering::Relaxed))
        {
            bail!("interrupted; the finished logs are kept, --resume continues");
        }
        let screened = screening.screen(log)?;
        let failure = match &screened.record.result {
            Outcome::Failed { reason, .. } => Some(reason.as_str()),
            Outcome::Analysed { .. } => None,
        };
        notify(Update::Done {
            log: &screened.record.path,
            failure,
        });
        if let Ok(mut finished) = finished.lock() {
            finished.push(screened);
        }
        Ok(())
    })?;
    Ok(finished.into_inner().unwrap_or_default())
}

/// Removes what a killed program left unfinished; only while holding the lock alone.
fn tidy(out: &Path, place: &Place) {
    place.tidy("state");
    place.tidy("attempts");
    remove_unfinished(out);
    let reports = out.join("reports");
    remove_unfinished(&reports);
    for report in fs::read_dir(&reports).into_iter().flatten().flatten() {
        remove_unfinished(&report.path());
    }
}
