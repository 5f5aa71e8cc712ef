//! What a person can say about a table that does not say it itself, so that nobody has to edit evidence.

use std::{fmt, str::FromStr};

use serde::Serialize;

/// What is known about tables beyond what they state.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct TableOptions {
    /// The column of time; two, joined by a comma, for a date and a time of day or for seconds and nanoseconds.
    pub time_column: Option<String>,
    /// The unit of the numbers in it.
    pub time_unit: Option<TimeUnit>,
    /// Whether the first line is a row: the columns are then `c1`, `c2` and so on.
    pub no_header: bool,
    /// The order of day, month and year in dates that do not show it.
    pub date_order: Option<DateOrder>,
}

/// The unit of times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TimeUnit {
    /// h
    Hours,
    /// min
    Minutes,
    /// s
    Seconds,
    /// ms
    Milliseconds,
    /// us
    Microseconds,
    /// ns
    Nanoseconds,
    /// Days since 30 December 1899, as spreadsheets keep dates.
    Days,
}

/// The order of day, month and year.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DateOrder {
    /// Day, month, year.
    Dmy,
    /// Month, day, year.
    Mdy,
    /// Year, month, day.
    Ymd,
}

impl TimeUnit {
    /// All units.
    pub const ALL: [Self; 7] = [
        Self::Hours,
        Self::Minutes,
        Self::Seconds,
        Self::Milliseconds,
        Self::Microseconds,
        Self::Nanoseconds,
        Self::Days,
    ];
}

impl fmt::Display for TimeUnit {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Hours => "h",
            Self::Minutes => "min",
            Self::Seconds => "s",
            Self::Milliseconds => "ms",
            Self::Microseconds => "us",
            Self::Nanoseconds => "ns",
            Self::Days => "days",
        })
    }
}

impl FromStr for TimeUnit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = Self::ALL.into_iter();
        let mut found = known.filter(|unit| unit.to_string() == text);
        found
            .next()
            .ok_or_else(|| "expected s, ms, us, ns, min, h or days".to_owned())
    }
}

impl FromStr for DateOrder {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "dmy" => Ok(Self::Dmy),
            "mdy" => Ok(Self::Mdy),
            "ymd" => Ok(Self::Ymd),
            _ => Err("expected dmy, mdy or ymd".to_owned()),
        }
    }
}
