//! The data set: `logs/2026-06.parquet`, one row per log, and `events/2026-06.parquet`, one row per event, a file a month; and
//! `comparisons/all.parquet`.
//!
//! The data set follows from all records alone, to the byte: a file that would not change is neither written nor uploaded.

mod comparison;
mod event;
mod log;
mod not_answered;
mod query;

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{BufRead, BufReader, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use anyhow::{Context, Result};
use polars::prelude::{
    CompatLevel, KeyValueMetadata, ParquetCompression, ParquetWriter, Schema, SchemaExt,
};
use polars_parquet::write::schema_to_metadata_key;
use rayon::prelude::*;

use self::event::FleetEvent;
use self::log::FleetLog;
use super::merge::LogRow;
use crate::base::files::{remove_unfinished, unfinished_of};
use crate::base::frame::{ColumnInfo, Record};

pub(super) use self::comparison::FleetComparison;
pub(super) use self::log::{contradicts_margin, doubted, lifted};
pub use not_answered::NotAnswered;
pub use query::{Answer, query};

/// Version of the columns.
pub(super) const DATA_SET_SCHEMA: u32 = 7;
/// Most rows of a file, some 128 MB: a month of a large fleet has several.
const MOST_ROWS: usize = 400_000;
/// Least rows of a row group but the last, which readers skip as a whole.
const ROWS_OF_GROUP: usize = 1 << 14;
/// Logs whose rows are made at a time: as structs they take several times the memory that their columns take.
const ROWS_AT_A_TIME: usize = 1 << 10;
/// Folder of the comparisons, and their file.
const COMPARISONS: &str = "comparisons";
const ALL: &str = "all.parquet";
/// File of the rows without a date.
const UNDATED: &str = "undated";

/// The tables of a data set, with their columns.
pub static TABLES: LazyLock<[(&str, Vec<ColumnInfo>); 3]> = LazyLock::new(|| {
    [
        ("logs", FleetLog::columns()),
        ("events", FleetEvent::columns()),
        (COMPARISONS, FleetComparison::columns()),
    ]
});

/// Writes the tables of all logs, of which at least `min_valid` of the time must be computable to decide anything, and removes files
/// that are no longer part of them.
pub(super) fn write(rows: &[LogRow], min_valid: f64, out: &Path) -> Result<()> {
    let mut months: BTreeMap<String, Vec<&LogRow>> = BTreeMap::new();
    for row in rows {
        months.entry(month(row)).or_default().push(row);
    }
    let mut files = Vec::new();
    for (month, rows) in &mut months {
        rows.sort_by_cached_key(|row| {
            let machine = row.record.machine.as_ref().map(|machine| &machine.name);
            let start = row.record.analysed().map(|(facts, _)| facts.start_ns);
            (machine.cloned(), start, row.record.path.clone())
        });
        for (part, rows) in rows.chunks(MOST_ROWS).enumerate() {
            files.push((file_name(month, part), rows));
        }
    }
    let mut written = BTreeSet::new();
    for (name, rows) in files {
        let logs = rows.chunks(ROWS_AT_A_TIME);
        let logs = logs.map(|rows| {
            let rows = rows.par_iter();
            rows.map(|row| FleetLog::of(row, min_valid)).collect()
        });
        written.extend(write_table(logs, &out.join("logs").join(&name))?);
        let events = rows.chunks(ROWS_AT_A_TIME);
        let events = events.map(|rows| rows.iter().flat_map(|row| event::all_of(row)).collect());
        written.extend(write_table::<FleetEvent<'_>>(
            events,
            &out.join("events").join(&name),
        )?);
    }
    for kind in ["logs", "events"] {
        remove_others(&out.join(kind), &written)?;
    }
    Ok(())
}

/// Writes how the machines compare.
pub(super) fn write_comparisons(compared: Vec<FleetComparison>, out: &Path) -> Result<()> {
    let folder = out.join(COMPARISONS);
    let written = write_table([compared].into_iter(), &folder.join(ALL))?;
    remove_others(&folder, &written.into_iter().collect())
}

/// `2026-06.parquet`, and `2026-06.1.parquet` for what does not fit into it.
fn file_name(month: &str, part: usize) -> String {
    match part {
        0 => format!("{month}.parquet"),
        part => format!("{month}.{part}.parquet"),
    }
}

fn month(row: &LogRow) -> String {
    let date = row.record.date();
    date.map_or_else(
        || UNDATED.to_owned(),
        |date| date.strftime("%Y-%m").to_string(),
    )
}

/// Writes a table of records, some at a time, unless it is there already; returns its path, or nothing of a table without
/// rows.
fn write_table<R: Record>(
    records: impl Iterator<Item = Vec<R>>,
    path: &Path,
) -> Result<Option<PathBuf>> {
    let mut records = records.skip_while(Vec::is_empty);
    let Some(first) = records.next() else {
        return Ok(None);
    };
    let failed = || format!("{}: cannot be written", path.display());
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).with_context(failed)?;
    }
    let (file, unfinished) = unfinished_of(path)?;
    let mut group = R::frame(first.iter())?;
    drop(first);
    let metadata = [
        ("tipwatch.units".to_owned(), R::units()),
        (
            "tipwatch.data_set_schema".to_owned(),
            DATA_SET_SCHEMA.to_string(),
        ),
    ];
    let mut writer = parquet_writer(BufWriter::new(file), group.schema(), metadata)
        .batched(group.schema())
        .with_context(failed)?;
    for records in records {
        if group.height() >= ROWS_OF_GROUP {
            group.rechunk_mut();
            writer.write_batch(&group).with_context(failed)?;
            group = group.clear();
        }
        group.vstack_mut_owned(R::frame(records.iter())?)?;
    }
    group.rechunk_mut();
    writer.write_batch(&group).with_context(failed)?;
    writer.finish().with_context(failed)?;
    if !is_same(&unfinished, path) {
        unfinished.persist(path).with_context(failed)?;
    }
    Ok(Some(path.to_owned()))
}

/// A writer of a table. The types of Arrow that the file names for its readers are the oldest ones: pandas and Dask cannot
/// take lists of the newer strings.
fn parquet_writer<W: std::io::Write>(
    writer: W,
    schema: &Schema,
    metadata: impl IntoIterator<Item = (String, String)>,
) -> ParquetWriter<W> {
    let types = schema_to_metadata_key(&schema.to_arrow(CompatLevel::oldest()));
    let types = types.value.map(|value| (types.key, value));
    let metadata = metadata.into_iter().chain(types).collect();
    ParquetWriter::new(writer)
        .with_compression(ParquetCompression::Zstd(None))
        .with_key_value_metadata(Some(KeyValueMetadata::from_static(metadata)))
}

/// Whether two files have the same bytes.
fn is_same(a: &Path, b: &Path) -> bool {
    let length = |path: &Path| fs::metadata(path).map(|metadata| metadata.len()).ok();
    if length(a).is_none() || length(a) != length(b) {
        return false;
    }
    let read = |path: &Path| File::open(path).map(BufReader::new);
    let (Ok(mut a), Ok(mut b)) = (read(a), read(b)) else {
        return false;
    };
    loop {
        let (Ok(of_a), Ok(of_b)) = (a.fill_buf(), b.fill_buf()) else {
            return false;
        };
        let length = of_a.len().min(of_b.len());
        if of_a[..length] != of_b[..length] {
            return false;
        }
        if length == 0 {
            return of_a.is_empty() && of_b.is_empty();
        }
        a.consume(length);
        b.consume(length);
    }
}

/// Removes the tables of a kind that are not part of the data set, and those of older versions, in folders by machine
/// and day. Other files stay.
///
/// # Errors
/// A file cannot be removed: its rows would count twice.
fn remove_others(folder: &Path, written: &BTreeSet<PathBuf>) -> Result<()> {
    remove_unfinished(folder);
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let name = entry.file_name();
        let is_of_older_version = name.to_string_lossy().starts_with("machine=");
        if path.is_dir() && is_of_older_version {
            fs::remove_dir_all(&path)
        } else if is_table(&path) && !written.contains(&path) {
            fs::remove_file(&path)
        } else {
            Ok(())
        }
        .with_context(|| format!("{}: cannot be removed", path.display()))?;
    }
    Ok(())
}

/// Whether a file of a data set is one of its tables.
pub(super) fn is_table(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension == "parquet")
}
