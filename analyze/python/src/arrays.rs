//! The values of a column as objects of Python and arrays of NumPy.

use numpy::IntoPyArray;
use polars::prelude::{AnyValue, DataType, Series, TimeUnit};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tipwatch_analyze::base::number::short;

use crate::call::error::of_polars;

/// Returns the type of NumPy with the same times; `None` for a type without times.
fn dtype_of_times(kind: &DataType) -> Option<String> {
    let unit = |unit: &TimeUnit| match unit {
        TimeUnit::Milliseconds => "ms",
        TimeUnit::Microseconds => "us",
        TimeUnit::Nanoseconds => "ns",
    };
    match kind {
        DataType::Date => Some("datetime64[D]".into()),
        DataType::Datetime(parts, _) => Some(format!("datetime64[{}]", unit(parts))),
        DataType::Duration(parts) => Some(format!("timedelta64[{}]", unit(parts))),
        _ => None,
    }
}

/// Returns times as an array of NumPy; missing ones are NaT (not a time).
fn times_of<'py>(py: Python<'py>, values: &Series, dtype: &str) -> PyResult<Bound<'py, PyAny>> {
    let counts = values.to_physical_repr().cast(&DataType::Int64);
    let counts = counts.map_err(of_polars)?;
    let counts = counts.i64().map_err(of_polars)?.iter();
    let counts: Vec<i64> = counts.map(|count| count.unwrap_or(i64::MIN)).collect();
    counts.into_pyarray(py).call_method1("view", (dtype,))
}

/// Memory of a column that NumPy reads in place, by its array interface.
#[pyclass(frozen)]
struct Memory {
    kind: &'static str,
    address: usize,
    /// Keeps the memory.
    values: Series,
}

#[pymethods]
impl Memory {
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let order = if cfg!(target_endian = "little") {
            '<'
        } else {
            '>'
        };
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("typestr", format!("{order}{}", self.kind))?;
        interface.set_item("shape", (self.values.len(),))?;
        // read only: others have the same memory
        interface.set_item("data", (self.address, true))?;
        Ok(interface)
    }
}

/// Returns a NumPy array that shares the memory of a column: numbers in one piece, none of which is missing. `None` for other
/// columns, which must be copied.
pub(crate) fn view_of<'py>(
    py: Python<'py>,
    values: &Series,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    fn address<T>(numbers: &[T]) -> usize {
        numbers.as_ptr() as usize
    }
    if values.null_count() > 0 {
        return Ok(None);
    }
    let (f32, f64, i64) = (values.f32().ok(), values.f64().ok(), values.i64().ok());
    let f32 = f32.and_then(|numbers| Some(("f4", address(numbers.cont_slice().ok()?))));
    let f64 = f64.and_then(|numbers| Some(("f8", address(numbers.cont_slice().ok()?))));
    let i64 = i64.and_then(|numbers| Some(("i8", address(numbers.cont_slice().ok()?))));
    let Some((kind, address)) = f32.or(f64).or(i64) else {
        return Ok(None);
    };
    let values = values.clone();
    let memory = Memory {
        kind,
        address,
        values,
    };
    Ok(Some(Bound::new(py, memory)?.into_any()))
}

/// Returns the numbers of a column as an array of NumPy: of 64 bits, integers where the column has them and none is missing;
/// missing values are NaN.
///
/// # Errors
/// The column has no numbers.
pub(crate) fn numbers_of<'py>(py: Python<'py>, values: &Series) -> PyResult<Bound<'py, PyAny>> {
    if let Some(dtype) = dtype_of_times(values.dtype()) {
        return times_of(py, values, &dtype);
    }
    let has_missing = values.null_count() > 0;
    Ok(match values.dtype() {
        DataType::Float32 => {
            let numbers = values.f32().map_err(of_polars)?.iter();
            let numbers = numbers.map(|number| number.unwrap_or(f32::NAN));
            numbers.collect::<Vec<_>>().into_pyarray(py).into_any()
        }
        DataType::Int64 if !has_missing => {
            let numbers = values.i64().map_err(of_polars)?.iter().flatten();
            numbers.collect::<Vec<_>>().into_pyarray(py).into_any()
        }
        DataType::Boolean if !has_missing => {
            let values = values.bool().map_err(of_polars)?.iter().flatten();
            values.collect::<Vec<_>>().into_pyarray(py).into_any()
        }
        kind if kind.is_primitive_numeric() => {
            let numbers = values.cast(&DataType::Float64).map_err(of_polars)?;
            let numbers = numbers.f64().map_err(of_polars)?.iter();
            let numbers = numbers.map(|number| number.unwrap_or(f64::NAN));
            numbers.collect::<Vec<_>>().into_pyarray(py).into_any()
        }
        other => {
            return Err(PyTypeError::new_err(format!(
                "expected a column of numbers, found one of {other}; to_list(), to_polars() and to_arrow() take all types"
            )));
        }
    })
}

/// Returns a value as an object of Python; None for a missing one.
///
/// # Errors
/// An object cannot be made.
pub(crate) fn object_of<'py>(
    py: Python<'py>,
    values: &Series,
    row: usize,
) -> PyResult<Bound<'py, PyAny>> {
    match values.get(row).map_err(of_polars)? {
        AnyValue::Null => Ok(py.None().into_bound(py)),
        AnyValue::Float64(value) => value.into_bound_py_any(py),
        AnyValue::Float32(value) => value.into_bound_py_any(py),
        AnyValue::Int64(value) => value.into_bound_py_any(py),
        AnyValue::Int32(value) => value.into_bound_py_any(py),
        AnyValue::UInt32(value) => value.into_bound_py_any(py),
        AnyValue::UInt64(value) => value.into_bound_py_any(py),
        AnyValue::Boolean(value) => value.into_bound_py_any(py),
        AnyValue::String(value) => value.into_bound_py_any(py),
        AnyValue::List(list) => {
            let values = (0..list.len()).map(|at| object_of(py, &list, at));
            values.collect::<PyResult<Vec<_>>>()?.into_bound_py_any(py)
        }
        other => match dtype_of_times(values.dtype()) {
            Some(dtype) => {
                let time = values.slice(i64::try_from(row)?, 1);
                times_of(py, &time, &dtype)?
                    .get_item(0)?
                    .call_method0("item")
            }
            None => Err(PyTypeError::new_err(format!(
                "expected a column of numbers or texts, found one of {}",
                other.dtype()
            ))),
        },
    }
}

/// A value as text, numbers with as many digits as a reader can use.
///
/// # Errors
/// An object cannot be made of it.
pub(crate) fn text_of(py: Python<'_>, values: &Series, row: usize) -> PyResult<String> {
    Ok(match values.get(row).map_err(of_polars)? {
        AnyValue::Null => "null".into(),
        AnyValue::Float64(value) => short(value),
        AnyValue::Float32(value) => short(value.into()),
        AnyValue::Boolean(value) => value.to_string(),
        AnyValue::List(list) => {
            let values = (0..list.len()).map(|at| text_of(py, &list, at));
            format!("[{}]", values.collect::<PyResult<Vec<_>>>()?.join(", "))
        }
        _ => object_of(py, values, row)?.str()?.to_string(),
    })
}
