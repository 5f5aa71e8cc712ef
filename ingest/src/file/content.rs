//! Identifies the format of a file from its first bytes.

use std::{fs::File, io::Read, path::Path};

use tipwatch_can::ContainerFormat;
use tipwatch_storage::Object;

use super::{format::Format, packing::Packing, recode::Utf16};
use crate::{
    message::Error,
    table::{Refusal, TableOptions, TextTable},
};

/// The first line of every bag, version 2.0.
pub(crate) const BAG_MAGIC: &[u8] = b"#ROSBAG V2.0\n";
const SQLITE_MAGIC: &[u8] = b"SQLite format 3\0";
const OTHER_BAG_MAGIC: &[u8] = b"#ROS";
const PARQUET_MAGIC: &[u8] = b"PAR1";

pub(crate) const LONGEST_MAGIC_BYTES: u64 = 16;
/// Enough to see the format of a text, also of a table with some remarks before it.
const BEGINNING_BYTES: u64 = 16 << 10;

/// The content of a file, judged by its first bytes.
pub(crate) enum Content {
    Log(Format),
    /// A log in a file that is compressed as a whole.
    Packed(Format),
    /// A log of text in UTF-16.
    Recoded(Format),
    Unsupported(&'static str),
    Unknown(String),
}

impl Content {
    /// Whether it is that of a log.
    pub(crate) fn is_log(&self) -> bool {
        matches!(self, Self::Log(_) | Self::Packed(_) | Self::Recoded(_))
    }

    /// The format; an error if it has no reader.
    pub(crate) fn format(self, path: &Path) -> Result<Format, Error> {
        match self {
            Content::Log(format) | Content::Packed(format) | Content::Recoded(format) => Ok(format),
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
}

/// What the first bytes of a local file say.
pub(super) fn of_file(path: &Path, options: &TableOptions) -> Result<Content, Error> {
    let file = File::open(path).map_err(Error::io(path))?;
    let first_bytes = first_bytes_of(&file).map_err(Error::io(path))?;
    let Some(packing) = Packing::of(&first_bytes) else {
        return Ok(classify(&first_bytes, options));
    };
    let file = File::open(path).map_err(Error::io(path))?;
    Ok(within(packing, file, options))
}

/// What the bytes of an object say. That it ends as an MCAP file is enough: its end is there already.
pub(super) fn of_object(object: &Object, options: &TableOptions) -> Result<Content, Error> {
    let size = object.size();
    let ending_bytes = (mcap::MAGIC.len() as u64).min(size);
    let mut ending = vec![0; ending_bytes as usize];
    object.read_at(size - ending_bytes, &mut ending)?;
    if ending == mcap::MAGIC {
        return Ok(Content::Log(Format::Mcap));
    }
    let mut first_bytes = vec![0; BEGINNING_BYTES.min(size) as usize];
    object.read_at(0, &mut first_bytes)?;
    Ok(match Packing::of(&first_bytes) {
        Some(packing) => {
            let beginning = 0..packing.beginning_bytes().min(size);
            object.require(beginning.clone())?;
            let file = File::open(object.data()).map_err(Error::io(object.data()))?;
            within(packing, file.take(beginning.end), options)
        }
        None => classify(&first_bytes, options),
    })
}

fn within(packing: Packing, packed: impl Read, options: &TableOptions) -> Content {
    let mut first_bytes = Vec::new();
    let unpacked = packing.unpack(packed);
    let unpacked = unpacked.and_then(|of| of.take(BEGINNING_BYTES).read_to_end(&mut first_bytes));
    match (unpacked, classify(&first_bytes, options)) {
        // damage may follow
        (_, Content::Log(format)) => Content::Packed(format),
        (_, Content::Recoded(_)) => Content::Unsupported("a compressed text in UTF-16"),
        (Err(error), _) => Content::Unknown(format!("damaged {packing}: {error}")),
        (Ok(_), Content::Unknown(found)) => Content::Unknown(format!("within {packing} {found}")),
        (Ok(_), other) => other,
    }
}

fn first_bytes_of(source: impl Read) -> std::io::Result<Vec<u8>> {
    let mut first_bytes = Vec::new();
    source.take(BEGINNING_BYTES).read_to_end(&mut first_bytes)?;
    Ok(first_bytes)
}

fn classify(first_bytes: &[u8], options: &TableOptions) -> Content {
    if let Some(order) = Utf16::of(first_bytes) {
        let mut text = Vec::new();
        let whole_units = first_bytes.len() & !1;
        let mut units = first_bytes.get(..whole_units).unwrap_or_default();
        // writing to memory cannot fail
        let _ = order.recode(&mut units, &mut text);
        let is_whole = (first_bytes.len() as u64) < BEGINNING_BYTES;
        if let Content::Log(format) = classify_text(&text, is_whole, options) {
            return Content::Recoded(format);
        }
    }
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
    } else if first_bytes.starts_with(PARQUET_MAGIC) {
        Content::Log(Format::Parquet)
    } else if let Content::Log(format) = classify_text(
        first_bytes,
        (first_bytes.len() as u64) < BEGINNING_BYTES,
        options,
    ) {
        Content::Log(format)
    } else {
        let shown = first_bytes.len().min(LONGEST_MAGIC_BYTES as usize);
        let text = first_bytes.get(..shown).unwrap_or_default().escape_ascii();
        Content::Unknown(format!("the first bytes \"{text}\""))
    }
}

/// A text: a trace of a bus or a table.
fn classify_text(beginning: &[u8], is_whole: bool, options: &TableOptions) -> Content {
    if let Some(format) = ContainerFormat::of(beginning) {
        return Content::Log(format.into());
    }
    match TextTable::find(beginning, is_whole, options) {
        Ok(_) | Err(Refusal::Unclear(_)) => Content::Log(Format::Csv),
        Err(Refusal::NotATable) => Content::Unknown(String::new()),
    }
}
