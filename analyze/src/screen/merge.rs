//! Which record of a log becomes its row: one of each path, then one of each content and machine.

use std::collections::{BTreeMap, BTreeSet};
use std::mem;

use super::failure::FailureKind;
use super::record::{Outcome, Record, beginning};

/// A log of the data set.
#[derive(Debug, Clone)]
pub(super) struct LogRow {
    /// Its record.
    pub(super) record: Record,
    /// Number of other paths with the same content.
    pub(super) copies: u64,
}

/// The record of each path, sorted by path: of the newest program, then the latest. The records in `now`
/// are those of this run and replace all others of their paths.
pub(super) fn latest(all: Vec<Record>, now: Vec<Record>) -> Vec<Record> {
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
fn one_of_each_path(
    mut records: Vec<Record>,
    replaces: impl Fn(&Record, &Record) -> bool,
) -> Vec<Record> {
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

/// Whether a record takes the place of another of the same path. With the same program a failure never
/// replaces a result unless it is known to be about another content or another version of the analysis: a
/// lost worker does not undo what another one found.
fn replaces(record: &Record, known: &Record) -> bool {
    let order = record.program().cmp(&known.program());
    if order.is_ne() || record.is_failed() == known.is_failed() {
        return record.age() > known.age();
    }
    let (failure, result) = match record.is_failed() {
        true => (record, known),
        false => (known, record),
    };
    let differs = |a: &Option<String>, b: &Option<String>| a.is_some() && a != b;
    let is_about_another = differs(&failure.log_id, &result.log_id)
        || differs(&failure.analysis_version, &result.analysis_version);
    match record.is_failed() {
        true => is_about_another && record.age() > known.age(),
        false => !is_about_another || record.age() > known.age(),
    }
}

/// Rows of the records of different paths, sorted by path: one for each content and machine, of the newest program, then
/// the first analysed one by path. Of a content that was analysed with several machines nobody knows which one is right:
/// all of its rows fail.
pub(super) fn merge(records: Vec<Record>) -> Vec<LogRow> {
    let mut rows: Vec<LogRow> = Vec::with_capacity(records.len());
    let mut rows_of: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for record in records {
        let Some(id) = record.log_id.clone() else {
            rows.push(LogRow { record, copies: 0 });
            continue;
        };
        let of_content = rows_of.entry(id).or_default();
        let known = of_content
            .iter()
            .find(|&&row| is_of_same_machine(&rows[row].record, &record));
        let Some(row) = known.map(|&row| &mut rows[row]) else {
            of_content.push(rows.len());
            rows.push(LogRow { record, copies: 0 });
            continue;
        };
        row.copies += 1;
        let order = record.program().cmp(&row.record.program());
        let is_better = row.record.is_failed() && !record.is_failed();
        if order.then(is_better.cmp(&false)).is_gt() {
            row.record = record;
        }
    }
    for of_content in rows_of.values().filter(|of_content| of_content.len() > 1) {
        refuse_conflict(&mut rows, of_content);
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

/// Separates the records of logs that no longer exist. Those whose content is found under another path have moved; the
/// others were deleted.
pub(super) fn without_gone(records: Vec<Record>, is_gone: impl Fn(&str) -> bool) -> Present {
    let (gone, here): (Vec<Record>, Vec<Record>) = records
        .into_iter()
        .partition(|record| is_gone(&record.path));
    let contents: BTreeSet<String> = here
        .iter()
        .filter_map(|record| record.log_id.clone())
        .collect();
    let (mut moved, mut deleted) = (Vec::new(), Vec::new());
    let mut known = BTreeSet::new();
    // of the paths that a deleted log had, the last one stays
    let mut gone = gone;
    gone.sort_by_key(|record| std::cmp::Reverse(record.age()));
    for record in gone {
        let id = record.log_id.as_ref();
        let is_moved = id.is_some_and(|id| contents.contains(id) || !known.insert(id.clone()));
        match is_moved {
            true => moved.push(record),
            false => deleted.push(record),
        }
    }
    deleted.sort_by(|a, b| a.path.cmp(&b.path));
    Present {
        here,
        moved,
        deleted,
    }
}

/// The records of a data set, by what became of their logs.
pub(super) struct Present {
    pub(super) here: Vec<Record>,
    /// Their content is or was under another path since then.
    pub(super) moved: Vec<Record>,
    pub(super) deleted: Vec<Record>,
}
