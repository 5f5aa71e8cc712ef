//! Readers of the supported file formats.
//!
//! A new format takes one implementation of [`FileReader`](reader::FileReader), one variant of
//! [`Format`](crate::Format), one line in [`open`] and one in `file::content`.

mod bag;
mod can_container;
mod mcap;
mod open;
mod reader;
mod records;
mod rosbag2_sqlite;
mod table;

pub use self::can_container::CanFrameType;
pub(crate) use self::{
    open::open,
    reader::{Batch, Batches, FileReader, Request},
    table::{collect_numbers, is_row},
};
