//! DBC files: descriptions of a bus's messages.

mod dbc;
mod names;
mod signals;

pub use self::dbc::{Database, DatabaseError};
