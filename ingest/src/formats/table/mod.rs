//! Tables as logs: a column of time, and a topic `table` with a number for every other column.

mod coarse_times;
mod columns;
mod csv;
mod lost_rows;
mod parquet;
mod rows;

pub(crate) use self::{
    csv::CsvReader,
    parquet::ParquetReader,
    rows::{collect_numbers, is_row},
};
