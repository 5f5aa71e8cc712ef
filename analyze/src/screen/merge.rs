//! Which record of a log becomes its row: one of each path, then one of each content and machine.

use std::collections::{BTreeMap, BTreeSet};
use std::mem;

use super::failure::FailureKind;
use super::inputs::Presence;
use super::record::{Outcome, Record, Records, beginning};
use crate::base::shared::Shared;

/// A log of the data set.
#[derive(Debug, Clone)]
pub(super) struct LogRow {
    /// Its record.
    pub(super) record: Box<Record>,
    /// Number of other paths with the same content.
    pub(super) copies: u64,
}

/// The record of each path, sorted by path: of the newest program, then the latest. The records in `now`
/// are those of this run and replace all others of their paths.
pub(super) fn latest(all: Records, now: Records) -> Records {
    let mut records = one_of_each_path(all, replaces);
    // another process may have analysed what this one could not
    let is_newer = |record: &Record, known: &Record| !record.is_failed() || replaces(record, known);
    let mut new = one_of_each_path(now, is_newer);
    new.retain_mut(|record| {
        let known = records.binary_search_by(|known| known.path.cmp(&record.path));
        let known = known.ok().map(|place| &mut records[place]);
        let is_new = known.is_none();
        if let Some(known) = known.filter(|known| is_newer(record, known)) {
            mem::swap(record, known);
        }
        is_new
    });
    records.extend(new);
    records.sort_by(|a, b| a.path.cmp(&b.path));
    records
}

/// One record of each path, sorted by path: a later one where it replaces those before it.
fn one_of_each_path(mut records: Records, replaces: impl Fn(&Record, &Record) -> bool) -> Records {
    records.sort_by(|a, b| a.path.cmp(&b.path));
    records.dedup_by(|record, known| {
        let is_same = record.path == known.path;
        if is_same && replaces(record, known) {
            mem::swap(record, known);
        }
        is_same
    });
    records
}

/// Whether a record takes the place of another of the same path. With the same program a failure never replaces a result unless
/// it is known to be about another content or another version of the analysis: a lost worker does not undo the result of another
/// one.
fn replaces(record: &Record, known: &Record) -> bool {
    let order = record.program().cmp(&known.program());
    if order.is_ne() || record.is_failed() == known.is_failed() {
        return record.age() > known.age();
    }
    let (failure, result) = match record.is_failed() {
        true => (record, known),
        false => (known, record),
    };
    let content = failure.log_id.is_some() && failure.log_id != result.log_id;
    let version =
        failure.analysis_version.is_some() && failure.analysis_version != result.analysis_version;
    let is_about_another = content || version;
    match record.is_failed() {
        true => is_about_another && record.age() > known.age(),
        false => !is_about_another || record.age() > known.age(),
    }
}

/// Rows of the records of different paths, sorted by path: one for each content and machine, of the newest program, then
/// the first analysed one by path. Of a content that was analysed with several machines nobody knows which one is right:
/// all of its rows fail.
pub(super) fn merge(records: Records) -> Vec<LogRow> {
    let mut rows: Vec<LogRow> = Vec::with_capacity(records.len());
    // the first row of each content, and others
    let mut rows_of: BTreeMap<Shared<str>, (usize, Vec<usize>)> = BTreeMap::new();
    for record in records {
        let Some(id) = record.log_id.clone() else {
            rows.push(LogRow { record, copies: 0 });
            continue;
        };
        let new = rows.len();
        let (first, others) = rows_of.entry(id).or_insert_with(|| (new, Vec::new()));
        let mut of_content = std::iter::once(*first).chain(others.iter().copied());
        let is_known = |row: &usize| {
            let row = rows.get(*row);
            row.is_some_and(|row| is_of_same_machine(&row.record, &record))
        };
        let Some(known) = of_content.find(is_known) else {
            if *first != new {
                others.push(new);
            }
            rows.push(LogRow { record, copies: 0 });
            continue;
        };
        let row = &mut rows[known];
        row.copies += 1;
        let order = record.program().cmp(&row.record.program());
        let is_better = row.record.is_failed() && !record.is_failed();
        if order.then(is_better.cmp(&false)).is_gt() {
            row.record = record;
        }
    }
    for (first, mut of_content) in rows_of.into_values() {
        if !of_content.is_empty() {
            of_content.insert(0, first);
            refuse_conflict(&mut rows, &of_content);
        }
    }
    rows
}

/// Name of the machine; `None` if none was assigned.
fn machine_of(record: &Record) -> Option<&str> {
    record.machine.as_ref().map(|machine| machine.name.as_str())
}

/// Whether two records were made with one machine. A name is not enough: two files may have the same one, and two files of
/// one text may stand beside different URDFs. Records of
/// different programs may come from before and after a change of the file, so that the newer one is right.
fn is_of_same_machine(a: &Record, b: &Record) -> bool {
    let is_of_one_file = match (&a.machine, &b.machine) {
        (Some(a), Some(b)) => a.is_of_same_files(b),
        _ => true,
    };
    machine_of(a) == machine_of(b) && (is_of_one_file || a.program() != b.program())
}

/// Lets the rows of one content fail that were analysed with different machines.
fn refuse_conflict(rows: &mut [LogRow], of_content: &[usize]) {
    let analysed = of_content
        .iter()
        .filter(|&&row| !rows[row].record.is_failed());
    let analysed: Vec<usize> = analysed.copied().collect();
    if analysed.len() < 2 {
        return;
    }
    let names: BTreeSet<Option<&str>> = analysed
        .iter()
        .map(|&row| machine_of(&rows[row].record))
        .collect();
    let has_one_name = names.len() < analysed.len();
    let named = analysed.iter().map(|&row| {
        let record = &rows[row].record;
        let machine = record.machine.as_ref();
        match machine {
            Some(machine) if has_one_name => format!(
                "{} ({}, machine file {}{})",
                record.path,
                machine.name,
                beginning(&machine.sha256, 8),
                match &machine.named_files {
                    Some(named) => format!(" with URDF and DBC files {}", beginning(named, 8)),
                    None => String::new(),
                }
            ),
            Some(machine) => format!("{} ({})", record.path, machine.name),
            None => format!("{} (unknown)", record.path),
        }
    });
    let remedy = match has_one_name {
        true => {
            "analyse all of them with the same machine file and URDF, or give each machine a name of its own"
        }
        false => "remove the copies that are in the wrong place, or mend the fleet file",
    };
    let reason = format!(
        "expected one machine for one content, found the same log as {}: {remedy}",
        named.collect::<Vec<_>>().join(" and ")
    );
    for row in analysed {
        rows[row].record.result = Outcome::Failed {
            kind: FailureKind::Machine,
            reason: reason.clone(),
        };
    }
}

/// Sorts records by what became of their logs. Logs whose content is found under another path have moved.
pub(super) fn by_presence(records: Records, presence: impl Fn(&str) -> Presence) -> ByPresence {
    let mut found = ByPresence::default();
    let mut missing = Vec::new();
    let mut contents = BTreeSet::new();
    // a copy that was analysed with another machine may be right, unless its log is gone for sure
    let with_machine = |record: &Record| {
        let id = record.log_id.clone();
        id.map(|id| (id, machine_of(record).map(ToOwned::to_owned)))
    };
    let mut machines = BTreeSet::new();
    for record in records {
        match presence(&record.path) {
            Presence::Here => {
                contents.extend(record.log_id.clone());
                machines.extend(with_machine(&record));
                found.kept.push(record);
            }
            Presence::NoLog => found.outdated.push(record),
            presence => missing.push((record, presence)),
        }
    }
    // of the paths that a deleted log had, the last one stays
    missing.sort_by_key(|(record, _)| std::cmp::Reverse(record.age()));
    for (record, presence) in missing {
        let of_machine = with_machine(&record);
        let is_known = match presence {
            Presence::Gone { .. } => {
                (record.log_id.as_ref()).is_some_and(|id| contents.contains(id))
            }
            _ => (of_machine.as_ref()).is_some_and(|of_machine| machines.contains(of_machine)),
        };
        let has_machine = of_machine.as_ref().is_some_and(|(_, name)| name.is_some());
        let is_of_another =
            has_machine && (of_machine.as_ref()).is_some_and(|it| !machines.contains(it));
        contents.extend(record.log_id.clone());
        machines.extend(of_machine);
        match (presence, is_known) {
            (Presence::Gone { .. }, true) if is_of_another => found.reassigned.push(record),
            (Presence::Gone { .. }, true) => found.outdated.push(record),
            // it may come back
            (_, true) => {}
            (Presence::Gone { is_named: true }, false) => found.deleted.push(record),
            (_, false) => found.out_of_reach.push(record),
        }
    }
    for records in [
        &mut found.reassigned,
        &mut found.deleted,
        &mut found.out_of_reach,
    ] {
        records.sort_by(|a, b| a.path.cmp(&b.path));
    }
    found
}

/// Records by what became of their logs.
#[derive(Default)]
pub(super) struct ByPresence {
    pub(super) kept: Records,
    /// Their content is or was under another path since then, or their path is no longer that of a log.
    pub(super) outdated: Records,
    /// Their content is under another path since then, and was analysed there with another machine.
    pub(super) reassigned: Records,
    pub(super) deleted: Records,
    /// Nobody looked for these logs, or where they were is not there.
    pub(super) out_of_reach: Records,
}
