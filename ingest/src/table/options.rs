//! Settings by which a person completes what a table does not state itself, so that nobody has to edit evidence.

use serde::Serialize;
use strum::{Display, EnumString};

/// Settings for reading tables, beyond what the tables state.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct TableOptions {
    /// The column of time; two, joined by a comma, for a date and a time of day or for seconds and nanoseconds.
    pub time_column: Option<String>,
    /// Unit of the numbers in the column of time.
    pub time_unit: Option<TimeUnit>,
    /// Whether the first line is a row: the columns are then `c1`, `c2` and so on.
    pub no_header: bool,
    /// The order of day, month and year in dates that do not show it.
    pub date_order: Option<DateOrder>,
}

/// The unit of times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Display, EnumString)]
#[serde(rename_all = "snake_case")]
#[strum(parse_err_ty = String, parse_err_fn = not_a_time_unit)]
pub enum TimeUnit {
    /// h
    #[strum(serialize = "h")]
    Hours,
    /// min
    #[strum(serialize = "min")]
    Minutes,
    /// s
    #[strum(serialize = "s")]
    Seconds,
    /// ms
    #[strum(serialize = "ms")]
    Milliseconds,
    /// us
    #[strum(serialize = "us")]
    Microseconds,
    /// ns
    #[strum(serialize = "ns")]
    Nanoseconds,
    /// Days since 30 December 1899, as spreadsheets keep dates.
    #[strum(serialize = "days")]
    Days,
}

/// The order of day, month and year.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, EnumString)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case", parse_err_ty = String, parse_err_fn = not_a_date_order)]
pub enum DateOrder {
    /// Day, month, year.
    Dmy,
    /// Month, day, year.
    Mdy,
    /// Year, month, day.
    Ymd,
}

fn not_a_time_unit(_: &str) -> String {
    "expected s, ms, us, ns, min, h or days".to_owned()
}

fn not_a_date_order(_: &str) -> String {
    "expected dmy, mdy or ymd".to_owned()
}
