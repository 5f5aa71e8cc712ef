//! Analyses the logs of a fleet, and builds data set and page from their records.

use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::Ordering;

use anyhow::{Context, Result, bail};

use super::fleet_file::Fleet;
use super::merge::{LogRow, merge};
use super::one_log::{CurrentRun, Screened, Screening, write_plot_library};
use super::policy_result::{judge, write_policy};
use super::record::Outcome;
use super::request::{Gate, Request, Screen, Shard, Update};
use super::store::Store;
use super::totals::Totals;
use super::{data_set, inputs, page, workers};
use crate::base::files::{remove_unfinished, write_atomically};
use crate::policy::Judgement;

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
    let logs = of_shard(inputs::find(request.logs, request.out)?, request.shard);
    let store = Store::in_folder(request.out)?;
    let _lock = lock(request.out, request.shard.is_some())?;
    let (records, unusable) = store.load()?;
    if !records.is_empty() && !request.resume && request.shard.is_none() {
        bail!(
            "{}: expected an empty folder, found {} logs of an earlier run; use --resume to continue it",
            request.out.display(),
            records.len()
        );
    }
    unusable
        .into_iter()
        .for_each(|note| notify(Update::Note(note)));
    if request.shard.is_none() {
        store.tidy();
        remove_unfinished(request.out);
        let reports = request.out.join("reports");
        remove_unfinished(&reports);
        for report in fs::read_dir(&reports).into_iter().flatten().flatten() {
            remove_unfinished(&report.path());
        }
    }
    write_plot_library(request.out)?;
    let done = records.into_iter().filter(|_| request.resume);
    let screening = Screening {
        fleet,
        options: request.options,
        out: request.out,
        current: CurrentRun::default(),
        done_before: done
            .filter_map(|record| Some((record.log_id.clone()?, record)))
            .collect(),
    };
    notify(Update::Begin(logs.len()));
    let finished: Mutex<Vec<Screened>> = Mutex::new(Vec::new());
    workers::for_each_log(&logs, request.jobs, request.memory_bytes, |log| {
        if request
            .stop
            .is_some_and(|stop| stop.load(Ordering::Relaxed))
        {
            bail!("interrupted; the finished logs are kept, --resume continues");
        }
        let screened = screening.screen(log);
        store.save(&screened.record)?;
        let failure = match &screened.record.result {
            Outcome::Failed { reason } => Some(reason.as_str()),
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
    let finished = finished.into_inner().unwrap_or_default();
    let from_before = finished.iter().filter(|log| log.is_from_before).count();
    let failed_now = finished.iter().filter(|log| log.record.is_failed()).count();
    let analysed_now = finished.len() - from_before - failed_now;
    let (totals, undecided, page) = match request.shard {
        Some(_) => {
            let mut own: Vec<_> = finished.into_iter().map(|log| log.record).collect();
            own.sort_by(|a, b| a.path.cmp(&b.path));
            let rows = merge(own);
            let totals = Totals::of(&rows, &gate.judge(&rows), gate.min_valid);
            (totals, gate.undecided(&rows), None)
        }
        None => finish(&store, request.out, gate)?,
    };
    Ok(Screen {
        totals,
        analysed_now,
        failed_now,
        from_before,
        undecided,
        page,
    })
}

/// Builds data set and page from the records of shards, without reading any log.
///
/// # Errors
/// The folder holds no records, or cannot be written.
pub fn gather(out: &Path, gate: Gate<'_>, notify: &(dyn Fn(Update<'_>) + Sync)) -> Result<Screen> {
    if !out.join("state").is_dir() {
        bail!(
            "{}: expected the output folder of an earlier run, found none",
            out.display()
        );
    }
    let store = Store::in_folder(out)?;
    let _lock = lock(out, false)?;
    let (_, unusable) = store.load()?;
    unusable
        .into_iter()
        .for_each(|note| notify(Update::Note(note)));
    let (totals, undecided, page) = finish(&store, out, gate)?;
    Ok(Screen {
        from_before: totals.logs,
        totals,
        analysed_now: 0,
        failed_now: 0,
        undecided,
        page,
    })
}

/// Totals, logs that decide nothing, and the page.
type Finished = (Totals, Vec<(String, String)>, Option<PathBuf>);

impl Gate<'_> {
    fn judge(&self, rows: &[LogRow]) -> Vec<Option<Judgement>> {
        judge(rows, self.policy, self.min_valid)
    }

    /// The analysed logs that decide nothing, by path, with the reason.
    fn undecided(&self, rows: &[LogRow]) -> Vec<(String, String)> {
        let analysed = rows.iter().filter_map(|row| {
            let reason = row.record.analysed()?.0.undecided(self.min_valid)?;
            Some((row.record.path.clone(), reason.to_string()))
        });
        analysed.collect()
    }
}

/// Builds everything from the records.
fn finish(store: &Store, out: &Path, gate: Gate<'_>) -> Result<Finished> {
    // written again when the data set is complete
    let totals_path = out.join("screen.json");
    if totals_path.exists() {
        fs::remove_file(&totals_path)
            .with_context(|| format!("{}: cannot be removed", totals_path.display()))?;
    }
    let rows = merge(store.load()?.0);
    data_set::write(&rows, out)?;
    let judgements = gate.judge(&rows);
    write_policy(&rows, &judgements, gate.policy, gate.min_valid, out)?;
    let totals = Totals::of(&rows, &judgements, gate.min_valid);
    let page = out.join("fleet.html");
    let html = page::render(&rows, &judgements, &totals, gate.min_valid);
    write_atomically(&page, html.as_bytes())?;
    let text = serde_json::to_string_pretty(&totals)?;
    write_atomically(&totals_path, text.as_bytes())?;
    Ok((totals, gate.undecided(&rows), Some(page)))
}

/// Every n-th log by path: all processes see the same list.
fn of_shard(logs: Vec<PathBuf>, shard: Option<Shard>) -> Vec<PathBuf> {
    let Some(shard) = shard else {
        return logs;
    };
    let own = logs.into_iter().skip(shard.index - 1);
    own.step_by(shard.count).collect()
}

/// Locks the output folder until dropped; shards share the lock among themselves.
fn lock(out: &Path, is_shard: bool) -> Result<File> {
    let path = out.join("state").join("lock");
    let file = File::options()
        .create(true)
        .truncate(false)
        .write(true)
        .open(&path)
        .with_context(|| format!("{}: cannot be created", path.display()))?;
    let locked = match is_shard {
        true => file.try_lock_shared(),
        false => file.try_lock(),
    };
    match locked {
        Err(TryLockError::WouldBlock) => bail!(
            "{}: another run writes to this folder; wait for it, or split the logs with --shard",
            out.display()
        ),
        // a file system without locks: the user must avoid concurrent runs
        Err(TryLockError::Error(_)) | Ok(()) => Ok(file),
    }
}
