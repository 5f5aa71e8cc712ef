//! SQLite databases of rosbag2: a table of topics, and one row per message.
//!
//! The SQLite library reads intact databases. Where it gives up, the pages are read directly.

mod connection;
mod cut;
mod gaps;
mod page;
mod pass;
mod private_copy;
mod salvage;
mod sqlite_reader;
mod tables;

pub(crate) use self::sqlite_reader::SqliteReader;
