//! The data set: `logs/machine=M/day=D/logs.parquet`, one row per log, and
//! `events/machine=M/day=D/events.parquet`, one row per event.
//!
//! It is rebuilt from all records, and each file is replaced atomically. Machine and day are only in the
//! names of the folders (Hive partitioning).

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::merge::LogRow;
use super::record::Outcome;
use crate::base::files::{make_atomically, remove_unfinished};
use crate::events::EventKind;
use crate::policy::facts::{EXPOSURE_CAUSES, EventFacts, LogFacts, WheelFacts, WorstMargin};
use crate::tables::parquet::write_with;
use crate::tables::table::Table;

/// Version of the columns.
pub(super) const DATA_SET_SCHEMA: u32 = 3;
/// Hive's name for an unknown machine or day; readers convert it to null.
const UNKNOWN: &str = "__HIVE_DEFAULT_PARTITION__";

/// Writes the data set of all logs and removes outdated partitions.
pub(super) fn write(rows: &[LogRow], out: &Path) -> Result<()> {
    let mut partitions: BTreeMap<String, Vec<&LogRow>> = BTreeMap::new();
    for row in rows {
        partitions.entry(partition(row)).or_default().push(row);
    }
    let mut written = BTreeSet::new();
    for (partition, rows) in &mut partitions {
        rows.sort_by_key(|row| {
            let start = row.record.analysed().map(|(facts, _)| facts.start_ns);
            (start, row.record.path.clone())
        });
        for (kind, table) in [("logs", logs(rows)), ("events", events(rows))] {
            if table.rows() > 0 {
                let path = out
                    .join(kind)
                    .join(partition)
                    .join(format!("{kind}.parquet"));
                write_table(&table, &path)?;
                written.insert(path);
            }
        }
    }
    for kind in ["logs", "events"] {
        remove_others(&out.join(kind), &format!("{kind}.parquet"), &written);
    }
    Ok(())
}

fn write_table(table: &Table, path: &Path) -> Result<()> {
    let schema = [("tipwatch.data_set_schema", DATA_SET_SCHEMA.to_string())];
    make_atomically(path, |temporary| {
        write_with(table, &schema, temporary)
            .with_context(|| format!("{}: cannot be written", path.display()))
    })
}

/// `machine=M/day=D`.
fn partition(row: &LogRow) -> String {
    let machine = row
        .record
        .machine
        .as_ref()
        .map(|machine| escaped(&machine.name));
    let day = row.record.day();
    format!(
        "machine={}/day={}",
        machine.as_deref().unwrap_or(UNKNOWN),
        day.as_deref().unwrap_or(UNKNOWN)
    )
}

/// A value as a folder name: bytes other than letters, digits, `-`, `_` and `.` become `%2F` and the like.
fn escaped(value: &str) -> String {
    let escaped = |byte: u8| match byte {
        b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' => {
            char::from(byte).to_string()
        }
        other => format!("%{other:02X}"),
    };
    value.bytes().map(escaped).collect()
}

/// Removes the files of outdated partitions; other files stay.
fn remove_others(folder: &Path, name: &str, written: &BTreeSet<PathBuf>) {
    let below = |folder: &Path| -> Vec<PathBuf> {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        entries.map(|entry| entry.path()).collect()
    };
    for machine in below(folder) {
        for day in below(&machine) {
            let path = day.join(name);
            if path.is_file() && !written.contains(&path) {
                // best effort: a leftover file shows up as duplicate rows
                let _ = fs::remove_file(&path);
            }
            remove_unfinished(&day);
            // only if it is empty
            let _ = fs::remove_dir(&day);
        }
        let _ = fs::remove_dir(&machine);
    }
}

fn logs(rows: &[&LogRow]) -> Table {
    let mut table = Table::default();
    add_identity(rows, &mut table);
    add_time_range(rows, &mut table);
    add_worst(rows, &mut table);
    add_exposure(rows, &mut table);
    for kind in EventKind::all() {
        let name = format!("{}_events", kind.name());
        let counts = rows.iter().map(|row| facts(row)?.events_of(*kind));
        table.add(&name, Some("events"), counts);
    }
    add_losses(rows, &mut table);
    table
}

fn facts<'a>(row: &&'a LogRow) -> Option<&'a LogFacts> {
    row.record.analysed().map(|(facts, _)| facts)
}

fn wheels<'a>(row: &&'a LogRow) -> Option<&'a [WheelFacts]> {
    facts(row).map(|facts| facts.wheels.as_slice())
}

fn worst<'a>(row: &&'a LogRow) -> Option<&'a WorstMargin> {
    facts(row)?.worst.as_ref()
}

fn add_identity(rows: &[&LogRow], table: &mut Table) {
    let records = || rows.iter().map(|row| &row.record);
    let machine = |record: &'_ super::record::Record| Some(record.machine.as_ref()?.sha256.clone());
    let kind = |record: &'_ super::record::Record| record.machine.as_ref()?.kind.clone();
    let reason = |row: &&LogRow| match &row.record.result {
        Outcome::Failed { reason, .. } => Some(reason.clone()),
        Outcome::Analysed { .. } => None,
    };
    let failure = |row: &&LogRow| match &row.record.result {
        Outcome::Failed { kind, .. } => Some(kind.to_string()),
        Outcome::Analysed { .. } => None,
    };
    let status = |row: &&LogRow| match row.record.is_failed() {
        true => "failed",
        false => "analysed",
    };
    table.add("log_id", None, records().map(|r| r.log_id.clone()));
    table.add("path", None, records().map(|r| r.path.clone()));
    table.add("copies", Some("files"), rows.iter().map(|row| row.copies));
    table.add("bytes", Some("bytes"), records().map(|r| r.bytes));
    table.add("status", None, rows.iter().map(status));
    table.add("failure", None, rows.iter().map(failure));
    table.add("reason", None, rows.iter().map(reason));
    let report = |r: &super::record::Record| r.report_folder().map(|f| format!("{f}/report.html"));
    table.add("report", None, records().map(report));
    table.add("machine_type", None, records().map(kind));
    table.add("machine_file_sha256", None, records().map(machine));
    let version = records().map(|r| r.analysis_version.clone());
    table.add("analysis_version", None, version);
    let tipwatch = records().map(|r| r.tipwatch_version.clone());
    table.add("tipwatch_version", None, tipwatch);
    table.add("model", None, records().map(|r| r.model.clone()));
}

fn add_time_range(rows: &[&LogRow], table: &mut Table) {
    let all = || rows.iter().map(facts);
    table.add("start_ns", Some("ns"), all().map(|f| Some(f?.start_ns)));
    table.add("end_ns", Some("ns"), all().map(|f| Some(f?.end_ns)));
    table.add("duration_s", Some("s"), all().map(|f| Some(f?.duration_s)));
    table.add("rows", Some("rows"), all().map(|f| Some(f?.rows)));
    table.add(
        "valid_rows",
        Some("rows"),
        all().map(|f| Some(f?.valid_rows)),
    );
    let coverage = || rows.iter().map(|row| Some(facts(row)?.coverage));
    table.add(
        "covered_s",
        Some("s"),
        coverage().map(|c| Some(c?.covered_s)),
    );
    table.add(
        "computable_s",
        Some("s"),
        coverage().map(|c| Some(c?.computable_s)),
    );
    table.add("valid_share", Some("-"), coverage().map(|c| c?.valid_share));
}

fn add_worst(rows: &[&LogRow], table: &mut Table) {
    let all = || rows.iter().map(worst);
    let utilisation = rows.iter().map(|row| facts(row)?.largest_utilisation);
    table.add("worst_margin", Some("-"), all().map(|w| Some(w?.margin)));
    table.add("worst_margin_sigma", Some("-"), all().map(|w| w?.sigma));
    table.add("worst_wheel", None, all().map(|w| Some(w?.wheel.clone())));
    table.add("worst_ns", Some("ns"), all().map(|w| Some(w?.time_ns)));
    table.add("worst_otf", Some("N"), all().map(|w| Some(w?.otf_n)));
    table.add("worst_otf_sigma", Some("N"), all().map(|w| w?.otf_sigma_n));
    table.add("largest_utilisation", Some("-"), utilisation);
    let names = rows.iter().map(|row| {
        let names = wheels(row)?.iter().map(|wheel| wheel.name.clone());
        Some(names.collect::<Vec<_>>())
    });
    table.add("wheels", None, names);
    let numbers = [
        ("static_loads", "N"),
        ("least_otfs", "N"),
        ("least_loads", "N"),
        ("largest_loads", "N"),
    ];
    for (i, (name, unit)) in numbers.into_iter().enumerate() {
        let values = rows.iter().map(|row| {
            let of = |wheel: &WheelFacts| {
                [
                    wheel.static_load_n,
                    wheel.least_otf_n,
                    wheel.least_load_n,
                    wheel.largest_load_n,
                ][i]
            };
            Some(wheels(row)?.iter().map(of).collect::<Vec<_>>())
        });
        table.add(name, Some(unit), values);
    }
}

fn add_exposure(rows: &[&LogRow], table: &mut Table) {
    let all = || rows.iter().map(|row| Some(&facts(row)?.exposure));
    let seconds = all().map(|e| {
        let seconds = e?.margin_s.as_ref()?.iter().map(|&s| Some(s));
        Some(seconds.collect::<Vec<_>>())
    });
    table.add("margin_s", Some("s"), seconds);
    table.add("unknown_s", Some("s"), all().map(|e| Some(e?.unknown_s)));
    table.add("exposed_s", Some("s"), all().map(|e| e?.exposed_s));
    for (i, cause) in EXPOSURE_CAUSES.into_iter().enumerate() {
        let seconds = all().map(|e| e?.exposed_by_cause_s.as_ref()?.get(i).copied());
        table.add(format!("exposed_{cause}_s"), Some("s"), seconds);
    }
}

fn add_losses(rows: &[&LogRow], table: &mut Table) {
    type Count = fn(&LogFacts) -> Option<u64>;
    let all = || rows.iter().map(facts);
    let counts: [(&str, &str, Count); 4] = [
        ("lost_ranges", "ranges", |f| Some(f.lost_ranges)),
        ("lost_bytes", "bytes", |f| Some(f.lost_bytes)),
        ("missing_messages", "messages", |f| f.missing_messages),
        ("undecodable_messages", "messages", |f| {
            Some(f.undecodable_messages)
        }),
    ];
    for (name, unit, count) in counts {
        let values = all().map(|facts| facts.and_then(count));
        table.add(name, Some(unit), values);
    }
    table.add(
        "longest_gap_s",
        Some("s"),
        all().map(|f| Some(f?.longest_gap_s)),
    );
    table.add("findings", None, all().map(|f| Some(f?.findings.clone())));
    table.add("notes", None, all().map(|f| Some(f?.notes.clone())));
}

fn events(rows: &[&LogRow]) -> Table {
    let all: Vec<(&LogRow, &EventFacts)> = rows
        .iter()
        .filter_map(|row| Some((*row, row.record.analysed()?.1)))
        .flat_map(|(row, events)| events.iter().map(move |event| (row, event)))
        .collect();
    let mut table = Table::default();
    let ids = all.iter().map(|(row, _)| row.record.log_id.clone());
    table.add("log_id", None, ids);
    table.add(
        "path",
        None,
        all.iter().map(|(row, _)| row.record.path.clone()),
    );
    let all = || all.iter().map(|(_, event)| *event);
    table.add("kind", None, all().map(|e| e.kind.clone()));
    table.add("subject", None, all().map(|e| e.subject.clone()));
    table.add("start_ns", Some("ns"), all().map(|e| e.start_ns));
    table.add("end_ns", Some("ns"), all().map(|e| e.end_ns));
    table.add("duration_s", Some("s"), all().map(|e| e.duration_s));
    table.add("worst", Some("column unit"), all().map(|e| e.worst));
    table.add("unit", None, all().map(|e| e.unit.clone()));
    table.add("worst_ns", Some("ns"), all().map(|e| e.worst_ns));
    table.add("lead_s", Some("s"), all().map(|e| e.lead_s));
    table.add("certainty", Some("-"), all().map(|e| e.certainty));
    table.add("split_dependent", None, all().map(|e| e.split_dependent));
    table.add("main_cause", None, all().map(|e| e.main_cause.clone()));
    table.add(
        "main_cause_percent",
        Some("%"),
        all().map(|e| e.main_cause_percent),
    );
    table.add(
        "certainty_any_split",
        Some("-"),
        all().map(|e| e.certainty_any_split),
    );
    table.add("start_sigma_s", Some("s"), all().map(|e| e.start_sigma_s));
    table
}
