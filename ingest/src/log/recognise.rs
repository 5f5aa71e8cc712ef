//! Detects the format of a path and the files that form one log.

use std::{collections::BTreeMap, path::Path};

use super::{log_files::LogFiles, rosbag2_folder};
use crate::{
    file::{Format, LONGEST_MAGIC_BYTES, Source},
    message::{Error, Losses, LostPart},
};

/// Detects the log at `path`.
pub(crate) fn recognise(path: &Path, source: &Source) -> Result<LogFiles, Error> {
    if source.is_folder(path)? {
        return rosbag2_folder::recognise(path, source);
    }
    let mut losses = Losses::default();
    let format = match (source.format_of(path), format_by_name(path)) {
        (Err(Error::NotALog { found, .. }), Some(format)) if source.bytes(path) > 0 => {
            losses.lose(LostPart::Records, path, 0..LONGEST_MAGIC_BYTES, found);
            format
        }
        (format, _) => format?,
    };
    Ok(LogFiles {
        format,
        files: vec![path.to_path_buf()],
        losses,
        has_packed_messages: None,
        declared_counts: BTreeMap::new(),
    })
}

/// The format by file name, for a file whose first bytes are damaged. SQLite cannot open a database
/// without them.
fn format_by_name(path: &Path) -> Option<Format> {
    match path.extension()?.to_str()? {
        "mcap" => Some(Format::Mcap),
        "bag" => Some(Format::Ros1Bag),
        "blf" => Some(Format::Blf),
        _ => None,
    }
}
