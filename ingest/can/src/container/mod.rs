//! Files of loggers as sources of frames. Damage never ends the reading: it is reported, with the bytes.

mod asc;
mod blf;
mod calendar;
mod candump;
mod candump_stream;
mod candump_time;
mod channels;
mod format;
mod lost;
mod mf4;
mod open;
mod open_error;
mod text;
mod trc;
mod written;

pub use self::{
    candump_stream::CandumpStream, format::ContainerFormat, lost::Lost, open::Container,
    open_error::OpenError, written::Written,
};
