//! Tables as loggers write them: which column is the time, in which unit or form, and where the rows begin.

mod date;
mod layout;
mod number;
mod options;
mod time;

pub use self::options::{DateOrder, TableOptions, TimeUnit};
pub(crate) use self::{
    date::is_ambiguous,
    layout::{BySignal, Refusal, TextTable, join_blanks, signal_and_value},
    number::{Mark, decimal_mark, grouped_once, number, with_unit},
    time::{
        CounterTurns, DaysPassed, Kind, TableHead, TimeSource, find, from_float, is_name_of_time,
        is_same_column,
    },
};
