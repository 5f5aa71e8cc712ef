//! Results that travel between processes.

use pyo3::PyClass;
use pyo3::prelude::*;

/// Parts of an object that pickle stores: the function that rebuilds the object, and its arguments.
pub(crate) type Reduced<'py, P> = PyResult<(Bound<'py, PyAny>, P)>;

/// An object that its class makes again of these parts, by the static method `_of_parts`.
pub(crate) fn reduced<'py, T: PyClass, P>(this: &Bound<'py, T>, parts: P) -> Reduced<'py, P> {
    Ok((this.as_any().get_type().getattr("_of_parts")?, parts))
}
