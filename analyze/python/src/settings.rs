//! What holds for all calls of this process.

use anyhow::anyhow;
use pyo3::prelude::*;
use tipwatch_ingest::{ReadOptions, TableOptions, set_read_options as set_options};
use tipwatch_storage::set_whole_reads;

use crate::call::error::{Mistake, exception};
use crate::call::place::{Place, paths};

/// States what logs do not state themselves, for all calls of this process from now on; each call replaces what was
/// stated before. Workers of an engine are other processes, to which it does not go.
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
/// definitions : sequence of paths
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
    signature = (*, time_column=None, time_unit=None, date_order=None, header=true, definitions=Vec::new(), fetch_whole=false),
    text_signature = "(*, time_column=None, time_unit=None, date_order=None, header=True, definitions=(), fetch_whole=False)"
)]
pub(crate) fn set_read_options(
    time_column: Option<String>,
    time_unit: Option<&str>,
    date_order: Option<&str>,
    header: bool,
    definitions: Vec<Place>,
    fetch_whole: bool,
) -> PyResult<()> {
    let mistake = |name: &str, given: &str, error: String| {
        exception(&anyhow!(Mistake(format!(
            "{name}: {error}, found {given:?}"
        ))))
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
        definitions: paths(definitions),
    });
    set_whole_reads(fetch_whole);
    Ok(())
}
