//! Settings that hold for all calls of this process.

use std::path::{PathBuf, absolute};
use std::sync::{Mutex, PoisonError};

use anyhow::anyhow;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tipwatch_ingest::{ReadOptions, TableOptions, set_read_options as set_options};
use tipwatch_storage::set_whole_reads;

use crate::call::error::{Mistake, exception};
use crate::call::place::Places;

/// States what logs do not state themselves, for all calls of this process from now on; each call replaces what was
/// stated before. With ``screen`` it goes to the workers of an engine; they need the folders of ``definitions`` at the same
/// paths.
///
/// Parameters
/// ----------
/// time_column : str, optional
///     The column of time of a table (CSV, Parquet); two, joined by a comma, for a date and a time of day, or for seconds
///     and nanoseconds.
/// time_unit : {"s", "ms", "us", "ns", "days"}, optional
///     The unit of the times of a table.
/// date_order : {"dmy", "mdy", "ymd"}, optional
///     The order of day, month and year in the dates of a table.
/// header : bool
///     Whether the first line of a table names its columns; without it they are c1, c2 and so on.
/// definitions : path, or iterable of paths
///     Folders with definitions of message types, ``PACKAGE/msg/NAME.msg``, for logs that lack them.
/// fetch_whole : bool
///     Whether logs of buckets and web servers are transferred as a whole where their format has no index of its parts.
///
/// Returns
/// -------
/// None
///
/// Raises
/// ------
/// TipwatchError
///     A unit or an order is unknown.
#[pyfunction]
#[pyo3(
    signature = (*, time_column=None, time_unit=None, date_order=None, header=true, definitions=Places::default(), fetch_whole=false),
    text_signature = "(*, time_column=None, time_unit=None, date_order=None, header=True, definitions=(), fetch_whole=False)"
)]
pub(crate) fn set_read_options(
    time_column: Option<String>,
    time_unit: Option<&str>,
    date_order: Option<&str>,
    header: bool,
    definitions: Places,
    fetch_whole: bool,
) -> PyResult<()> {
    let mistake = |name: &str, given: &str, error: String| {
        exception(&anyhow!(Mistake(format!(
            "{name}: {error}, found {given:?}"
        ))))
    };
    let Places(mut definitions) = definitions;
    for folder in &mut definitions {
        let whole = absolute(&*folder);
        *folder = whole.map_err(|error| exception(&error.into()))?;
    }
    let given = Given {
        time_column: time_column.clone(),
        time_unit: time_unit.map(str::to_owned),
        date_order: date_order.map(str::to_owned),
        header,
        definitions: definitions.clone(),
        fetch_whole,
    };
    let unit =
        time_unit.map(|unit| (unit.parse()).map_err(|error| mistake("time_unit", unit, error)));
    let order = date_order
        .map(|order| (order.parse()).map_err(|error| mistake("date_order", order, error)));
    set_options(ReadOptions {
        table: TableOptions {
            time_column,
            time_unit: unit.transpose()?,
            no_header: !header,
            date_order: order.transpose()?,
        },
        definitions,
    });
    set_whole_reads(fetch_whole);
    *GIVEN.lock().unwrap_or_else(PoisonError::into_inner) = Some(given);
    Ok(())
}

/// The keywords of the last call.
struct Given {
    time_column: Option<String>,
    time_unit: Option<String>,
    date_order: Option<String>,
    header: bool,
    definitions: Vec<PathBuf>,
    fetch_whole: bool,
}

static GIVEN: Mutex<Option<Given>> = Mutex::new(None);

/// What was stated with ``set_read_options``, as its keywords, for the workers of an engine.
#[pyfunction]
pub(crate) fn stated_read_options(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let keywords = PyDict::new(py);
    let given = GIVEN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(given) = &*given {
        keywords.set_item("time_column", &given.time_column)?;
        keywords.set_item("time_unit", &given.time_unit)?;
        keywords.set_item("date_order", &given.date_order)?;
        keywords.set_item("header", given.header)?;
        keywords.set_item("definitions", &given.definitions)?;
        keywords.set_item("fetch_whole", given.fetch_whole)?;
    }
    Ok(keywords)
}
