//! CAN (controller area network) signals of a machine file: the DBC files that it names, and their messages as topics.

mod signals;

pub use signals::read_dbc;
