//! ASAM MDF version 4 with bus logging: groups of records, compressed or not.

mod block;
mod chain;
mod channel;
mod conversion;
mod field;
mod group;
mod layout;
mod reader;

pub(super) use self::reader::Mf4;
