//! Memory for columns of many millions of values.
//!
//! A column's memory is reserved once, and its pages are obtained from the system shortly before the
//! column grows into them, by all reading threads. One thread alone, the one that fills the columns,
//! would need longer for it than all threads need to decode the messages.

mod fresh_memory;
mod page_size;
mod region;
mod system;

pub(crate) use self::{
    fresh_memory::FreshMemory,
    region::{Region, reserve},
};
