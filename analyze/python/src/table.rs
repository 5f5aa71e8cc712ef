//! Tables that Arrow readers take without a copy.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::io::Cursor;
use std::ops::Range;
use std::sync::Arc;

use anyhow::anyhow;
use polars::prelude::{
    ArrayRef, ArrowDataType, ArrowField, ArrowSchema, CompatLevel, IdxSize, PolarsResult, Series,
    polars_bail,
};
use polars_arrow::array::StructArray;
use polars_arrow::datatypes::Metadata;
use polars_arrow::ffi::{export_array_to_c, export_field_to_c, export_iterator};
use polars_arrow::io::ipc::read::{StreamReader, StreamState, read_stream_metadata};
use polars_arrow::io::ipc::write::{StreamWriter, WriteOptions};
use polars_arrow::record_batch::RecordBatchT;
use pyo3::exceptions::{PyImportError, PyIndexError, PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule, PyDict, PyIterator, PyList, PySlice};
use tipwatch_analyze::base::scratch_file::ScratchFile;
use tipwatch_analyze::tables::table;

use crate::arrays::{numbers_of, object_of, text_of, view_of};
use crate::call::error::{Mistake, exception, of_kind, of_polars};
use crate::call::pickle::{Reduced, reduced};

/// Rows and columns that a notebook shows.
const SHOWN_ROWS: usize = 20;
const SHOWN_COLUMNS: usize = 12;

/// Key of a field's metadata with the unit of its column.
const UNIT: &str = "unit";

/// Types that all readers of Arrow know.
const TYPES: CompatLevel = CompatLevel::oldest();

/// A table: columns of equal length with names and units.
///
/// ``table["load_fl"]`` is one column, ``table[["time_ns", "load_fl"]]`` a table of two, ``table[:100]`` one of its first
/// rows; ``to_polars()``, ``to_arrow()`` and ``to_pandas()`` make the table of a library. polars, pyarrow and DuckDB take its
/// numbers without copying, by the Arrow PyCapsule interface (``polars.DataFrame(table)``); pandas copies.
#[pyclass(frozen, module = "tipwatch")]
pub(crate) struct Table(table::Table);

/// The chunks of its columns are alike.
impl From<table::Table> for Table {
    fn from(table: table::Table) -> Self {
        let mut columns = table.columns().iter().map(table::Column::series);
        let first = columns.next();
        let is_alike =
            first.is_none_or(|a| columns.all(|b| a.chunk_lengths().eq(b.chunk_lengths())));
        match is_alike {
            true => Self(table),
            false => Self(table).with_values(|values| values.rechunk()),
        }
    }
}

/// Rows from which on blocks become one chunk: the log of an hour has six.
const ROWS_OF_A_CHUNK: usize = 1 << 16;
/// Rows from which on blocks are laid aside: of all columns of a machine some megabytes.
const ROWS_LAID_ASIDE: usize = 1 << 13;

/// The blocks of a table as they come, joined to chunks: readers that work chunk by chunk want few. Until the last one came they
/// wait in a temporary file, because an analysis needs its memory as long.
#[derive(Default)]
pub(crate) struct Chunks {
    /// The columns that are kept; all if `None`.
    names: Option<Vec<String>>,
    columns: Vec<Waiting>,
    open_rows: usize,
    file: Option<ScratchFile>,
    length: u64,
}

/// A column of which the first rows are in a file.
struct Waiting {
    open: table::Column,
    /// Rows of each part, and where it is; `None` for one in which nothing is known.
    parts: Vec<(usize, Option<Range<u64>>)>,
}

impl Chunks {
    /// No block yet. These columns of each are kept; all if `None`.
    pub(crate) fn of(names: Option<Vec<String>>) -> Self {
        Self {
            names,
            ..Self::default()
        }
    }

    /// Takes the next block, which has the columns of those before.
    ///
    /// # Errors
    /// The block has other columns, or lacks one that is kept, or no temporary file can be written.
    pub(crate) fn take(&mut self, block: &table::Table) -> anyhow::Result<()> {
        let places = match &self.names {
            Some(names) => {
                let places = names.iter().map(|name| place(block, name));
                places.collect::<Result<_, _>>().map_err(Mistake)?
            }
            None => (0..block.columns().len()).collect::<Vec<_>>(),
        };
        let next = places.into_iter().map(|place| &block.columns()[place]);
        if self.columns.is_empty() {
            let empty = next.clone().map(|column| Waiting {
                open: column.with_values(column.series().clear()),
                parts: Vec::new(),
            });
            self.columns = empty.collect();
        }
        anyhow::ensure!(
            self.columns.len() == next.len()
                && (self.columns.iter().zip(next.clone())).all(|(a, b)| a.open.is_like(b)),
            "expected blocks with the same columns, found others"
        );
        for (column, next) in self.columns.iter_mut().zip(next) {
            column.open.append(next)?;
        }
        self.open_rows += block.rows();
        match self.open_rows >= ROWS_LAID_ASIDE {
            true => self.lay_aside(),
            false => Ok(()),
        }
    }

    fn lay_aside(&mut self) -> anyhow::Result<()> {
        let file = match &mut self.file {
            Some(file) => file,
            None => self.file.insert(ScratchFile::new()?),
        };
        for Waiting { open, parts } in &mut self.columns {
            let place = match is_unknown(open.series()) {
                true => None,
                false => {
                    let values = open.with_values(open.series().rechunk());
                    let written = written(&[values])?;
                    file.append(&written)?;
                    let from = self.length;
                    self.length += written.len() as u64;
                    Some(from..self.length)
                }
            };
            parts.push((self.open_rows, place));
            *open = open.with_values(open.series().clear());
        }
        self.open_rows = 0;
        Ok(())
    }

    /// The table of all blocks; without a block it has no columns. What no longer needs its memory should have gone before.
    ///
    /// # Errors
    /// The temporary file cannot be read.
    pub(crate) fn finish(self) -> anyhow::Result<Table> {
        // chunks in which nothing is known are one in memory
        let mut unknown = HashMap::new();
        let columns = self.columns.into_iter().map(|column| {
            let (open, mut whole) = (column.open.series(), column.open.series().clear());
            let mut parts = column
                .parts
                .chunks(ROWS_OF_A_CHUNK / ROWS_LAID_ASIDE)
                .peekable();
            let mut is_open = self.open_rows > 0;
            while is_open || parts.peek().is_some() {
                let parts = parts.next().unwrap_or_default();
                let mut chunk = open.clear();
                for (rows, place) in parts {
                    chunk.append(&match (place, &self.file) {
                        (Some(place), Some(file)) => part(file, place)?,
                        _ => Series::full_null(open.name().clone(), *rows, open.dtype()),
                    })?;
                }
                if parts.len() < ROWS_OF_A_CHUNK / ROWS_LAID_ASIDE {
                    is_open = false;
                    chunk.append(open)?;
                }
                let chunk = match is_unknown(&chunk) {
                    true => {
                        let same = unknown.entry((chunk.dtype().to_string(), chunk.len()));
                        let same: &Series = same.or_insert_with(|| chunk.rechunk());
                        same.clone().with_name(open.name().clone())
                    }
                    false => chunk.rechunk(),
                };
                whole.append(&chunk)?;
            }
            Ok(column.open.with_values(whole))
        });
        Ok(Table(columns.collect::<anyhow::Result<_>>()?))
    }
}

fn is_unknown(values: &Series) -> bool {
    values.null_count() == values.len()
}

/// A part of a column again.
fn part(file: &ScratchFile, place: &Range<u64>) -> anyhow::Result<Series> {
    let mut bytes = vec![0; usize::try_from(place.end - place.start)?];
    file.read_at(&mut bytes, place.start)?;
    let table = read(&bytes)?;
    let column = table.columns().first();
    let column = column.ok_or_else(|| anyhow!("a temporary file is not as it was written"))?;
    Ok(column.series().clone())
}

/// A column's name, type and unit.
fn field(column: &table::Column) -> ArrowField {
    let kind = column.series().dtype().to_arrow(TYPES);
    let field = ArrowField::new(column.name().into(), kind, true);
    match column.unit() {
        Some(unit) => field.with_metadata(Metadata::from([(UNIT.into(), unit.into())])),
        None => field,
    }
}

/// The chunks of columns that have them alike: number of rows and values of each column.
fn chunks(columns: &[table::Column]) -> impl Iterator<Item = (usize, Vec<ArrayRef>)> {
    let lengths = columns
        .first()
        .into_iter()
        .flat_map(|column| column.series().chunk_lengths());
    lengths.enumerate().map(|(at, rows)| {
        let columns = columns
            .iter()
            .map(|column| column.series().to_arrow(at, TYPES));
        (rows, columns.collect())
    })
}

/// Columns in the streaming format of Arrow.
fn written(columns: &[table::Column]) -> PolarsResult<Vec<u8>> {
    let schema: ArrowSchema = columns.iter().map(field).collect();
    let mut writer = StreamWriter::new(Vec::new(), WriteOptions { compression: None });
    writer.start(&schema, None)?;
    let schema = Arc::new(schema);
    for (rows, values) in chunks(columns) {
        let batch = RecordBatchT::try_new(rows, Arc::clone(&schema), values)?;
        writer.write(&batch, None)?;
    }
    writer.finish()?;
    Ok(writer.into_inner())
}

fn read(bytes: &[u8]) -> PolarsResult<table::Table> {
    let mut bytes = Cursor::new(bytes);
    let metadata = read_stream_metadata(&mut bytes)?;
    let fields: Vec<ArrowField> = metadata.schema.iter_values().cloned().collect();
    let mut columns = vec![Vec::new(); fields.len()];
    for batch in StreamReader::new(bytes, metadata, None) {
        let StreamState::Some(batch) = batch? else {
            polars_bail!(ComputeError: "expected a whole stream of Arrow, found one that is cut off");
        };
        for (chunks, values) in columns.iter_mut().zip(batch.into_arrays()) {
            chunks.push(values);
        }
    }
    let columns = fields.iter().zip(columns).map(|(field, chunks)| {
        let unit = field.metadata.as_ref().and_then(|known| known.get(UNIT));
        let unit = unit.map(|unit| unit.to_string().into());
        Ok(table::Column::new(unit, Series::try_from((field, chunks))?))
    });
    columns.collect()
}

/// Most wrong letters of a name that is still recognised, and most suggestions.
const MOST_WRONG: usize = 2;
const MOST_NEAR: usize = 3;

/// Place of a column.
///
/// # Errors
/// There is none of this name.
fn place(table: &table::Table, name: &str) -> Result<usize, String> {
    let all = table.columns().iter().map(table::Column::name);
    let place = all.clone().position(|other| other == name);
    place.ok_or_else(|| no_column(all, name))
}

/// Refuses names of which one stands twice.
pub(crate) fn once(names: &[String]) -> Result<(), String> {
    match (1..names.len()).find(|&at| names[..at].contains(&names[at])) {
        Some(twice) => Err(format!(
            "expected each column once (columns), found \"{}\" twice",
            names[twice]
        )),
        None => Ok(()),
    }
}

/// Says that there is no such column, and which are called almost so.
pub(crate) fn no_column<'a>(all: impl Iterator<Item = &'a str> + Clone, name: &str) -> String {
    let far = |other: &&str| strsim::damerau_levenshtein(name, other);
    let mut near: Vec<&str> = all
        .clone()
        .filter(|other| far(other) <= MOST_WRONG)
        .collect();
    near.sort_by_key(far);
    near.truncate(MOST_NEAR);
    let near = match near.is_empty() {
        true => String::new(),
        false => format!(". Did you mean {near:?}?"),
    };
    let columns = all.count();
    format!("expected one of the {columns} columns of the table (columns), found \"{name}\"{near}")
}

impl Table {
    /// Place of a column.
    ///
    /// # Errors
    /// There is none of this name.
    fn place(&self, name: &str) -> PyResult<usize> {
        place(&self.0, name).map_err(PyKeyError::new_err)
    }

    /// The table of some columns.
    fn project(&self, places: &[usize]) -> Self {
        let columns = places.iter().map(|&place| self.0.columns()[place].clone());
        Self(columns.collect())
    }

    /// The columns with other values.
    fn with_values(&self, values: impl Fn(&Series) -> Series) -> Self {
        let columns = self.0.columns().iter();
        Self(
            columns
                .map(|column| column.with_values(values(column.series())))
                .collect(),
        )
    }

    /// Returns `rows` rows from `start` on as a table, without a copy.
    fn part(&self, start: usize, rows: usize) -> Self {
        let start = i64::try_from(start).unwrap_or(i64::MAX);
        self.with_values(|values| values.slice(start, rows))
    }

    /// The table of some rows, in any order; without a copy where they follow each other.
    ///
    /// # Errors
    /// The slice is not one of whole numbers, or the table has too many rows.
    fn rows(&self, slice: &Bound<'_, PySlice>) -> PyResult<Self> {
        let found = slice.indices(isize::try_from(self.__len__())?)?;
        if found.step == 1 || found.slicelength == 0 {
            return Ok(self.part(found.start.unsigned_abs(), found.slicelength));
        }
        let wanted = (0..found.slicelength)
            .map(|at| IdxSize::try_from((found.start + at as isize * found.step).unsigned_abs()));
        let wanted = wanted.collect::<Result<Vec<_>, _>>()?;
        let columns = self.0.columns().iter().map(|column| {
            let values = column.series().take_slice(&wanted)?;
            Ok(column.with_values(values))
        });
        let columns: PolarsResult<table::Table> = columns.collect();
        Ok(columns.map_err(of_polars)?.into())
    }
}

#[pymethods]
impl Table {
    /// Names of the columns.
    #[getter]
    fn columns(&self) -> Vec<&str> {
        let columns = self.0.columns().iter();
        columns.map(table::Column::name).collect()
    }

    /// Units of the columns that have one, by name.
    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let units = PyDict::new(py);
        for column in self.0.columns() {
            if let Some(unit) = column.unit() {
                units.set_item(column.name(), unit)?;
            }
        }
        Ok(units)
    }

    pub(crate) fn __len__(&self) -> usize {
        self.0.rows()
    }

    /// A column by its name, a table of some columns by a list of names, or one of some rows by a slice.
    fn __getitem__<'py>(&self, key: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let py = key.py();
        if let Ok(slice) = key.cast::<PySlice>() {
            return Ok(Bound::new(py, self.rows(slice)?)?.into_any());
        }
        if let Ok(name) = key.extract::<String>() {
            let column = Column(self.project(&[self.place(&name)?]));
            return Ok(Bound::new(py, column)?.into_any());
        }
        let Ok(names) = key.extract::<Vec<String>>() else {
            return Err(PyTypeError::new_err(format!(
                "expected the name of a column, a list of names or a slice of rows, found {}; table[name][row] is one value",
                key.get_type().name()?
            )));
        };
        once(&names).map_err(PyValueError::new_err)?;
        let places = names.iter().map(|name| self.place(name));
        let table = self.project(&places.collect::<PyResult<Vec<_>>>()?);
        Ok(Bound::new(py, table)?.into_any())
    }

    /// Whether there is a column of this name.
    fn __contains__(&self, name: &str) -> bool {
        self.0.column(name).is_some()
    }

    /// The first ``n`` rows.
    ///
    /// Raises
    /// ------
    /// TipwatchError
    ///     ``n`` is negative.
    #[pyo3(signature = (n=5))]
    fn head(&self, n: i64) -> PyResult<Self> {
        let rows = usize::try_from(n).map_err(|_| {
            let text = format!("expected n of at least 0, found {n}");
            exception(&anyhow!(Mistake(text)))
        });
        Ok(self.part(0, rows?))
    }

    /// As ``polars.DataFrame``: numbers without a copy.
    fn to_polars<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        library(slf.py(), "polars", "Table.to_polars")?.call_method1("DataFrame", (slf,))
    }

    /// As ``pyarrow.Table``: numbers without a copy.
    fn to_arrow<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        library(slf.py(), "pyarrow", "Table.to_arrow")?.call_method1("table", (slf,))
    }

    /// As ``pandas.DataFrame``, by pyarrow; pandas copies the values.
    fn to_pandas<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        for name in ["pandas", "pyarrow"] {
            library(slf.py(), name, "Table.to_pandas")?;
        }
        Self::to_arrow(slf)?.call_method0("to_pandas")
    }

    /// For pickle: the table as an Arrow stream.
    fn __reduce__<'py>(this: &Bound<'py, Self>) -> Reduced<'py, (Bound<'py, PyBytes>,)> {
        let bytes = written(this.get().0.columns());
        let bytes = bytes.map_err(of_polars)?;
        reduced(this, (PyBytes::new(this.py(), &bytes),))
    }

    #[staticmethod]
    fn _of_parts(bytes: &[u8]) -> PyResult<Self> {
        let table = read(bytes).map_err(of_polars)?;
        Ok(table.into())
    }

    fn __repr__(&self) -> String {
        format!(
            "<tipwatch.Table of {} rows and {} columns>",
            self.__len__(),
            self.0.columns().len()
        )
    }

    /// The table in a notebook: its first rows with names and units.
    pub(crate) fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        let columns = self.0.columns();
        let shown = &columns[..columns.len().min(SHOWN_COLUMNS)];
        let has_more = |tag: &str| match shown.len() < columns.len() {
            true => format!("<{tag}>…</{tag}>"),
            false => String::new(),
        };
        let mut html = String::from("<table><thead><tr>");
        for column in shown {
            let unit = column.unit();
            let unit = unit.map_or(String::new(), |unit| format!("<br>[{}]", escaped(unit)));
            // writing to a text does not fail
            let _ = write!(html, "<th>{}{unit}</th>", escaped(column.name()));
        }
        let _ = write!(html, "{}</tr></thead><tbody>", has_more("th"));
        for row in 0..self.__len__().min(SHOWN_ROWS) {
            html.push_str("<tr>");
            for column in shown {
                let text = escaped(&text_of(py, column.series(), row)?);
                let _ = write!(html, "<td>{text}</td>");
            }
            let _ = write!(html, "{}</tr>", has_more("td"));
        }
        let (rows, columns) = (self.__len__(), columns.len());
        let cut = match rows > SHOWN_ROWS {
            true => format!(" (the first {SHOWN_ROWS} shown)"),
            false => String::new(),
        };
        let _ = write!(
            html,
            "</tbody></table><p>{rows} rows{cut}, {columns} columns</p>"
        );
        Ok(html)
    }

    /// The table as a stream of Arrow record batches (Arrow PyCapsule interface).
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // the protocol lets a producer answer with the types that it has
        drop(requested_schema);
        let kind = ArrowDataType::Struct(self.0.columns().iter().map(field).collect());
        let row = ArrowField::new("".into(), kind.clone(), false);
        let chunks = chunks(self.0.columns()).map(move |(rows, values)| {
            Ok(StructArray::try_new(kind.clone(), rows, values, None)?.boxed())
        });
        let stream = export_iterator(Box::new(chunks.collect::<Vec<_>>().into_iter()), row);
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
    }
}

/// One column of a table: ``numpy.asarray(table["load_fl"])``. ``column[0]`` is its first value, ``column[-1]`` its last one,
/// ``column[10:20]`` a part of it; a loop goes over its values.
///
/// NumPy gets an array in which NaN is what is missing: read-only and without a copy where the column has numbers of 64 or
/// 32 bits in one chunk and none is missing, else a copy. polars and pyarrow take it as a series or an array
/// (``polars.Series(column)``), several chunks joined to one.
#[pyclass(frozen, module = "tipwatch")]
pub(crate) struct Column(
    /// A table of one column.
    Table,
);

impl Column {
    fn own(&self) -> &table::Column {
        &self.0.0.columns()[0]
    }
}

#[pymethods]
impl Column {
    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        self.own().name()
    }

    /// Its unit; None for what has none.
    #[getter]
    fn unit(&self) -> Option<&str> {
        self.own().unit()
    }

    fn __len__(&self) -> usize {
        self.0.__len__()
    }

    /// A value by its row, counted from the end if negative, or a part of the column by a slice.
    fn __getitem__<'py>(&self, key: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let py = key.py();
        if let Ok(slice) = key.cast::<PySlice>() {
            return Ok(Bound::new(py, Self(self.0.rows(slice)?))?.into_any());
        }
        let Ok(row) = key.extract::<isize>() else {
            return Err(PyTypeError::new_err(format!(
                "expected a row or a slice of rows, found {}",
                key.get_type().name()?
            )));
        };
        let length = self.__len__();
        let from_start = match row {
            0.. => row.unsigned_abs(),
            _ => length.wrapping_sub(row.unsigned_abs()),
        };
        match from_start < length {
            true => object_of(py, self.own().series(), from_start),
            false => Err(PyIndexError::new_err(format!(
                "expected a row below {length}, found {row}"
            ))),
        }
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyIterator>> {
        PyList::new(py, self.to_list(py)?)?.try_iter()
    }

    /// For pickle: the column as a table of one.
    fn __reduce__<'py>(this: &Bound<'py, Self>) -> Reduced<'py, (Table, String)> {
        let (own, getitem) = (
            this.get(),
            this.py().import("operator")?.getattr("getitem")?,
        );
        Ok((getitem, (Table(own.0.0.clone()), own.name().to_owned())))
    }

    fn __repr__(&self) -> String {
        let unit = self
            .unit()
            .map_or(String::new(), |unit| format!(" [{unit}]"));
        format!(
            "<tipwatch.Column {}{unit} of {} rows>",
            self.name(),
            self.__len__()
        )
    }

    /// The values in a list; None is what is missing.
    fn to_list<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let values = self.own().series();
        let rows = 0..values.len();
        rows.map(|row| object_of(py, values, row)).collect()
    }

    /// The column in a notebook: its first values.
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        self.0._repr_html_(py)
    }

    /// The column as an array of NumPy; None is NaN. Read-only where it is not a copy.
    #[pyo3(signature = (dtype=None, copy=None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let values = self.own().series();
        let keywords = PyDict::new(py);
        keywords.set_item("dtype", &dtype)?;
        if copy != Some(true)
            && let Some(view) = view_of(py, values)?
        {
            keywords.set_item("copy", copy)?;
            return py
                .import("numpy")?
                .call_method("array", (view,), Some(&keywords));
        }
        if copy == Some(false) {
            return Err(PyValueError::new_err(
                "expected copy=None or True, found False: only numbers of 64 or 32 bits in one chunk of which none is missing \
                 are an array without a copy; table.to_arrow() makes none",
            ));
        }
        let found = numbers_of(py, values)?;
        match dtype {
            Some(dtype) => found.call_method1("astype", (dtype,)),
            None => Ok(found),
        }
    }

    /// The column as an Arrow array, several chunks joined to one (Arrow PyCapsule interface).
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_array__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyCapsule>, Bound<'py, PyCapsule>)> {
        drop(requested_schema);
        let whole = self.own().series().rechunk().to_arrow(0, TYPES);
        let (schema, array) = (
            export_field_to_c(&field(self.own())),
            export_array_to_c(whole),
        );
        Ok((
            PyCapsule::new_with_value(py, schema, c"arrow_schema")?,
            PyCapsule::new_with_value(py, array, c"arrow_array")?,
        ))
    }
}

/// Imports the library to which a method hands over.
///
/// # Errors
/// The library is not installed.
fn library<'py>(py: Python<'py>, name: &str, caller: &str) -> PyResult<Bound<'py, PyModule>> {
    py.import(name).map_err(|cause| {
        if !cause.is_instance_of::<PyImportError>(py) {
            return cause;
        }
        let text = format!("expected {name} for {caller}, found none: pip install {name}");
        let error = of_kind(py, "package", &text);
        error.set_cause(py, Some(cause));
        error
    })
}

/// A text that HTML shows as it is.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
