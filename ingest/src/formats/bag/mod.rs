//! Bags of ROS 1, version 2.0: record syntax and index.

mod connection;
mod grammar;
mod header;
mod index;

pub(crate) use self::grammar::Bag;
