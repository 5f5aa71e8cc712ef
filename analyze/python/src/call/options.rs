//! Options of analyses, by the names that they have on the command line.

use anyhow::{Result, anyhow, bail};
use clap::ValueEnum;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use tipwatch_analyze::base::options::{HIGHEST_RATE_HZ, Options, ReportLanguage};

use super::error::Mistake;
use super::number::positive;

/// Options of an analysis that a caller states; absent ones have the values of the command line.
#[derive(Default)]
pub(crate) struct Stated {
    pub(crate) rate: Option<f64>,
    pub(crate) start: Option<f64>,
    pub(crate) end: Option<f64>,
    pub(crate) estimator: Option<String>,
    pub(crate) model: Option<String>,
    pub(crate) closed_form_input: Option<String>,
    pub(crate) apply_clock_offsets: Option<String>,
    pub(crate) quasi_static: Option<String>,
}

impl Stated {
    /// The options of a fleet as keywords of `FleetTask`, for workers.
    pub(crate) fn keywords<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let keywords = PyDict::new(py);
        keywords.set_item("rate", self.rate)?;
        keywords.set_item("estimator", &self.estimator)?;
        keywords.set_item("model", &self.model)?;
        keywords.set_item("closed_form_input", &self.closed_form_input)?;
        keywords.set_item("apply_clock_offsets", &self.apply_clock_offsets)?;
        keywords.set_item("quasi_static", &self.quasi_static)?;
        Ok(keywords)
    }

    /// The options.
    ///
    /// # Errors
    /// A name is unknown, or a number is impossible.
    pub(crate) fn options(&self) -> Result<Options> {
        if let Some(rate) = self.rate
            && positive("rate (Hz)", rate)? > HIGHEST_RATE_HZ
        {
            bail!(Mistake(format!(
                "expected a rate of at most {HIGHEST_RATE_HZ} Hz, found {rate}"
            )));
        }
        for (name, time) in [("start", self.start), ("end", self.end)] {
            if let Some(time) = time
                && !time.is_finite()
            {
                bail!(Mistake(format!(
                    "expected a finite {name} (s), found {time}"
                )));
            }
        }
        if let (Some(start), Some(end)) = (self.start, self.end)
            && start >= end
        {
            bail!(Mistake(format!(
                "expected start before end, found {start} and {end} s"
            )));
        }
        let usual = Options::default();
        let offsets = self.apply_clock_offsets.as_deref();
        Ok(Options {
            estimator: value("estimator", self.estimator.as_deref(), usual.estimator)?,
            model: value("model", self.model.as_deref(), usual.model)?,
            rate_hz: self.rate,
            from_s: self.start,
            to_s: self.end,
            closed_form_input: named("closed_form_input", self.closed_form_input.as_deref())?,
            apply_clock_offsets: value("apply_clock_offsets", offsets, usual.apply_clock_offsets)?,
            quasi_static: named("quasi_static", self.quasi_static.as_deref())?,
            ..usual
        })
    }
}

/// The language of a call: English if none is given, whatever other calls of the process speak.
///
/// # Errors
/// There is no such language.
pub(crate) fn language(lang: Option<&str>) -> Result<ReportLanguage> {
    value("lang", lang, ReportLanguage::default())
}

/// The value with this name, or the default where no name is given.
///
/// # Errors
/// There is none.
pub(crate) fn value<T: ValueEnum>(what: &str, given: Option<&str>, default: T) -> Result<T> {
    Ok(named(what, given)?.unwrap_or(default))
}

/// The value with this name, if one is given.
///
/// # Errors
/// There is none.
fn named<T: ValueEnum>(what: &str, given: Option<&str>) -> Result<Option<T>> {
    given.map(|given| one_of(what, given)).transpose()
}

/// The value with this name.
///
/// # Errors
/// There is none.
pub(crate) fn one_of<T: ValueEnum>(what: &str, given: &str) -> Result<T> {
    T::from_str(given, false).map_err(|_| {
        let values = T::value_variants().iter();
        let names =
            values.filter_map(|value| Some(value.to_possible_value()?.get_name().to_string()));
        let names: Vec<String> = names.collect();
        anyhow!(Mistake(format!(
            "expected {what} {}, found {given:?}",
            names.join(" or ")
        )))
    })
}

/// One word, or any iterable of them.
pub(crate) struct Words(pub(crate) Vec<String>);

impl<'py> FromPyObject<'_, 'py> for Words {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if given.is_instance_of::<PyString>() {
            return Ok(Self(vec![given.extract()?]));
        }
        let wrong = |found: &Bound<'py, PyAny>| -> PyResult<PyErr> {
            let found = found.get_type().name()?;
            Ok(PyTypeError::new_err(format!(
                "expected a word or an iterable of words, found {found}"
            )))
        };
        let Ok(words) = given.try_iter() else {
            return Err(wrong(&given)?);
        };
        let words = words.map(|word| {
            let word = word?;
            match word.extract::<String>() {
                Ok(word) => Ok(word),
                Err(_) => Err(wrong(&word)?),
            }
        });
        Ok(Self(words.collect::<PyResult<_>>()?))
    }
}
