//! Files as bytes: identification of their format, decompression, reading by position.

mod content;
mod file_bytes;
mod format;
mod log_file;
pub(crate) mod table_time;

pub use self::format::Format;
pub(crate) use self::{
    content::{BAG_MAGIC, Content, LONGEST_MAGIC_BYTES, content_of, format_of},
    file_bytes::FileBytes,
    log_file::LogFile,
};
