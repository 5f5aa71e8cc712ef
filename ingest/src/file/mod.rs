//! Files as bytes: identification of their format, decompression, reading by position.

mod annotated_csv;
mod content;
mod file_bytes;
mod format;
mod frame_table;
mod json_lines;
mod lines;
mod log_file;
mod packing;
mod read_options;
mod recode;
mod source;

pub(crate) use self::{
    content::{BAG_MAGIC, LONGEST_MAGIC_BYTES},
    file_bytes::FileBytes,
    log_file::LogFile,
    source::Source,
};
pub use self::{
    format::Format,
    log_file::FileTransfer,
    read_options::{ReadOptions, read_options, set_read_options},
};
