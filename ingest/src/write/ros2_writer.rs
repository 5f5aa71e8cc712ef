//! Writes messages as ROS 2 programs do, into an MCAP file: CDR, every definition embedded.

use std::{
    borrow::Cow,
    collections::BTreeMap,
    fs::File,
    io::{BufWriter, Error as IoError, IntoInnerError},
    path::{Path, PathBuf},
};

use byteorder::LittleEndian;
use mcap::{
    Attachment, Compression, McapError, WriteOptions, Writer,
    records::{MessageHeader, Metadata},
};
use serde::Serialize;

use crate::schema::{Dialect, builtin};

/// Intact chunks are small enough to read one, and large enough to compress.
const CHUNK_BYTES: u64 = 1 << 20;
/// Of CDR: plain, little endian.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Why a log could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The file cannot be made; an existing one is never overwritten.
    #[error("{}: cannot be created: {source}", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: IoError,
    },
    /// The file cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What went wrong.
        source: McapError,
    },
    /// A message cannot be encoded.
    #[error("{}: cannot be written: {problem}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// What of the message has no encoding.
        problem: String,
    },
    /// A type is none of the common ones, and no definition came with it.
    #[error("\"{type_name}\": expected one of the common message types, or a definition of it")]
    UnknownType {
        /// The type.
        type_name: String,
    },
}

/// A topic of a [`Ros2Writer`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OutTopic(u16);

/// Writes a log.
pub struct Ros2Writer {
    writer: Writer<BufWriter<File>>,
    path: PathBuf,
    encoded: Vec<u8>,
}

impl std::fmt::Debug for Ros2Writer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Ros2Writer")
            .field("path", &self.path)
            .finish_non_exhaustive()
    }
}

impl Ros2Writer {
    /// Begins a log.
    ///
    /// # Errors
    /// The file exists already, or cannot be created or written.
    pub fn create(path: &Path) -> Result<Self, WriteError> {
        let file = File::create_new(path).map_err(|source| WriteError::Create {
            path: path.into(),
            source,
        })?;
        // numbers that differ in every digit gain nothing from more
        let options = options("ros2").compression_level(1);
        let writer = options.create(BufWriter::new(file));
        Ok(Self {
            writer: writer.map_err(|source| failed(path, source))?,
            path: path.into(),
            encoded: Vec::new(),
        })
    }

    /// Adds a topic. The fields of its type are the text of its `.msg` file; they may be left out for the
    /// common types, and be made of those.
    ///
    /// # Errors
    /// The type is not known; the file cannot be written.
    pub fn topic(
        &mut self,
        name: &str,
        type_name: &str,
        fields: Option<&str>,
    ) -> Result<OutTopic, WriteError> {
        let definition = match fields {
            Some(fields) => builtin::with_common_parts(fields, Dialect::Ros2),
            None => builtin::definition(type_name, Dialect::Ros2),
        };
        let definition = definition.ok_or_else(|| WriteError::UnknownType {
            type_name: type_name.into(),
        })?;
        let writer = &mut self.writer;
        let channel = writer
            .add_schema(type_name, "ros2msg", definition.as_bytes())
            .and_then(|schema| writer.add_channel(schema, name, "cdr", &BTreeMap::new()));
        channel.map(OutTopic).map_err(|e| failed(&self.path, e))
    }

    /// Writes a message. Its fields are serialised in their order: it must have those of the topic's type.
    /// `time_ns` becomes both log time and publish time; times before 1970 cannot be written and become 0.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(
        &mut self,
        topic: OutTopic,
        time_ns: i64,
        message: &impl Serialize,
    ) -> Result<(), WriteError> {
        self.encoded.clear();
        self.encoded.extend(ENCAPSULATION);
        // The alignment of CDR counts from behind the encapsulation, as the encoder does.
        let encoded = cdr_encoding::to_writer::<_, LittleEndian, _>(&mut self.encoded, message);
        encoded.map_err(|error| WriteError::Encode {
            path: self.path.clone(),
            problem: error.to_string(),
        })?;
        let time = u64::try_from(time_ns).unwrap_or(0);
        let header = MessageHeader {
            channel_id: topic.0,
            sequence: 0,
            log_time: time,
            publish_time: time,
        };
        let written = self.writer.write_to_known_channel(&header, &self.encoded);
        written.map_err(|e| failed(&self.path, e))
    }

    /// Adds a file to the log.
    ///
    /// # Errors
    /// The log cannot be written.
    pub fn attach(
        &mut self,
        name: &str,
        media_type: &str,
        time_ns: i64,
        content: &[u8],
    ) -> Result<(), WriteError> {
        let time = u64::try_from(time_ns).unwrap_or(0);
        let attachment = Attachment {
            log_time: time,
            create_time: time,
            name: name.into(),
            media_type: media_type.into(),
            data: Cow::Borrowed(content),
        };
        let attached = self.writer.attach(&attachment);
        attached.map_err(|e| failed(&self.path, e))
    }

    /// Adds names and what they mean.
    ///
    /// # Errors
    /// The log cannot be written.
    pub fn metadata(
        &mut self,
        name: &str,
        entries: BTreeMap<String, String>,
    ) -> Result<(), WriteError> {
        let metadata = Metadata {
            name: name.into(),
            metadata: entries,
        };
        let written = self.writer.write_metadata(&metadata);
        written.map_err(|e| failed(&self.path, e))
    }

    /// Ends the log: index, statistics, checksums.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(mut self) -> Result<(), WriteError> {
        let finished = self.writer.finish().and_then(|_| {
            let buffered = self.writer.into_inner().into_inner();
            buffered.map_err(IntoInnerError::into_error)?;
            Ok(())
        });
        finished.map_err(|e| failed(&self.path, e))
    }
}

/// How every MCAP file is written: compressed chunks with checksums and an index.
pub(crate) fn options(profile: &str) -> WriteOptions {
    WriteOptions::new()
        .profile(profile)
        .library(concat!("tipwatch ", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Zstd))
        .compression_threads(0)
        .chunk_size(Some(CHUNK_BYTES))
}

fn failed(path: &Path, source: McapError) -> WriteError {
    WriteError::Write {
        path: path.into(),
        source,
    }
}
