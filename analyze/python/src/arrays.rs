//! The values of a column as an Arrow array.

use std::sync::Arc;

use arrow_array::builder::{Float64Builder, ListBuilder, StringBuilder};
use arrow_array::cast::AsArray;
use arrow_array::types::{
    Date32Type, DurationMicrosecondType, DurationMillisecondType, DurationNanosecondType,
    Float32Type, Float64Type, Int32Type, Int64Type, TimestampMicrosecondType,
    TimestampMillisecondType, TimestampNanosecondType, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef, ArrowPrimitiveType, BooleanArray, PrimitiveArray, StringArray};
use arrow_schema::{DataType, Field};
use numpy::IntoPyArray;
use polars::prelude::{
    ChunkedArray, DataType as PolarsType, PolarsNumericType, PolarsResult, Series, TimeUnit,
};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tipwatch_analyze::base::number::short;

/// The values of a column.
///
/// # Errors
/// There are none of such a type in tables.
pub(crate) fn array(values: &Series) -> PolarsResult<ArrayRef> {
    use TimeUnit::{Microseconds, Milliseconds, Nanoseconds};
    Ok(match values.dtype() {
        PolarsType::Boolean => Arc::new(BooleanArray::from_iter(values.bool()?.iter())),
        PolarsType::Float32 => numbers::<Float32Type, _>(values.f32()?),
        PolarsType::Float64 => numbers::<Float64Type, _>(values.f64()?),
        PolarsType::Int64 => numbers::<Int64Type, _>(values.i64()?),
        PolarsType::UInt32 => numbers::<UInt32Type, _>(values.u32()?),
        PolarsType::UInt64 => numbers::<UInt64Type, _>(values.u64()?),
        PolarsType::Date => numbers::<Date32Type, _>(values.date()?.physical()),
        PolarsType::Datetime(unit, _) => {
            let counts = values.datetime()?.physical();
            match unit {
                Milliseconds => numbers::<TimestampMillisecondType, _>(counts),
                Microseconds => numbers::<TimestampMicrosecondType, _>(counts),
                Nanoseconds => numbers::<TimestampNanosecondType, _>(counts),
            }
        }
        PolarsType::Duration(unit) => {
            let counts = values.duration()?.physical();
            match unit {
                Milliseconds => numbers::<DurationMillisecondType, _>(counts),
                Microseconds => numbers::<DurationMicrosecondType, _>(counts),
                Nanoseconds => numbers::<DurationNanosecondType, _>(counts),
            }
        }
        PolarsType::List(of) if **of == PolarsType::Float64 => {
            let element = Field::new(ELEMENT, DataType::Float64, true);
            let mut builder = ListBuilder::new(Float64Builder::new()).with_field(element);
            for list in values.list()?.amortized_iter() {
                match list {
                    Some(list) => builder.append_value(list.as_ref().f64()?.iter()),
                    None => builder.append_null(),
                }
            }
            Arc::new(builder.finish())
        }
        PolarsType::List(_) => {
            let element = Field::new(ELEMENT, DataType::Utf8, true);
            let mut builder = ListBuilder::new(StringBuilder::new()).with_field(element);
            for list in values.list()?.amortized_iter() {
                match list {
                    Some(list) => builder.append_value(list.as_ref().str()?.iter()),
                    None => builder.append_null(),
                }
            }
            Arc::new(builder.finish())
        }
        _ => Arc::new(StringArray::from_iter(values.str()?.iter())),
    })
}

fn numbers<A, P>(values: &ChunkedArray<P>) -> ArrayRef
where
    A: ArrowPrimitiveType,
    P: PolarsNumericType<Native = A::Native>,
{
    match values.has_nulls() {
        true => Arc::new(PrimitiveArray::<A>::from_iter(values.iter())),
        false => Arc::new(PrimitiveArray::<A>::from_iter_values(
            values.iter().flatten(),
        )),
    }
}

/// The type of NumPy with the same times; `None` for what is none.
fn dtype_of_times(kind: &DataType) -> Option<String> {
    let unit = |unit: &arrow_schema::TimeUnit| match unit {
        arrow_schema::TimeUnit::Second => "s",
        arrow_schema::TimeUnit::Millisecond => "ms",
        arrow_schema::TimeUnit::Microsecond => "us",
        arrow_schema::TimeUnit::Nanosecond => "ns",
    };
    match kind {
        DataType::Date32 => Some("datetime64[D]".into()),
        DataType::Timestamp(parts, _) => Some(format!("datetime64[{}]", unit(parts))),
        DataType::Duration(parts) => Some(format!("timedelta64[{}]", unit(parts))),
        _ => None,
    }
}

/// The times of a column as whole numbers; what is missing is the number that NumPy takes for it.
fn counts(column: &ArrayRef) -> Vec<i64> {
    let data = column.to_data();
    let rows = (0..data.len()).map(|row| match data.data_type() {
        _ if data.is_null(row) => i64::MIN,
        DataType::Date32 => i64::from(data.buffer::<i32>(0)[row]),
        _ => data.buffer::<i64>(0)[row],
    });
    rows.collect()
}

/// Memory of a column that NumPy reads in place, by its array interface.
#[pyclass(frozen)]
struct Memory(ArrayRef);

#[pymethods]
impl Memory {
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (kind, address) = match self.0.data_type() {
            DataType::Float32 => ("f4", of_type::<Float32Type>(&self.0)),
            DataType::Float64 => ("f8", of_type::<Float64Type>(&self.0)),
            _ => ("i8", of_type::<Int64Type>(&self.0)),
        };
        let order = if cfg!(target_endian = "little") {
            '<'
        } else {
            '>'
        };
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("typestr", format!("{order}{kind}"))?;
        interface.set_item("shape", (self.0.len(),))?;
        // read only: others have the same memory
        interface.set_item("data", (address, true))?;
        Ok(interface)
    }
}

/// Address of the first number.
fn of_type<T: ArrowPrimitiveType>(array: &ArrayRef) -> usize {
    array.as_primitive::<T>().values().as_ptr() as usize
}

/// What NumPy makes an array of without a copy: numbers in one piece, none of which is missing. Others it must have copied.
pub(crate) fn view_of<'py>(
    py: Python<'py>,
    pieces: &[&ArrayRef],
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let same = [DataType::Float32, DataType::Float64, DataType::Int64];
    match pieces {
        [one] if one.null_count() == 0 && same.contains(one.data_type()) => {
            let memory = Bound::new(py, Memory(Arc::clone(one)))?.into_any();
            Ok(Some(memory))
        }
        _ => Ok(None),
    }
}

/// Name of the elements of a list, as in the files.
const ELEMENT: &str = "element";

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
    if let Some(dtype) = of.and_then(dtype_of_times) {
        let counts: Vec<i64> = pieces.iter().copied().flat_map(counts).collect();
        return counts.into_pyarray(py).call_method1("view", (dtype,));
    }
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
    if let Some(dtype) = dtype_of_times(column.data_type()) {
        let count = counts(&column.slice(row, 1)).into_pyarray(py);
        let time = count.call_method1("view", (dtype,))?;
        return time.get_item(0)?.call_method0("item");
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

/// A value as text, numbers with as many digits as a reader can use.
///
/// # Errors
/// An object cannot be made of it.
pub(crate) fn text_of(py: Python<'_>, column: &ArrayRef, row: usize) -> PyResult<String> {
    if column.is_null(row) {
        return Ok("null".into());
    }
    Ok(match column.data_type() {
        DataType::Float64 => short(column.as_primitive::<Float64Type>().value(row)),
        DataType::Float32 => short(column.as_primitive::<Float32Type>().value(row).into()),
        DataType::Boolean => column.as_boolean().value(row).to_string(),
        DataType::List(_) => {
            let list = column.as_list::<i32>().value(row);
            let values = (0..list.len()).map(|at| text_of(py, &list, at));
            format!("[{}]", values.collect::<PyResult<Vec<_>>>()?.join(", "))
        }
        _ => object_of(py, column, row)?.str()?.to_string(),
    })
}
