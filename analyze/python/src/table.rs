//! Tables that Arrow readers take without a copy.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::mem;
use std::ops::Range;
use std::sync::Arc;

use anyhow::anyhow;
use arrow_array::ffi::{FFI_ArrowArray, FFI_ArrowSchema};
use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{
    Array, ArrayRef, RecordBatch, RecordBatchIterator, new_empty_array, new_null_array,
};
use arrow_ipc::reader::StreamReader;
use arrow_ipc::writer::StreamWriter;
use arrow_schema::{ArrowError, DataType, Field, Fields, Schema, SchemaRef};
use arrow_select::concat::concat;
use arrow_select::interleave::interleave_record_batch;
use pyo3::exceptions::{PyImportError, PyIndexError, PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule, PyDict, PyIterator, PyList, PySlice};
use tipwatch_analyze::base::scratch_file::ScratchFile;
use tipwatch_analyze::tables::table;

use crate::arrays::{array, numbers_of, object_of, text_of, view_of};
use crate::call::error::{Mistake, exception, of_kind};
use crate::call::pickle::{Reduced, reduced};

/// Rows and columns that a notebook shows.
const SHOWN_ROWS: usize = 20;
const SHOWN_COLUMNS: usize = 12;

/// Key of a field's metadata with the unit of its column.
const UNIT: &str = "unit";

/// A table: columns of equal length with names and units.
///
/// ``table["load_fl"]`` is one column, ``table[["time_ns", "load_fl"]]`` a table of two, ``table[:100]`` one of its first
/// rows; ``to_polars()``, ``to_arrow()`` and ``to_pandas()`` make the table of a library. polars, pyarrow and DuckDB take it
/// without copying, by the Arrow PyCapsule interface (``polars.DataFrame(table)``); pandas copies.
#[pyclass(frozen, module = "tipwatch")]
pub(crate) struct Table {
    schema: SchemaRef,
    batches: Vec<RecordBatch>,
}

impl Table {
    /// A table of one block.
    pub(crate) fn of(block: &table::Table) -> anyhow::Result<Self> {
        Ok(batch(block)?.into())
    }
}

impl From<RecordBatch> for Table {
    fn from(batch: RecordBatch) -> Self {
        Self {
            schema: batch.schema(),
            batches: vec![batch],
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
    columns: Option<Vec<String>>,
    /// The columns of the blocks.
    schema: Option<SchemaRef>,
    waiting: Waiting,
    /// Of each column, the pieces that are not joined yet.
    open: Vec<Vec<ArrayRef>>,
    open_rows: usize,
}

/// Parts of a table in a file, column by column.
#[derive(Default)]
struct Waiting {
    file: Option<ScratchFile>,
    length: u64,
    parts: Vec<Part>,
}

/// A part: its number of rows, and where its columns are; `None` for a column in which nothing is known.
struct Part {
    rows: usize,
    columns: Vec<Option<Range<u64>>>,
}

impl Chunks {
    /// No block yet. These columns of each are kept; all if `None`.
    pub(crate) fn of(columns: Option<Vec<String>>) -> Self {
        Self {
            columns,
            ..Self::default()
        }
    }

    /// Takes the next block, which has the columns of those before.
    ///
    /// # Errors
    /// It has other columns, or lacks one that is kept, or no temporary file can be written.
    pub(crate) fn take(&mut self, block: &table::Table) -> anyhow::Result<()> {
        let mut batch = batch(block)?;
        if let Some(columns) = &self.columns {
            let schema = batch.schema();
            let places = columns.iter().map(|name| place(&schema, name));
            let places = places.collect::<Result<Vec<_>, _>>();
            batch = batch.project(&places.map_err(Mistake)?)?;
        }
        let schema = self.schema.get_or_insert_with(|| batch.schema());
        if *schema != batch.schema() {
            anyhow::bail!("expected blocks with the same columns, found others");
        }
        self.open_rows += batch.num_rows();
        self.open.resize_with(batch.num_columns(), Vec::new);
        for (pieces, column) in self.open.iter_mut().zip(batch.columns()) {
            pieces.push(Arc::clone(column));
        }
        match self.open_rows >= ROWS_LAID_ASIDE {
            true => self.lay_aside(&batch.schema()),
            false => Ok(()),
        }
    }

    fn lay_aside(&mut self, schema: &Schema) -> anyhow::Result<()> {
        let (open, rows) = (mem::take(&mut self.open), mem::take(&mut self.open_rows));
        let columns = open.into_iter().zip(schema.fields());
        let columns = columns.map(|(pieces, field)| {
            let column = joined(&pieces)?;
            column
                .map(|column| self.waiting.append(field, column))
                .transpose()
        });
        let columns = columns.collect::<anyhow::Result<_>>()?;
        self.waiting.parts.push(Part { rows, columns });
        Ok(())
    }

    /// The table of all blocks; without a block it has no columns. What no longer needs its memory should have gone before.
    ///
    /// # Errors
    /// The temporary file cannot be read.
    pub(crate) fn finish(self) -> anyhow::Result<Table> {
        let schema = self.schema.unwrap_or_else(|| Arc::new(Schema::empty()));
        let mut batches = Vec::new();
        let (mut open, mut open_rows) = (self.open, self.open_rows);
        let parts = self.waiting.parts;
        let of_chunk = ROWS_OF_A_CHUNK / ROWS_LAID_ASIDE;
        let file = self.waiting.file;
        for parts in parts.chunks(of_chunk) {
            let is_last = parts.len() < of_chunk;
            let mut rows = parts.iter().map(|part| part.rows).sum::<usize>();
            let columns = (0..schema.fields().len()).map(|at| {
                let kind = schema.field(at).data_type();
                let pieces = parts
                    .iter()
                    .map(|part| part.column(at, kind, file.as_ref()));
                let mut pieces = pieces.collect::<anyhow::Result<Vec<_>>>()?;
                if is_last {
                    pieces.extend(open.get_mut(at).map(mem::take).into_iter().flatten());
                }
                Ok(joined(&pieces)?)
            });
            let columns = columns.collect::<anyhow::Result<Vec<_>>>()?;
            if is_last {
                rows += mem::take(&mut open_rows);
            }
            batches.push(chunk(&schema, rows, columns)?);
        }
        if open_rows > 0 {
            let columns = open.iter().map(|pieces| joined(pieces));
            batches.push(chunk(
                &schema,
                open_rows,
                columns.collect::<Result<_, _>>()?,
            )?);
        }
        Ok(Table { schema, batches })
    }
}

/// Pieces of a column as one; `None` if nothing is known in them.
fn joined(pieces: &[ArrayRef]) -> Result<Option<ArrayRef>, ArrowError> {
    if pieces.iter().all(|piece| piece.null_count() == piece.len()) {
        return Ok(None);
    }
    let pieces: Vec<&dyn Array> = pieces.iter().map(AsRef::as_ref).collect();
    concat(&pieces).map(Some)
}

impl Waiting {
    fn append(&mut self, column: &Field, values: ArrayRef) -> anyhow::Result<Range<u64>> {
        let schema = Arc::new(Schema::new(vec![column.clone()]));
        let written = Table::from(RecordBatch::try_new(schema, vec![values])?).written()?;
        let file = match &mut self.file {
            Some(file) => file,
            None => self.file.insert(ScratchFile::new()?),
        };
        file.append(&written)?;
        let from = self.length;
        self.length += written.len() as u64;
        Ok(from..self.length)
    }
}

impl Part {
    /// A column of this type again.
    fn column(
        &self,
        at: usize,
        kind: &DataType,
        file: Option<&ScratchFile>,
    ) -> anyhow::Result<ArrayRef> {
        let (Some(place), Some(file)) = (&self.columns[at], file) else {
            return Ok(new_null_array(kind, self.rows));
        };
        let mut bytes = vec![0; usize::try_from(place.end - place.start)?];
        file.read_at(&mut bytes, place.start)?;
        let table = Table::read(&bytes)?;
        let batch = table.batches.first();
        let batch = batch.ok_or_else(|| anyhow!("a temporary file is not as it was written"))?;
        Ok(Arc::clone(batch.column(0)))
    }
}

/// A chunk of these columns; those in which nothing is known are one in memory.
fn chunk(
    schema: &SchemaRef,
    rows: usize,
    columns: Vec<Option<ArrayRef>>,
) -> anyhow::Result<RecordBatch> {
    let mut unknown = HashMap::new();
    let columns = columns.into_iter().zip(schema.fields());
    let columns = columns.map(|(column, field)| {
        column.unwrap_or_else(|| {
            let kind = field.data_type();
            let nulls = unknown.entry(kind.clone());
            Arc::clone(nulls.or_insert_with(|| new_null_array(kind, rows)))
        })
    });
    Ok(RecordBatch::try_new(Arc::clone(schema), columns.collect())?)
}

/// A block as a record batch.
fn batch(block: &table::Table) -> anyhow::Result<RecordBatch> {
    let (mut fields, mut arrays) = (Vec::new(), Vec::new());
    for column in block.columns() {
        let unit = column.unit().map(|unit| (UNIT.to_owned(), unit.to_owned()));
        let array = array(column.series())?;
        let field = Field::new(column.name(), array.data_type().clone(), true);
        fields.push(field.with_metadata(unit.into_iter().collect::<HashMap<_, _>>()));
        arrays.push(array);
    }
    let schema = Schema::new(fields.into_iter().collect::<Fields>());
    Ok(RecordBatch::try_new(Arc::new(schema), arrays)?)
}

/// Wrong letters of a name that is still told from others, and how many of these are named.
const MOST_WRONG: usize = 2;
const MOST_NEAR: usize = 3;

/// Place of a column.
///
/// # Errors
/// There is none of this name.
fn place(schema: &Schema, name: &str) -> Result<usize, String> {
    let all = || schema.fields().iter().map(|field| field.name().as_str());
    schema.index_of(name).map_err(|_| no_column(all(), name))
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
        place(&self.schema, name).map_err(PyKeyError::new_err)
    }

    fn column(&self, name: &str) -> PyResult<Column> {
        let table = self.project(&[self.place(name)?])?;
        Ok(Column { table })
    }

    /// The table of some columns.
    ///
    /// # Errors
    /// There is no such column.
    fn project(&self, places: &[usize]) -> PyResult<Self> {
        let projected = || -> Result<Self, ArrowError> {
            let batches = self.batches.iter().map(|batch| batch.project(places));
            Ok(Self {
                schema: Arc::new(self.schema.project(places)?),
                batches: batches.collect::<Result<_, _>>()?,
            })
        };
        projected().map_err(|error| exception(&error.into()))
    }

    /// The table of so many rows from one on, without a copy.
    fn part(&self, start: usize, rows: usize) -> Self {
        let (mut skipped, mut left) = (start, rows);
        let batches = self.batches.iter().filter_map(|batch| {
            let from = skipped.min(batch.num_rows());
            let rows = left.min(batch.num_rows() - from);
            (skipped, left) = (skipped - from, left - rows);
            (rows > 0).then(|| batch.slice(from, rows))
        });
        Self {
            batches: batches.collect(),
            schema: Arc::clone(&self.schema),
        }
    }

    /// The table of some rows, in any order; without a copy where they follow each other.
    ///
    /// # Errors
    /// The slice is not one of whole numbers, or the rows do not fit into memory.
    fn rows(&self, slice: &Bound<'_, PySlice>) -> PyResult<Self> {
        let found = slice.indices(isize::try_from(self.__len__())?)?;
        if found.step == 1 || found.slicelength == 0 {
            return Ok(self.part(found.start.unsigned_abs(), found.slicelength));
        }
        let mut begins = vec![0];
        begins.extend(self.batches.iter().scan(0, |end, batch| {
            *end += batch.num_rows();
            Some(*end)
        }));
        let wanted = (0..found.slicelength).map(|at| {
            let row = (found.start + at as isize * found.step).unsigned_abs();
            let batch = begins.partition_point(|&begin| begin <= row) - 1;
            (batch, row - begins[batch])
        });
        let batches: Vec<&RecordBatch> = self.batches.iter().collect();
        let taken = interleave_record_batch(&batches, &wanted.collect::<Vec<_>>());
        let taken = taken.map_err(|error| exception(&error.into()))?;
        Ok(taken.into())
    }

    /// The table in the streaming format of Arrow.
    fn written(&self) -> Result<Vec<u8>, ArrowError> {
        let mut writer = StreamWriter::try_new(Vec::new(), &self.schema)?;
        for batch in &self.batches {
            writer.write(batch)?;
        }
        writer.into_inner()
    }

    fn read(bytes: &[u8]) -> Result<Self, ArrowError> {
        let reader = StreamReader::try_new(bytes, None)?;
        Ok(Self {
            schema: reader.schema(),
            batches: reader.collect::<Result<_, _>>()?,
        })
    }
}

#[pymethods]
impl Table {
    /// Names of the columns.
    #[getter]
    fn columns(&self) -> Vec<&str> {
        let fields = self.schema.fields().iter();
        fields.map(|field| field.name().as_str()).collect()
    }

    /// Units of the columns that have one, by name.
    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let units = PyDict::new(py);
        for field in self.schema.fields() {
            if let Some(unit) = field.metadata().get(UNIT) {
                units.set_item(field.name(), unit)?;
            }
        }
        Ok(units)
    }

    pub(crate) fn __len__(&self) -> usize {
        self.batches.iter().map(RecordBatch::num_rows).sum()
    }

    /// A column by its name, a table of some columns by a list of names, or one of some rows by a slice.
    fn __getitem__<'py>(&self, key: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let py = key.py();
        if let Ok(slice) = key.cast::<PySlice>() {
            return Ok(Bound::new(py, self.rows(slice)?)?.into_any());
        }
        if let Ok(name) = key.extract::<String>() {
            return Ok(Bound::new(py, self.column(&name)?)?.into_any());
        }
        let Ok(names) = key.extract::<Vec<String>>() else {
            return Err(PyTypeError::new_err(format!(
                "expected the name of a column, a list of names or a slice of rows, found {}; table[name][row] is one value",
                key.get_type().name()?
            )));
        };
        let places = names.iter().map(|name| self.place(name));
        let table = self.project(&places.collect::<PyResult<Vec<_>>>()?)?;
        Ok(Bound::new(py, table)?.into_any())
    }

    /// Whether there is a column of this name.
    fn __contains__(&self, name: &str) -> bool {
        self.schema.index_of(name).is_ok()
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

    /// As ``polars.DataFrame``, without a copy.
    fn to_polars<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        library(slf.py(), "polars", "Table.to_polars")?.call_method1("DataFrame", (slf,))
    }

    /// As ``pyarrow.Table``, without a copy.
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
        let bytes = this.get().written();
        let bytes = bytes.map_err(|error| exception(&error.into()))?;
        reduced(this, (PyBytes::new(this.py(), &bytes),))
    }

    #[staticmethod]
    fn _of_parts(bytes: &[u8]) -> PyResult<Self> {
        Self::read(bytes).map_err(|error| exception(&error.into()))
    }

    fn __repr__(&self) -> String {
        format!(
            "<tipwatch.Table of {} rows and {} columns>",
            self.__len__(),
            self.schema.fields().len()
        )
    }

    /// The table in a notebook: its first rows with names and units.
    pub(crate) fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        let fields = self.schema.fields();
        let shown = fields.len().min(SHOWN_COLUMNS);
        let has_more = |tag: &str| match shown < fields.len() {
            true => format!("<{tag}>…</{tag}>"),
            false => String::new(),
        };
        let mut html = String::from("<table><thead><tr>");
        for field in &fields[..shown] {
            let unit = field.metadata().get(UNIT);
            let unit = unit.map_or(String::new(), |unit| format!("<br>[{}]", escaped(unit)));
            // writing to a text does not fail
            let _ = write!(html, "<th>{}{unit}</th>", escaped(field.name()));
        }
        let _ = write!(html, "{}</tr></thead><tbody>", has_more("th"));
        for batch in self.part(0, SHOWN_ROWS).batches {
            for row in 0..batch.num_rows() {
                html.push_str("<tr>");
                for column in &batch.columns()[..shown] {
                    let text = escaped(&text_of(py, column, row)?);
                    let _ = write!(html, "<td>{text}</td>");
                }
                let _ = write!(html, "{}</tr>", has_more("td"));
            }
        }
        let (rows, columns) = (self.__len__(), fields.len());
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
        let batches = self.batches.clone().into_iter().map(Ok);
        let reader = RecordBatchIterator::new(batches, Arc::clone(&self.schema));
        let stream = FFI_ArrowArrayStream::new(Box::new(reader));
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
pub(crate) struct Column {
    table: Table,
}

#[pymethods]
impl Column {
    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        self.table.schema.field(0).name()
    }

    /// Its unit; None for what has none.
    #[getter]
    fn unit(&self) -> Option<&str> {
        let unit = self.table.schema.field(0).metadata().get(UNIT);
        unit.map(String::as_str)
    }

    fn __len__(&self) -> usize {
        self.table.__len__()
    }

    /// A value by its row, counted from the end if negative, or a part of the column by a slice.
    fn __getitem__<'py>(&self, key: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let py = key.py();
        if let Ok(slice) = key.cast::<PySlice>() {
            let table = self.table.rows(slice)?;
            return Ok(Bound::new(py, Self { table })?.into_any());
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
        let mut left = from_start;
        for batch in &self.table.batches {
            match left.checked_sub(batch.num_rows()) {
                Some(behind) => left = behind,
                None => return object_of(py, batch.column(0), left),
            }
        }
        Err(PyIndexError::new_err(format!(
            "expected a row below {length}, found {row}"
        )))
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
        let table = Table {
            schema: Arc::clone(&own.table.schema),
            batches: own.table.batches.clone(),
        };
        Ok((getitem, (table, own.name().to_owned())))
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
        let columns = self.table.batches.iter().map(|batch| batch.column(0));
        let values =
            columns.flat_map(|column| (0..column.len()).map(move |row| object_of(py, column, row)));
        values.collect()
    }

    /// The column in a notebook: its first values.
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        self.table._repr_html_(py)
    }

    /// The column as an array of NumPy; None is NaN. Read-only where it is not a copy.
    #[pyo3(signature = (dtype=None, copy=None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let columns = self.table.batches.iter().map(|batch| batch.column(0));
        let columns: Vec<_> = columns.collect();
        let keywords = PyDict::new(py);
        keywords.set_item("dtype", &dtype)?;
        if copy != Some(true)
            && let Some(view) = view_of(py, &columns)?
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
        let found = numbers_of(py, &columns)?;
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
        let field = self.table.schema.field(0);
        let columns = self.table.batches.iter().map(|batch| &**batch.column(0));
        let made = || -> Result<_, ArrowError> {
            let whole = match &columns.collect::<Vec<_>>()[..] {
                [] => new_empty_array(field.data_type()),
                [one] => one.slice(0, one.len()),
                several => concat(several)?,
            };
            let schema = FFI_ArrowSchema::try_from(field)?;
            Ok((schema, FFI_ArrowArray::new(&whole.to_data())))
        };
        let (schema, array) = made().map_err(|error| exception(&error.into()))?;
        Ok((
            PyCapsule::new_with_value(py, schema, c"arrow_schema")?,
            PyCapsule::new_with_value(py, array, c"arrow_array")?,
        ))
    }
}

/// A library that a method hands over to.
///
/// # Errors
/// It is not installed.
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
