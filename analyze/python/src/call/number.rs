//! Numbers of a call, within their ranges.

use std::ops::RangeInclusive;

use anyhow::{Result, bail};
use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;

use super::error::Mistake;

/// A whole number of a caller, however large: one out of its range is a wrong value, and no overflow.
pub(crate) struct Whole {
    /// The number, limited to the range of its type.
    number: i64,
    text: String,
}

impl<'py> FromPyObject<'_, 'py> for Whole {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let number = match given.extract::<i64>() {
            Ok(number) => number,
            Err(error) if error.is_instance_of::<PyOverflowError>(given.py()) => {
                match given.lt(0)? {
                    true => i64::MIN,
                    false => i64::MAX,
                }
            }
            Err(error) => return Err(error),
        };
        Ok(Self {
            number,
            text: given.str()?.to_string(),
        })
    }
}

impl Whole {
    /// Returns the number, which is called `name` in the error.
    ///
    /// # Errors
    /// The number is not within the range.
    pub(crate) fn within(&self, name: &str, range: RangeInclusive<u32>) -> Result<u32> {
        let number = u32::try_from(self.number).ok();
        if let Some(number) = number.filter(|number| range.contains(number)) {
            return Ok(number);
        }
        let (least, most, found) = (range.start(), range.end(), &self.text);
        match *most {
            u32::MAX => bail!(Mistake(format!(
                "expected {name} of at least {least}, found {found}"
            ))),
            _ => bail!(Mistake(format!(
                "expected {name} from {least} to {most}, found {found}"
            ))),
        }
    }
}

/// Checks a number that is called `name` in the error, with its unit in brackets.
///
/// # Errors
/// The number is not positive, or not finite.
pub(crate) fn positive(name: &str, number: f64) -> Result<f64> {
    match number.is_finite() && number > 0.0 {
        true => Ok(number),
        false => bail!(Mistake(format!(
            "expected a positive {name}, found {number}"
        ))),
    }
}
