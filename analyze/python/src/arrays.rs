//! The values of a column as an Arrow array.

use std::sync::Arc;

use arrow_array::builder::{Float64Builder, ListBuilder, StringBuilder};
use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, Float64Type, Int32Type, Int64Type, UInt32Type, UInt64Type};
use arrow_array::{Array, ArrayRef, ArrowPrimitiveType, BooleanArray, PrimitiveArray, StringArray};
use arrow_schema::{DataType, Field};
use numpy::IntoPyArray;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use tipwatch_analyze::tables::series::{Known, Series};
use tipwatch_analyze::tables::values::Values;

/// The values of a column; numbers of which none is missing keep their memory.
pub(crate) fn array(values: Values) -> ArrayRef {
    match values {
        Values::Boolean(known) => Arc::new(BooleanArray::from_iter(known.rows())),
        Values::Single(known) => numbers::<Float32Type>(known),
        Values::Double(known) => numbers::<Float64Type>(known),
        Values::Int32(known) => numbers::<Int32Type>(known),
        Values::Int64(known) => numbers::<Int64Type>(known),
        Values::UInt32(known) => numbers::<UInt32Type>(known),
        Values::UInt64(known) => numbers::<UInt64Type>(known),
        Values::Text(known) => Arc::new(StringArray::from_iter(known.rows())),
        Values::Numbers(lists) => {
            let element = Field::new(ELEMENT, DataType::Float64, true);
            let mut builder = ListBuilder::new(Float64Builder::new()).with_field(element);
            lists.rows().for_each(|row| builder.append_option(row));
            Arc::new(builder.finish())
        }
        Values::Texts(lists) => {
            let element = Field::new(ELEMENT, DataType::Utf8, true);
            let mut builder = ListBuilder::new(StringBuilder::new()).with_field(element);
            lists.rows().for_each(|row| builder.append_option(row));
            Arc::new(builder.finish())
        }
    }
}

/// Name of the elements of a list, as in the files.
const ELEMENT: &str = "element";

fn numbers<T: ArrowPrimitiveType>(known: Known<Vec<T::Native>>) -> ArrayRef
where
    Vec<T::Native>: for<'a> Series<Item<'a> = T::Native>,
{
    match known.into_all() {
        Ok(values) => Arc::new(PrimitiveArray::<T>::new(values.into(), None)),
        Err(known) => Arc::new(PrimitiveArray::<T>::from_iter(known.rows())),
    }
}

/// The numbers of a column in pieces as an array of NumPy: of 64 bits, whole where none is missing; what is missing is NaN.
///
/// # Errors
/// It has no numbers.
pub(crate) fn numbers_of<'py>(
    py: Python<'py>,
    pieces: &[&ArrayRef],
) -> PyResult<Bound<'py, PyAny>> {
    fn all<T: ArrowPrimitiveType, R>(
        pieces: &[&ArrayRef],
        number: impl Fn(T::Native) -> R,
        missing: R,
    ) -> Vec<R>
    where
        R: Copy,
    {
        let pieces = pieces.iter().map(|piece| piece.as_primitive::<T>());
        let numbers = pieces.flat_map(|piece| piece.iter().collect::<Vec<_>>());
        numbers
            .map(|value| value.map_or(missing, &number))
            .collect()
    }
    let of = pieces.first().map(Array::data_type);
    let has_missing = pieces.iter().any(|piece| piece.null_count() > 0);
    let nan = f64::NAN;
    Ok(match of {
        None | Some(DataType::Float64) => all::<Float64Type, f64>(pieces, |x| x, nan)
            .into_pyarray(py)
            .into_any(),
        Some(DataType::Float32) => all::<Float32Type, f32>(pieces, |x| x, f32::NAN)
            .into_pyarray(py)
            .into_any(),
        Some(DataType::Int64) if has_missing => all::<Int64Type, f64>(pieces, |x| x as f64, nan)
            .into_pyarray(py)
            .into_any(),
        Some(DataType::Int64) => all::<Int64Type, i64>(pieces, |x| x, 0)
            .into_pyarray(py)
            .into_any(),
        Some(DataType::Int32) => all::<Int32Type, f64>(pieces, f64::from, nan)
            .into_pyarray(py)
            .into_any(),
        Some(DataType::UInt32) => all::<UInt32Type, f64>(pieces, f64::from, nan)
            .into_pyarray(py)
            .into_any(),
        Some(DataType::UInt64) => all::<UInt64Type, f64>(pieces, |x| x as f64, nan)
            .into_pyarray(py)
            .into_any(),
        Some(DataType::Boolean) if !has_missing => pieces
            .iter()
            .flat_map(|piece| piece.as_boolean().iter().flatten().collect::<Vec<_>>())
            .collect::<Vec<bool>>()
            .into_pyarray(py)
            .into_any(),
        Some(other) => {
            return Err(PyTypeError::new_err(format!(
                "expected a column of numbers, found one of {other}; to_list(), to_polars() and to_arrow() take all types"
            )));
        }
    })
}

/// A value as an object of Python; None for what is missing.
///
/// # Errors
/// An object cannot be made.
pub(crate) fn object_of<'py>(
    py: Python<'py>,
    column: &ArrayRef,
    row: usize,
) -> PyResult<Bound<'py, PyAny>> {
    if column.is_null(row) {
        return Ok(py.None().into_bound(py));
    }
    match column.data_type() {
        DataType::Float64 => column
            .as_primitive::<Float64Type>()
            .value(row)
            .into_bound_py_any(py),
        DataType::Float32 => column
            .as_primitive::<Float32Type>()
            .value(row)
            .into_bound_py_any(py),
        DataType::Int64 => column
            .as_primitive::<Int64Type>()
            .value(row)
            .into_bound_py_any(py),
        DataType::Int32 => column
            .as_primitive::<Int32Type>()
            .value(row)
            .into_bound_py_any(py),
        DataType::UInt32 => column
            .as_primitive::<UInt32Type>()
            .value(row)
            .into_bound_py_any(py),
        DataType::UInt64 => column
            .as_primitive::<UInt64Type>()
            .value(row)
            .into_bound_py_any(py),
        DataType::Boolean => column.as_boolean().value(row).into_bound_py_any(py),
        DataType::Utf8 => column.as_string::<i32>().value(row).into_bound_py_any(py),
        DataType::List(_) => {
            let list = column.as_list::<i32>().value(row);
            let values = (0..list.len()).map(|at| object_of(py, &list, at));
            values.collect::<PyResult<Vec<_>>>()?.into_bound_py_any(py)
        }
        other => Err(PyTypeError::new_err(format!(
            "expected a column of numbers or texts, found one of {other}"
        ))),
    }
}

/// A value as text.
pub(crate) fn text_of(column: &ArrayRef, row: usize) -> String {
    if column.is_null(row) {
        return "null".into();
    }
    match column.data_type() {
        DataType::Float64 => column.as_primitive::<Float64Type>().value(row).to_string(),
        DataType::Float32 => column.as_primitive::<Float32Type>().value(row).to_string(),
        DataType::Int64 => column.as_primitive::<Int64Type>().value(row).to_string(),
        DataType::Int32 => column.as_primitive::<Int32Type>().value(row).to_string(),
        DataType::UInt32 => column.as_primitive::<UInt32Type>().value(row).to_string(),
        DataType::UInt64 => column.as_primitive::<UInt64Type>().value(row).to_string(),
        DataType::Boolean => column.as_boolean().value(row).to_string(),
        DataType::Utf8 => column.as_string::<i32>().value(row).to_owned(),
        DataType::List(_) => {
            let list = column.as_list::<i32>().value(row);
            let values: Vec<String> = (0..list.len()).map(|at| text_of(&list, at)).collect();
            format!("[{}]", values.join(", "))
        }
        other => format!("({other})"),
    }
}
