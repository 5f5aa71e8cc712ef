//! Options of every command that reads a log, for properties that the log does not state itself.

use std::path::PathBuf;

use clap::Args;
use tipwatch_ingest::{DateOrder, ReadOptions, TableOptions, TimeUnit};

/// What logs do not state themselves.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "What logs do not state themselves")]
pub(super) struct ReadingArgs {
    /// The column of time of a table; two, joined by a comma, for a date and a time of day, or for seconds and
    /// nanoseconds.
    #[arg(long, global = true, value_name = "NAME")]
    time_column: Option<String>,
    /// The unit of the times of a table: s, ms, us, ns or days (since 30 December 1899, as spreadsheets keep dates).
    #[arg(long, global = true, value_name = "UNIT")]
    time_unit: Option<TimeUnit>,
    /// The order of day, month and year in the dates of a table: dmy, mdy or ymd.
    #[arg(long, global = true, value_name = "ORDER")]
    date_order: Option<DateOrder>,
    /// The first line of a table is a row: its columns are c1, c2 and so on.
    #[arg(long, global = true)]
    no_header: bool,
    /// A folder with definitions of message types, PACKAGE/msg/NAME.msg, for logs that lack them; may be given several
    /// times.
    #[arg(long, global = true, value_name = "DIR")]
    definitions: Vec<PathBuf>,
}

impl ReadingArgs {
    pub(super) fn options(&self) -> ReadOptions {
        ReadOptions {
            table: TableOptions {
                time_column: self.time_column.clone(),
                time_unit: self.time_unit,
                no_header: self.no_header,
                date_order: self.date_order,
            },
            definitions: self.definitions.clone(),
        }
    }
}
