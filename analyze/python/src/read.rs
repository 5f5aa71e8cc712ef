//! The sensors of a log on one clock.

use pyo3::prelude::*;
use tipwatch_analyze::analysis::states;
use tipwatch_analyze::base::options::ReportLanguage;
use tipwatch_analyze::tables;

use crate::call::error::exception;
use crate::call::interrupt::leavable;
use crate::call::options::Stated;
use crate::call::place::Place;
use crate::machine::machine_file;
use crate::table::Table;

/// Reads the sensors of a log, filtered and on one clock: joint positions, rates and accelerations, specific force and
/// angular motion of the IMU, attitude and velocity of the base. No loads are computed.
///
/// Parameters
/// ----------
/// log : path or URL
///     The log; also in a bucket or on a web server.
/// machine : Machine or path
///     The machine, which binds topics to sensors.
/// rate : float, optional
///     Rows per second; if not given, rows follow the fastest joint stream.
/// start, end : float, optional
///     Time range (seconds after the first sample).
/// estimator : "smoother" or "causal"
///     As in ``analyze``.
///
/// Returns
/// -------
/// Table
///     One row per time; null where a signal is unknown, with the reasons in a column. Positions in rad or m,
///     specific force in m/s^2, angular velocity in rad/s; ``Table.units`` has the unit of every column.
///
/// Raises
/// ------
/// TipwatchError
///     The log cannot be read, or the machine does not fit it.
#[pyfunction]
#[pyo3(signature = (log, machine, *, rate=None, start=None, end=None, estimator=None))]
pub(crate) fn read(
    py: Python<'_>,
    log: Place,
    machine: &Bound<'_, PyAny>,
    rate: Option<f64>,
    start: Option<f64>,
    end: Option<f64>,
    estimator: Option<String>,
) -> PyResult<Table> {
    let file = machine_file(machine)?;
    let compute = move |_: &_| {
        let _speaking = ReportLanguage::En.speak();
        let stated = Stated {
            rate,
            start,
            end,
            estimator,
            ..Stated::default()
        };
        let options = stated.options()?;
        let (machine, rows) = states(&log, &file, &options)?;
        Ok(Table::from(tables::states::states(&machine, &rows)))
    };
    let found = leavable(py, compute, |_| Ok(()))?;
    found.map_err(|error| exception(&error))
}
