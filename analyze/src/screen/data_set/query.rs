//! SQL over a data set.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow};
use polars::prelude::{
    AnyValue, DataFrame, DataType, DslPlan, ExtraColumnsPolicy, IntoSeries, LazyFrame,
    NewChunkedArray, PlRefPath, PolarsError, ScanArgsParquet, SchemaRef, StringChunked, TimeUnit,
};
use polars::sql::{SQLContext, extract_table_identifiers};
use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::Value;

use super::event::FleetEvent;
use super::log::FleetLog;
use super::not_answered::{self, NotAnswered};
use super::{COMPARISONS, FleetComparison, TABLES, is_table, parquet_writer};
use crate::base::frame::{Day, Record};
use crate::screen::place::Place;
use crate::tables::table::Table;

/// The answer to a query: a table.
#[derive(Debug, Clone)]
pub struct Answer {
    frame: DataFrame,
}

/// Asks a data set, in a folder or a bucket, in SQL. Its tables are `logs`, `events` and `comparisons`.
///
/// # Errors
/// There is no data set, the query is not valid, or it names another table; see [`NotAnswered`].
pub fn query(data_set: &Path, sql: &str) -> Result<Answer> {
    let shows_tables = NotAnswered::unless_reading(sql)?.eq_ignore_ascii_case("SHOW");
    let named = extract_table_identifiers(sql, false, true)
        .map_err(|error| NotAnswered::not_parsed(sql, &error))?;
    let written: BTreeSet<String> = named.into_iter().collect();
    let named: BTreeSet<String> = written.iter().map(|name| name.to_lowercase()).collect();
    let place = Place::at(data_set)?;
    // tables of a bucket, until they are asked
    let fetched = tempfile::tempdir().context("no temporary folder can be made")?;
    let mut context = SQLContext::new();
    let mut is_empty = true;
    for (name, _) in &*TABLES {
        let keys: Vec<String> = place.list(name)?.into_iter().collect();
        let keys = keys.into_iter().filter(|key| is_table(Path::new(key)));
        let keys: Vec<String> = keys.map(|key| format!("{name}/{key}")).collect();
        is_empty &= keys.is_empty();
        if shows_tables {
            context.register(name, scan(name, &[])?);
        }
        if !named.contains(*name) {
            continue;
        }
        let files = match place.local() {
            Some(folder) => keys.iter().map(|key| folder.join(key)).collect(),
            None => fetch(&place, &keys, fetched.path())?,
        };
        let table = scan(name, &files)?;
        for spelled in written
            .iter()
            .filter(|spelled| spelled.eq_ignore_ascii_case(name))
        {
            context.register(spelled, table.clone());
        }
    }
    if is_empty {
        let text =
            format!("{place}: expected a data set of tipwatch screen (logs/*.parquet), found none");
        return Err(io::Error::new(io::ErrorKind::NotFound, text).into());
    }
    let answered = context.execute(sql).and_then(LazyFrame::collect);
    let frame = answered.map_err(|error| match error {
        // the files, not the query
        PolarsError::IO { .. } => anyhow!(not_answered::text(sql, &error, &named)),
        _ => NotAnswered::of(sql, &error, &named).into(),
    })?;
    match frame.width() {
        0 => Err(NotAnswered::without_columns(sql).into()),
        _ => Ok(Answer { frame }),
    }
}

/// The table of some files. Columns that files of older versions lack are null there, and those that newer versions add are left
/// out.
fn scan(name: &str, files: &[PathBuf]) -> Result<LazyFrame> {
    let empty = match name {
        "logs" => FleetLog::frame([].iter())?,
        COMPARISONS => FleetComparison::frame([].iter())?,
        _ => FleetEvent::frame([].iter())?,
    };
    if files.is_empty() {
        return Ok(polars::prelude::IntoLazy::lazy(empty));
    }
    let schema: SchemaRef = empty.schema().clone();
    let paths = files
        .iter()
        .map(|file| PlRefPath::try_from_path(file))
        .collect::<Result<Vec<_>, _>>()?;
    let asked = ScanArgsParquet {
        glob: false,
        schema: Some(schema),
        allow_missing_columns: true,
        ..ScanArgsParquet::default()
    };
    let mut table = LazyFrame::scan_parquet_files(paths.into_iter().collect(), asked)?;
    // the arguments have no word for it
    if let DslPlan::Scan {
        unified_scan_args, ..
    } = &mut table.logical_plan
    {
        unified_scan_args.extra_columns_policy = ExtraColumnsPolicy::Ignore;
    }
    Ok(table)
}

fn fetch(place: &Place, keys: &[String], folder: &Path) -> Result<Vec<PathBuf>> {
    place.in_parallel(keys, |key| {
        let file = folder.join(key);
        if let Some(parent) = file.parent() {
            std::fs::create_dir_all(parent)?;
        }
        std::fs::write(&file, place.read(key)?)?;
        Ok(file)
    })
}

impl Answer {
    /// Names of the columns.
    #[must_use]
    pub fn columns(&self) -> Vec<String> {
        let names = self.frame.get_column_names().into_iter();
        names.map(ToString::to_string).collect()
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.frame.height()
    }

    /// Converts the answer to a table of results.
    ///
    /// # Errors
    /// A column has a type that such tables do not have.
    pub fn table(&self) -> Result<Table> {
        let mut table = Table::default();
        for column in self.frame.columns() {
            let name = column.name().as_str();
            let known = TABLES.iter().flat_map(|(_, columns)| columns.iter());
            let unit = known
                .filter(|known| known.name == name)
                .find_map(|known| known.unit);
            let texts = || {
                let texts = (0..column.len()).map(|row| match json(&column.get(row).ok()?) {
                    Value::Null => None,
                    value => Some(text(&value)),
                });
                StringChunked::from_iter_options(column.name().clone(), texts).into_series()
            };
            // one chunk: the parts of an answer come as polars computed them
            let series = column.as_materialized_series().rechunk();
            let values = match column.dtype() {
                DataType::Int64 | DataType::UInt64 => series.clone(),
                whole if whole.is_integer() => series.cast(&DataType::Int64)?,
                DataType::List(of) if !matches!(**of, DataType::Float64 | DataType::String) => {
                    texts()
                }
                DataType::Boolean
                | DataType::Float32
                | DataType::Float64
                | DataType::String
                | DataType::Date
                | DataType::Datetime(..)
                | DataType::Duration(_)
                | DataType::List(_) => series.clone(),
                _ => texts(),
            };
            table.add_series(unit.map(Cow::from), values);
        }
        Ok(table)
    }

    /// The values of a row, as of JSON.
    #[must_use]
    pub fn row(&self, row: usize) -> Vec<Value> {
        let columns = self.frame.columns().iter();
        let value = |column: &polars::prelude::Column| {
            column.get(row).map_or(Value::Null, |value| json(&value))
        };
        columns.map(value).collect()
    }

    /// As JSON: one object per row, its keys in the order of the query.
    pub fn to_json(&self) -> impl Iterator<Item = impl Serialize> {
        let names = self.columns();
        (0..self.rows()).map(move |row| {
            let pairs = names.iter().cloned().zip(self.row(row));
            Object(pairs.collect())
        })
    }

    /// As CSV (RFC 4180) with a line of names; lists are JSON, what is missing is empty.
    pub fn to_csv(&self) -> impl Iterator<Item = String> {
        let line = |cells: Vec<String>| {
            let quoted = |cell: String| match cell.contains([',', '"', '\n', '\r']) {
                true => format!("\"{}\"", cell.replace('"', "\"\"")),
                false => cell,
            };
            let cells: Vec<String> = cells.into_iter().map(quoted).collect();
            cells.join(",")
        };
        let rows = (0..self.rows()).map(move |row| {
            let cells = self.row(row).into_iter().map(|value| text(&value));
            line(cells.collect())
        });
        std::iter::once(line(self.columns())).chain(rows)
    }

    /// As text in aligned columns, numbers to the right, at most `most` rows; says how many are left out.
    #[must_use]
    pub fn to_text(&self, most: usize) -> String {
        let shown = self.rows().min(most);
        let rows = (0..shown).map(|row| {
            let cells = self.row(row).into_iter();
            let cell = |value: Value| match value {
                Value::Null => "-".to_owned(),
                Value::Number(number) => rounded(&number),
                other => text(&other),
            };
            cells.map(cell).collect::<Vec<_>>()
        });
        let lines: Vec<Vec<String>> = std::iter::once(self.columns()).chain(rows).collect();
        let is_number = |column: &polars::prelude::Column| column.dtype().is_primitive_numeric();
        let right: Vec<bool> = self.frame.columns().iter().map(is_number).collect();
        let width = |column: usize| {
            let cells = lines.iter().map(|line| line[column].chars().count());
            cells.max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..right.len()).map(width).collect();
        let mut shown_text = String::new();
        for line in &lines {
            let cells = line.iter().zip(&widths).zip(&right);
            let cells: Vec<String> = cells
                .map(|((cell, &width), right)| match right {
                    true => format!("{cell:>width$}"),
                    false => format!("{cell:<width$}"),
                })
                .collect();
            shown_text.push_str(cells.join("  ").trim_end());
            shown_text.push('\n');
        }
        if shown < self.rows() {
            shown_text.push_str(&format!(
                "{} of {} rows; --csv, --json and --parquet give all\n",
                shown,
                self.rows()
            ));
        }
        shown_text
    }

    /// Writes a Parquet file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_parquet(&self, path: &Path) -> Result<()> {
        let failed = || format!("{}: cannot be written", path.display());
        let file = std::fs::File::create(path).with_context(failed)?;
        parquet_writer(file, self.frame.schema(), [])
            .finish(&mut self.frame.clone())
            .with_context(failed)?;
        Ok(())
    }
}

/// An object of JSON whose keys keep their order.
struct Object(Vec<(String, Value)>);

impl Serialize for Object {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_map(Some(self.0.len()))?;
        for (key, value) in &self.0 {
            object.serialize_entry(key, value)?;
        }
        object.end()
    }
}

/// Parts of a second.
fn parts(unit: TimeUnit) -> i64 {
    match unit {
        TimeUnit::Milliseconds => 1_000,
        TimeUnit::Microseconds => 1_000_000,
        TimeUnit::Nanoseconds => 1_000_000_000,
    }
}

/// Farthest time from 1970 that has a date in the calendar of the library (s): a quarter of a million years.
const FARTHEST_S: u64 = 8_000_000_000_000;

/// A number for a terminal.
fn rounded(number: &serde_json::Number) -> String {
    match number.as_f64() {
        Some(value) if number.is_f64() => crate::base::number::short(value),
        _ => number.to_string(),
    }
}

fn text(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

fn json(value: &AnyValue<'_>) -> Value {
    match value {
        AnyValue::Null => Value::Null,
        AnyValue::Boolean(value) => (*value).into(),
        AnyValue::String(text) => (*text).into(),
        AnyValue::StringOwned(text) => text.as_str().into(),
        AnyValue::List(values) => values.iter().map(|value| json(&value)).collect(),
        AnyValue::Float32(_) | AnyValue::Float64(_) => {
            // what is no number of JSON is null there
            value.extract::<f64>().map_or(Value::Null, Value::from)
        }
        _ if value.is_integer() && value.dtype() == DataType::UInt64 => {
            value.extract::<u64>().map_or(Value::Null, Value::from)
        }
        _ if value.is_integer() => value.extract::<i64>().map_or(Value::Null, Value::from),
        AnyValue::Date(day) => Day(*day).date().map_or(Value::Null, Value::from),
        AnyValue::Datetime(time, unit, _) | AnyValue::DatetimeOwned(time, unit, _) => {
            match (time / parts(*unit)).unsigned_abs() < FARTHEST_S {
                true => AnyValue::Datetime(*time, *unit, None).to_string().into(),
                false => (*time).into(),
            }
        }
        other => other.to_string().into(),
    }
}
