//! Parameters of a machine from weighings and logs.

use std::path::PathBuf;

use anyhow::bail;
use pyo3::prelude::*;
use tipwatch_analyze::base::options::ReportLanguage;
use tipwatch_analyze::setup::identify::{
    IdentificationDocument, Request, identify as identified, text, write_machine_file,
};

use crate::call::error::{Mistake, exception};
use crate::call::interrupt::leavable;
use crate::call::number::positive;
use crate::call::pickle::{Reduced, reduced};
use crate::call::place::{Place, Places};
use crate::machine::machine_file;

/// What an identification found.
#[pyclass(frozen, module = "tipwatch")]
pub(crate) struct Identification {
    document: String,
    text: String,
    holds: Option<bool>,
    file: Option<PathBuf>,
}

/// Arguments from which pickle rebuilds an identification.
type Parts = (String, String, Option<bool>, Option<PathBuf>);

#[pymethods]
impl Identification {
    /// The document that ``tipwatch identify --json`` prints: parameters with their change and standard deviation
    /// (SI units), what the data tell and what they do not, errors before and after.
    #[getter]
    fn document<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (&self.document,))
    }

    /// The result as ``tipwatch identify`` prints it.
    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    /// Whether the result predicts data that were held back no worse than before; None if none were held back.
    #[getter]
    fn holds(&self) -> Option<bool> {
        self.holds
    }

    /// The machine file that was written; None without ``out``, or if the result does not hold.
    #[getter]
    fn file(&self) -> Option<PathBuf> {
        self.file.clone()
    }

    fn __str__(&self) -> &str {
        &self.text
    }

    /// For pickle.
    fn __reduce__<'py>(this: &Bound<'py, Self>) -> Reduced<'py, Parts> {
        let own = this.get();
        let parts = (
            own.document.clone(),
            own.text.clone(),
            own.holds,
            own.file.clone(),
        );
        reduced(this, parts)
    }

    #[staticmethod]
    fn _of_parts(document: String, text: String, holds: Option<bool>, file: Option<Place>) -> Self {
        Self {
            document,
            text,
            holds,
            file: file.map(Place::into_path),
        }
    }

    fn __repr__(&self) -> String {
        let holds = match self.holds {
            Some(true) => "holds on held-back data",
            Some(false) => "does not hold on held-back data",
            None => "no data held back",
        };
        format!("<tipwatch.Identification: {holds}>")
    }
}

/// Identifies parameters of a machine: masses, centres of mass, positions, tyre stiffness, errors of sensors.
///
/// The standard deviations of the machine file are the prior; its weighings count, too.
///
/// Parameters
/// ----------
/// machine : Machine or path
///     The machine, or its machine file.
/// logs : path, or iterable of paths
///     Logs with measured loads or cylinder forces; may be empty if the machine file has weighings.
/// level : float, optional
///     The ground of the logs is level, with this standard deviation of its slope (rad).
/// widen_sigmas : float, optional
///     Widen the stated standard deviations of all scales and sensors by this factor.
/// out : path, optional
///     A machine file with what was identified is written there, unless the result contradicts what was stated or does not
///     hold on held-back data: see ``refused`` in the document.
///
/// Returns
/// -------
/// Identification
///
/// Raises
/// ------
/// TipwatchError
///     A log cannot be read or does not fit the machine, or there is nothing to identify from.
#[pyfunction]
#[pyo3(signature = (machine, logs=Places::default(), *, level=None, widen_sigmas=None, out=None), text_signature = "(machine, logs=(), *, level=None, widen_sigmas=None, out=None)")]
pub(crate) fn identify(
    py: Python<'_>,
    machine: &Bound<'_, PyAny>,
    logs: Places,
    level: Option<f64>,
    widen_sigmas: Option<f64>,
    out: Option<Place>,
) -> PyResult<Identification> {
    let file = machine_file(machine)?;
    let (Places(logs), out) = (logs, out.map(Place::into_path));
    let found = leavable(
        py,
        move |stop| {
            let _speaking = ReportLanguage::En.speak();
            level
                .map(|level| positive("level (rad)", level))
                .transpose()?;
            if let Some(factor) = widen_sigmas
                && !(factor.is_finite() && factor >= 1.0)
            {
                bail!(Mistake(format!(
                    "expected widen_sigmas of at least 1, found {factor}"
                )));
            }
            let request = Request {
                logs,
                level,
                sigma_factor: widen_sigmas,
            };
            let found = identified(&file, &request)?;
            let holds = found.holds();
            let out = out.filter(|_| found.refusal().is_none() && !stop.is_set());
            if let Some(out) = &out {
                write_machine_file(out, &file, &found)?;
            }
            Ok(Identification {
                document: serde_json::to_string(&IdentificationDocument::of(&found))?,
                text: text(&found),
                holds,
                file: out,
            })
        },
        |_| Ok(()),
    )?;
    found.map_err(|error| exception(&error))
}
