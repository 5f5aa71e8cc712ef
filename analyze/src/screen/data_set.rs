//! The data set: `logs/machine=M/day=D/logs.parquet`, one row per log, and
//! `events/machine=M/day=D/events.parquet`, one row per event.
//!
//! It is rebuilt from all records, and each file is replaced atomically. Machine and day are only in the
//! names of the folders (Hive partitioning).

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use polars::prelude::{
    Column, DataFrame, DataType, Float64Type, IntoColumn, ListBuilderTrait,
    ListPrimitiveChunkedBuilder, ListStringChunkedBuilder,
};

use super::merge::LogRow;
use super::record::Outcome;
use crate::base::files::{make_atomically, remove_unfinished};
use crate::events::EventKind;
use crate::policy::facts::{EXPOSURE_CAUSES, EventFacts, LogFacts, WheelFacts, WorstMargin};
use crate::tables::parquet::write_with;
use crate::tables::table::{Table, column};

/// Version of the columns.
pub(super) const DATA_SET_SCHEMA: u32 = 2;
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
        for (kind, table) in [("logs", logs(rows)?), ("events", events(rows)?)] {
            if table.frame.height() > 0 {
                let path = out
                    .join(kind)
                    .join(partition)
                    .join(format!("{kind}.parquet"));
                write_table(table, &path)?;
                written.insert(path);
            }
        }
    }
    for kind in ["logs", "events"] {
        remove_others(&out.join(kind), &format!("{kind}.parquet"), &written);
    }
    Ok(())
}

fn write_table(mut table: Table, path: &Path) -> Result<()> {
    let schema = [("tipwatch.data_set_schema", DATA_SET_SCHEMA.to_string())];
    make_atomically(path, |temporary| {
        write_with(&mut table, &schema, temporary)
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

/// A table under construction, with the units of its columns.
struct Columns(Vec<Column>, Vec<(String, &'static str)>);

impl Columns {
    fn add(&mut self, column: Column, unit: Option<&'static str>) {
        if let Some(unit) = unit {
            self.1.push((column.name().to_string(), unit));
        }
        self.0.push(column);
    }

    fn finish(self, height: usize) -> Result<Table> {
        Ok(Table {
            frame: DataFrame::new(height, self.0)?,
            units: self.1,
        })
    }
}

fn logs(rows: &[&LogRow]) -> Result<Table> {
    let mut columns = Columns(Vec::new(), Vec::new());
    add_identity(rows, &mut columns);
    add_time_range(rows, &mut columns);
    add_worst(rows, &mut columns);
    add_exposure(rows, &mut columns);
    for kind in EventKind::all() {
        let name = format!("{}_events", kind.name());
        let counts = rows.iter().map(|row| facts(row)?.events_of(*kind));
        columns.add(column(&name, counts), Some("events"));
    }
    add_losses(rows, &mut columns);
    columns.finish(rows.len())
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

fn add_identity(rows: &[&LogRow], columns: &mut Columns) {
    let records = || rows.iter().map(|row| &row.record);
    let machine = |record: &'_ super::record::Record| Some(record.machine.as_ref()?.sha256.clone());
    let reason = |row: &&LogRow| match &row.record.result {
        Outcome::Failed { reason } => Some(reason.clone()),
        Outcome::Analysed { .. } => None,
    };
    let status = |row: &&LogRow| match row.record.is_failed() {
        true => "failed",
        false => "analysed",
    };
    columns.add(column("log_id", records().map(|r| r.log_id.clone())), None);
    columns.add(column("path", records().map(|r| r.path.clone())), None);
    columns.add(
        column("copies", rows.iter().map(|row| row.copies)),
        Some("files"),
    );
    columns.add(column("bytes", records().map(|r| r.bytes)), Some("bytes"));
    columns.add(column("status", rows.iter().map(status)), None);
    columns.add(column("reason", rows.iter().map(reason)), None);
    let report = |r: &super::record::Record| r.report_folder().map(|f| format!("{f}/report.html"));
    columns.add(column("report", records().map(report)), None);
    columns.add(column("machine_file_sha256", records().map(machine)), None);
    let version = records().map(|r| r.analysis_version.clone());
    columns.add(column("analysis_version", version), None);
    let tipwatch = records().map(|r| r.tipwatch_version.clone());
    columns.add(column("tipwatch_version", tipwatch), None);
    columns.add(column("model", records().map(|r| r.model.clone())), None);
}

fn add_time_range(rows: &[&LogRow], columns: &mut Columns) {
    let all = || rows.iter().map(facts);
    columns.add(
        column("start_ns", all().map(|f| Some(f?.start_ns))),
        Some("ns"),
    );
    columns.add(column("end_ns", all().map(|f| Some(f?.end_ns))), Some("ns"));
    columns.add(
        column("duration_s", all().map(|f| Some(f?.duration_s))),
        Some("s"),
    );
    columns.add(column("rows", all().map(|f| Some(f?.rows))), Some("rows"));
    columns.add(
        column("valid_rows", all().map(|f| Some(f?.valid_rows))),
        Some("rows"),
    );
    let coverage = || rows.iter().map(|row| Some(facts(row)?.coverage));
    columns.add(
        column("covered_s", coverage().map(|c| Some(c?.covered_s))),
        Some("s"),
    );
    columns.add(
        column("computable_s", coverage().map(|c| Some(c?.computable_s))),
        Some("s"),
    );
    columns.add(
        column("valid_share", coverage().map(|c| c?.valid_share)),
        Some("-"),
    );
}

fn add_worst(rows: &[&LogRow], columns: &mut Columns) {
    let all = || rows.iter().map(worst);
    let utilisation = rows.iter().map(|row| facts(row)?.largest_utilisation);
    columns.add(
        column("worst_margin", all().map(|w| Some(w?.margin))),
        Some("-"),
    );
    columns.add(
        column("worst_margin_sigma", all().map(|w| w?.sigma)),
        Some("-"),
    );
    columns.add(
        column("worst_wheel", all().map(|w| Some(w?.wheel.clone()))),
        None,
    );
    columns.add(
        column("worst_ns", all().map(|w| Some(w?.time_ns))),
        Some("ns"),
    );
    columns.add(
        column("worst_otf", all().map(|w| Some(w?.otf_n))),
        Some("N"),
    );
    columns.add(
        column("worst_otf_sigma", all().map(|w| w?.otf_sigma_n)),
        Some("N"),
    );
    columns.add(column("largest_utilisation", utilisation), Some("-"));
    let names = rows.iter().map(|row| {
        let names = wheels(row)?.iter().map(|wheel| wheel.name.clone());
        Some(names.collect())
    });
    columns.add(texts("wheels", names), None);
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
            Some(wheels(row)?.iter().map(of).collect())
        });
        columns.add(lists(name, values), Some(unit));
    }
}

fn add_exposure(rows: &[&LogRow], columns: &mut Columns) {
    let all = || rows.iter().map(|row| Some(&facts(row)?.exposure));
    let seconds = all().map(|e| Some(e?.margin_s.as_ref()?.iter().map(|&s| Some(s)).collect()));
    columns.add(lists("margin_s", seconds), Some("s"));
    columns.add(
        column("unknown_s", all().map(|e| Some(e?.unknown_s))),
        Some("s"),
    );
    columns.add(column("exposed_s", all().map(|e| e?.exposed_s)), Some("s"));
    for (i, cause) in EXPOSURE_CAUSES.into_iter().enumerate() {
        let seconds = all().map(|e| e?.exposed_by_cause_s.as_ref()?.get(i).copied());
        columns.add(column(&format!("exposed_{cause}_s"), seconds), Some("s"));
    }
}

fn add_losses(rows: &[&LogRow], columns: &mut Columns) {
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
        columns.0.push(column(name, values));
        columns.1.push((name.into(), unit));
    }
    columns.add(
        column("longest_gap_s", all().map(|f| Some(f?.longest_gap_s))),
        Some("s"),
    );
    columns.add(
        texts("findings", all().map(|f| Some(f?.findings.clone()))),
        None,
    );
    columns.add(texts("notes", all().map(|f| Some(f?.notes.clone()))), None);
}

fn events(rows: &[&LogRow]) -> Result<Table> {
    let all: Vec<(&LogRow, &EventFacts)> = rows
        .iter()
        .filter_map(|row| Some((*row, row.record.analysed()?.1)))
        .flat_map(|(row, events)| events.iter().map(move |event| (row, event)))
        .collect();
    let mut columns = Columns(Vec::new(), Vec::new());
    let ids = all.iter().map(|(row, _)| row.record.log_id.clone());
    columns.add(column("log_id", ids), None);
    columns.add(
        column("path", all.iter().map(|(row, _)| row.record.path.clone())),
        None,
    );
    let all = || all.iter().map(|(_, event)| *event);
    columns.add(column("kind", all().map(|e| e.kind.clone())), None);
    columns.add(column("subject", all().map(|e| e.subject.clone())), None);
    columns.add(column("start_ns", all().map(|e| e.start_ns)), Some("ns"));
    columns.add(column("end_ns", all().map(|e| e.end_ns)), Some("ns"));
    columns.add(column("duration_s", all().map(|e| e.duration_s)), Some("s"));
    columns.add(column("worst", all().map(|e| e.worst)), Some("column unit"));
    columns.add(column("unit", all().map(|e| e.unit.clone())), None);
    columns.add(column("worst_ns", all().map(|e| e.worst_ns)), Some("ns"));
    columns.add(column("lead_s", all().map(|e| e.lead_s)), Some("s"));
    columns.add(column("certainty", all().map(|e| e.certainty)), Some("-"));
    columns.add(
        column("split_dependent", all().map(|e| e.split_dependent)),
        None,
    );
    columns.add(
        column("main_cause", all().map(|e| e.main_cause.clone())),
        None,
    );
    columns.add(
        column("main_cause_percent", all().map(|e| e.main_cause_percent)),
        Some("%"),
    );
    columns.add(
        column("certainty_any_split", all().map(|e| e.certainty_any_split)),
        Some("-"),
    );
    columns.add(
        column("start_sigma_s", all().map(|e| e.start_sigma_s)),
        Some("s"),
    );
    let height = all().count();
    columns.finish(height)
}

/// A column of lists of numbers, of one type even if all are empty.
fn lists(name: &str, rows: impl Iterator<Item = Option<Vec<Option<f64>>>>) -> Column {
    let mut builder =
        ListPrimitiveChunkedBuilder::<Float64Type>::new(name.into(), 0, 0, DataType::Float64);
    for row in rows {
        match row {
            Some(values) => builder.append_iter(values.into_iter()),
            None => builder.append_null(),
        }
    }
    builder.finish().into_column()
}

/// A column of lists of texts.
fn texts(name: &str, rows: impl Iterator<Item = Option<Vec<String>>>) -> Column {
    let mut builder = ListStringChunkedBuilder::new(name.into(), 0, 0);
    for row in rows {
        match row {
            Some(values) => builder.append_values_iter(values.iter().map(String::as_str)),
            None => builder.append_null(),
        }
    }
    builder.finish().into_column()
}
