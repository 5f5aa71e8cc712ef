//! Identifies the format of a file from its first bytes.

use std::{fs::File, io::Read, path::Path};

use tipwatch_can::ContainerFormat;
use tipwatch_storage::Object;

use super::{format::Format, packing::Packing, recode::Recoding};
use crate::{
    message::Error,
    table::{Refusal, TableOptions, TextTable},
};

/// The first line of every bag, version 2.0.
pub(crate) const BAG_MAGIC: &[u8] = b"#ROSBAG V2.0\n";
const SQLITE_MAGIC: &[u8] = b"SQLite format 3\0";
const PARQUET_MAGIC: &[u8] = b"PAR1";

pub(crate) const LONGEST_MAGIC_BYTES: u64 = 16;
/// Enough to see the format of a text, also of a table with some remarks before it.
const BEGINNING_BYTES: u64 = 16 << 10;

/// The content of a file, judged by its first bytes.
pub(crate) enum Content {
    Log {
        format: Format,
        /// Whether the file is compressed as a whole.
        is_packed: bool,
        /// Conversion of the file to a text of that format, if it is not one yet.
        recoding: Option<Recoding>,
    },
    Unsupported(&'static str),
    Unknown(String),
}

impl Content {
    fn log(format: Format) -> Self {
        Self::Log {
            format,
            is_packed: false,
            recoding: None,
        }
    }

    /// Whether the content is that of a log.
    pub(crate) fn is_log(&self) -> bool {
        matches!(self, Self::Log { .. })
    }

    /// The format; an error if it has no reader.
    pub(crate) fn format(self, path: &Path) -> Result<Format, Error> {
        match self {
            Content::Log { format, .. } => Ok(format),
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

/// Classifies a local file by its first bytes.
pub(super) fn of_file(path: &Path, options: &TableOptions) -> Result<Content, Error> {
    let file = File::open(path).map_err(Error::io(path))?;
    let first_bytes = first_bytes_of(&file).map_err(Error::io(path))?;
    let Some(packing) = Packing::of(&first_bytes) else {
        return Ok(classify(&first_bytes, options));
    };
    let file = File::open(path).map_err(Error::io(path))?;
    Ok(within(packing, file, options))
}

/// Classifies an object by its bytes. One that ends as an MCAP file is an MCAP file: its end is complete already.
pub(super) fn of_object(object: &Object, options: &TableOptions) -> Result<Content, Error> {
    let size = object.size();
    let ending_bytes = (mcap::MAGIC.len() as u64).min(size);
    let mut ending = vec![0; ending_bytes as usize];
    object.read_at(size - ending_bytes, &mut ending)?;
    if ending == mcap::MAGIC {
        return Ok(Content::log(Format::Mcap));
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
        (
            _,
            Content::Log {
                format, recoding, ..
            },
        ) => Content::Log {
            format,
            is_packed: true,
            recoding,
        },
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
    let is_whole = (first_bytes.len() as u64) < BEGINNING_BYTES;
    if let Some(recoding) = Recoding::of(first_bytes, is_whole) {
        let format = recoding.format().or_else(|| {
            let text = recoding.beginning(first_bytes, is_whole);
            format_of_text(&text, is_whole, options)
        });
        if let Some(format) = format {
            return Content::Log {
                format,
                is_packed: false,
                recoding: Some(recoding),
            };
        }
    }
    if first_bytes.starts_with(mcap::MAGIC) {
        Content::log(Format::Mcap)
    } else if first_bytes.starts_with(SQLITE_MAGIC) {
        Content::log(Format::Rosbag2Sqlite)
    } else if first_bytes.starts_with(BAG_MAGIC) {
        Content::log(Format::Ros1Bag)
    } else if first_bytes.is_empty() {
        Content::Unknown("an empty file".to_owned())
    } else if first_bytes.starts_with(PARQUET_MAGIC) {
        Content::log(Format::Parquet)
    } else if let Some(format) = format_of_text(first_bytes, is_whole, options) {
        Content::log(format)
    } else if let Some(way_out) = other_format(first_bytes) {
        Content::Unsupported(way_out)
    } else {
        let shown = first_bytes.len().min(LONGEST_MAGIC_BYTES as usize);
        let text = first_bytes.get(..shown).unwrap_or_default().escape_ascii();
        Content::Unknown(format!("the first bytes \"{text}\""))
    }
}

/// Returns the remedy for a known format without a reader.
fn other_format(first_bytes: &[u8]) -> Option<&'static str> {
    const OTHERS: [(&[u8], &str); 15] = [
        (
            b"#ROS",
            "ROS bag of a version other than 2.0: convert it with rosbag fix or rosbag_migration_rule",
        ),
        (
            b"PK\x03\x04",
            "a spreadsheet (.xlsx) or zip archive: save the sheet as CSV, unpack the archive",
        ),
        (
            b"\xd0\xcf\x11\xe0",
            "a spreadsheet (.xls): save the sheet as CSV",
        ),
        (b"7z\xbc\xaf", "an archive of 7-Zip: unpack it"),
        (
            b"ARROW1\0\0",
            "Arrow (Feather): write it as Parquet (with pandas: pd.read_feather(old).to_parquet(new))",
        ),
        (
            b"\x89HDF\r\n\x1a\n",
            "HDF5 or MATLAB: write the signals as a CSV or Parquet table with a column of time",
        ),
        (
            b"MATLAB 5.0",
            "MATLAB: write the signals as a CSV or Parquet table with a column of time (writetimetable)",
        ),
        (
            b"TDSm",
            "TDMS of LabVIEW: write the signals as a CSV table with a column of time",
        ),
        (
            b"ULog\x01\x12\x35",
            "ULog of PX4: convert it to MCAP or to CSV (ulog2csv)",
        ),
        (
            b"***BUSMASTER",
            "a log of BUSMASTER: convert it to Vector ASC (in BUSMASTER: Tools, Format converters)",
        ),
        (
            b"\x0a\x0d\x0d\x0a",
            "packets of a network (pcapng): record the bus with candump -l",
        ),
        (
            b"\xd4\xc3\xb2\xa1",
            "packets of a network (pcap): record the bus with candump -l",
        ),
        (
            b"VERSION \"",
            "a DBC file: it describes the messages of a log and is given with --dbc",
        ),
        (
            b"[",
            "a JSON array: one object a line is read (jq -c '.[]' OLD > NEW.jsonl)",
        ),
        (
            b"{",
            "JSON that is one object or without times: two lines or more are read, each an object with its time (jq -c . OLD > NEW.jsonl)",
        ),
    ];
    let begins = |(magic, _): &&(&[u8], &str)| first_bytes.starts_with(magic);
    OTHERS.iter().find(begins).map(|(_, way_out)| *way_out)
}

/// A text: a trace of a bus or a table.
fn format_of_text(beginning: &[u8], is_whole: bool, options: &TableOptions) -> Option<Format> {
    if let Some(format) = ContainerFormat::of(beginning) {
        return Some(format.into());
    }
    match TextTable::find(beginning, is_whole, options) {
        Ok(_) | Err(Refusal::Unclear(_)) => Some(Format::Csv),
        Err(Refusal::NotATable) => None,
    }
}
