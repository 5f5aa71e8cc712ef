//! Identifies the format of a file from its first bytes.

use std::{fs::File, io::Read, path::Path};

use tipwatch_can::ContainerFormat;

use super::{format::Format, table_time::is_csv};
use crate::message::Error;

/// The first line of every bag, version 2.0.
pub(crate) const BAG_MAGIC: &[u8] = b"#ROSBAG V2.0\n";
const SQLITE_MAGIC: &[u8] = b"SQLite format 3\0";
const OTHER_BAG_MAGIC: &[u8] = b"#ROS";
const PARQUET_MAGIC: &[u8] = b"PAR1";
const ZSTD_MAGIC: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];

pub(crate) const LONGEST_MAGIC_BYTES: u64 = 16;
/// Enough to see the format of a text.
const BEGINNING_BYTES: u64 = 4096;

/// The content of a file, judged by its first bytes.
pub(crate) enum Content {
    Log(Format),
    /// A log in a zstd-compressed file.
    Packed(Format),
    Unsupported(&'static str),
    Unknown(String),
}

/// The format of a file; an error if it has no reader.
pub(crate) fn format_of(path: &Path) -> Result<Format, Error> {
    match content_of(path)? {
        Content::Log(format) | Content::Packed(format) => Ok(format),
        Content::Unsupported(format) => Err(Error::Unsupported {
            path: path.to_path_buf(),
            format: format.to_owned(),
        }),
        Content::Unknown(found) => Err(Error::NotALog {
            path: path.to_path_buf(),
            found,
        }),
    }
}

/// What the first bytes of a file say.
pub(crate) fn content_of(path: &Path) -> Result<Content, Error> {
    let file = File::open(path).map_err(Error::io(path))?;
    let first_bytes = first_bytes_of(file).map_err(Error::io(path))?;
    if !first_bytes.starts_with(ZSTD_MAGIC) {
        return Ok(classify(&first_bytes));
    }
    let file = File::open(path).map_err(Error::io(path))?;
    let unpacked = zstd::stream::read::Decoder::new(file).and_then(first_bytes_of);
    Ok(match unpacked.map(|first_bytes| classify(&first_bytes)) {
        Ok(Content::Log(format)) => Content::Packed(format),
        Ok(Content::Unknown(found)) => Content::Unknown(format!("within zstd {found}")),
        Ok(other) => other,
        Err(error) => Content::Unknown(format!("damaged zstd: {error}")),
    })
}

fn first_bytes_of(source: impl Read) -> std::io::Result<Vec<u8>> {
    let mut first_bytes = Vec::new();
    source.take(BEGINNING_BYTES).read_to_end(&mut first_bytes)?;
    Ok(first_bytes)
}

fn classify(first_bytes: &[u8]) -> Content {
    if first_bytes.starts_with(mcap::MAGIC) {
        Content::Log(Format::Mcap)
    } else if first_bytes.starts_with(SQLITE_MAGIC) {
        Content::Log(Format::Rosbag2Sqlite)
    } else if first_bytes.starts_with(BAG_MAGIC) {
        Content::Log(Format::Ros1Bag)
    } else if first_bytes.starts_with(OTHER_BAG_MAGIC) {
        Content::Unsupported("ROS bag of a version other than 2.0")
    } else if first_bytes.is_empty() {
        Content::Unknown("an empty file".to_owned())
    } else if let Some(format) = ContainerFormat::of(first_bytes) {
        Content::Log(format.into())
    } else if first_bytes.starts_with(PARQUET_MAGIC) {
        Content::Log(Format::Parquet)
    } else if is_csv(first_bytes) {
        Content::Log(Format::Csv)
    } else {
        let shown = first_bytes.len().min(LONGEST_MAGIC_BYTES as usize);
        let text = first_bytes.get(..shown).unwrap_or_default().escape_ascii();
        Content::Unknown(format!("the first bytes \"{text}\""))
    }
}
