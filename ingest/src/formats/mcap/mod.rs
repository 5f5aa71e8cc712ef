//! MCAP files: record syntax and summary.

mod extra;
mod grammar;
mod record;
mod shape;
mod summary;

pub(crate) use self::grammar::Mcap;
