//! Tables that Arrow readers take without a copy.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{RecordBatch, RecordBatchIterator};
use arrow_schema::{Field, Fields, Schema, SchemaRef};
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict};
use tipwatch_analyze::tables::table;

use crate::arrays::array;

/// Key of a field's metadata with the unit of its column.
const UNIT: &str = "unit";

/// A table: columns of equal length with names and units.
///
/// polars, pyarrow, pandas and DuckDB take it without copying, by the Arrow PyCapsule interface:
/// ``polars.DataFrame(table)``, ``pyarrow.table(table)``.
#[pyclass(frozen, module = "tipwatch")]
pub(crate) struct Table {
    schema: SchemaRef,
    batches: Vec<RecordBatch>,
}

impl Table {
    /// A table of these blocks, which have the same columns.
    pub(crate) fn of(blocks: Vec<table::Table>) -> anyhow::Result<Self> {
        let batches: anyhow::Result<Vec<RecordBatch>> = blocks.into_iter().map(batch).collect();
        let batches = batches?;
        let schema = batches
            .first()
            .map_or_else(|| Arc::new(Schema::empty()), RecordBatch::schema);
        Ok(Self { schema, batches })
    }
}

/// A block as a record batch, which takes over the memory of its numbers.
fn batch(block: table::Table) -> anyhow::Result<RecordBatch> {
    let (mut fields, mut arrays) = (Vec::new(), Vec::new());
    for column in block.into_columns() {
        let unit = column.unit().map(|unit| (UNIT.to_owned(), unit.to_owned()));
        let name = column.name().to_owned();
        let array = array(column.into_values());
        let field = Field::new(name, array.data_type().clone(), true);
        fields.push(field.with_metadata(unit.into_iter().collect::<HashMap<_, _>>()));
        arrays.push(array);
    }
    let schema = Schema::new(fields.into_iter().collect::<Fields>());
    Ok(RecordBatch::try_new(Arc::new(schema), arrays)?)
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

    fn __len__(&self) -> usize {
        self.batches.iter().map(RecordBatch::num_rows).sum()
    }

    fn __repr__(&self) -> String {
        format!(
            "<tipwatch.Table of {} rows and {} columns>",
            self.__len__(),
            self.schema.fields().len()
        )
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
