//! Which format a path holds, told by content, and which files form one log.

use std::{
    collections::BTreeMap,
    fs::File,
    io::Read,
    path::{Path, PathBuf},
};

use crate::{
    bag,
    error::Error,
    log::Format,
    losses::{Losses, LostPart},
    rosbag2_folder,
};

const SQLITE_MAGIC: &[u8] = b"SQLite format 3\0";
const OTHER_BAG_MAGIC: &[u8] = b"#ROS";
const ZSTD_MAGIC: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];
const LONGEST_MAGIC_BYTES: u64 = 16;

/// The files of one log.
pub(crate) struct Recording {
    pub(crate) format: Format,
    pub(crate) files: Vec<PathBuf>,
    pub(crate) losses: Losses,
    /// How many messages the recorder says it wrote, for each topic.
    pub(crate) promised: BTreeMap<String, u64>,
}

/// What the first bytes of a file say.
pub(crate) enum Content {
    Log(Format),
    /// A log that is compressed as a whole.
    Packed(Format),
    NotReadYet(&'static str),
    Unknown(String),
}

/// Finds out what `path` holds.
pub(crate) fn recognise(path: &Path) -> Result<Recording, Error> {
    let metadata = std::fs::metadata(path).map_err(Error::io(path))?;
    if metadata.is_dir() {
        return rosbag2_folder::recognise(path);
    }
    let mut losses = Losses::default();
    let format = match (format_of(path), format_by_name(path)) {
        (Err(Error::NotALog { found, .. }), Some(format)) if metadata.len() > 0 => {
            losses.lose(LostPart::Records, path, 0..LONGEST_MAGIC_BYTES, found);
            format
        }
        (format, _) => format?,
    };
    Ok(Recording {
        format,
        files: vec![path.to_path_buf()],
        losses,
        promised: BTreeMap::new(),
    })
}

/// What the name says, for a file whose first bytes are damaged. A database without its first bytes
/// is not opened by SQLite.
fn format_by_name(path: &Path) -> Option<Format> {
    match path.extension()?.to_str()? {
        "mcap" => Some(Format::Mcap),
        "bag" => Some(Format::Ros1Bag),
        _ => None,
    }
}

/// The format of one file; an error if there is no reader for it.
pub(crate) fn format_of(path: &Path) -> Result<Format, Error> {
    match content_of(path)? {
        Content::Log(format) | Content::Packed(format) => Ok(format),
        Content::NotReadYet(format) => Err(Error::NotReadYet {
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
    source
        .take(LONGEST_MAGIC_BYTES)
        .read_to_end(&mut first_bytes)?;
    Ok(first_bytes)
}

fn classify(first_bytes: &[u8]) -> Content {
    if first_bytes.starts_with(mcap::MAGIC) {
        Content::Log(Format::Mcap)
    } else if first_bytes.starts_with(SQLITE_MAGIC) {
        Content::Log(Format::Rosbag2Sqlite)
    } else if first_bytes.starts_with(bag::MAGIC) {
        Content::Log(Format::Ros1Bag)
    } else if first_bytes.starts_with(OTHER_BAG_MAGIC) {
        Content::NotReadYet("ROS bag of a version other than 2.0")
    } else if first_bytes.is_empty() {
        Content::Unknown("an empty file".to_owned())
    } else {
        let text = first_bytes.escape_ascii();
        Content::Unknown(format!("the first bytes \"{text}\""))
    }
}
