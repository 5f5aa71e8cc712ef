//! Writes ROS 2 messages to an MCAP file: encoded as CDR (Common Data Representation), with
//! embedded definitions.

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

use crate::schema::{CDR, Dialect, builtin};

/// Small enough to lose little with a chunk, large enough to compress well.
const CHUNK_BYTES: u64 = 1 << 20;

/// Error: a log could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The file cannot be created; an existing one is never overwritten.
    #[error("{}: cannot be created: {source}", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: IoError,
    },
    /// The file cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Error of the MCAP writer.
        source: McapError,
    },
    /// A message cannot be encoded.
    #[error("{}: cannot be written: {problem}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// Reason why the message cannot be encoded.
        problem: String,
    },
    /// The type is not built in, and no definition was given.
    #[error("\"{type_name}\": expected a built-in message type, or its definition")]
    UnknownType {
        /// The type.
        type_name: String,
    },
}

/// A topic of a [`Ros2Writer`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WriterTopic(u16);

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
        let file = create(path)?;
        // higher levels gain nothing on measured floating-point numbers
        let options = options("ros2").compression_level(1);
        let writer = options.create(BufWriter::with_capacity(1 << 18, file));
        Ok(Self {
            writer: writer.map_err(|source| failed(path, source))?,
            path: path.into(),
            encoded: Vec::new(),
        })
    }

    /// Adds a topic. `fields` is the text of the type's `.msg` file, which may use built-in types;
    /// it can be omitted for a built-in type.
    ///
    /// # Errors
    /// The type is unknown, or the file cannot be written.
    pub fn topic(
        &mut self,
        name: &str,
        type_name: &str,
        fields: Option<&str>,
    ) -> Result<WriterTopic, WriteError> {
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
        channel.map(WriterTopic).map_err(|e| failed(&self.path, e))
    }

    /// Writes a message, whose fields must be those of the topic's type, in the same order.
    /// `time_ns` becomes both log time and publish time; times before 1970 become 0.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(
        &mut self,
        topic: WriterTopic,
        time_ns: i64,
        message: &impl Serialize,
    ) -> Result<(), WriteError> {
        self.encoded.clear();
        self.encoded.extend(CDR);
        // CDR alignment counts from the end of the encapsulation header, like the encoder.
        let encoded = cdr_encoding::to_writer::<_, LittleEndian, _>(&mut self.encoded, message);
        encoded.map_err(|error| WriteError::Encode {
            path: self.path.clone(),
            problem: error.to_string(),
        })?;
        let header = header(topic.0, 0, time_ns, time_ns);
        let written = self.writer.write_to_known_channel(&header, &self.encoded);
        written.map_err(|e| failed(&self.path, e))
    }

    /// Adds an attachment.
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

    /// Adds a metadata record.
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

    /// Completes the log with index, statistics and checksums.
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

/// Times before 1970 cannot be written and become 0.
pub(super) fn header(
    channel_id: u16,
    sequence: u32,
    log_time_ns: i64,
    publish_time_ns: i64,
) -> MessageHeader {
    MessageHeader {
        channel_id,
        sequence,
        log_time: u64::try_from(log_time_ns).unwrap_or(0),
        publish_time: u64::try_from(publish_time_ns).unwrap_or(0),
    }
}

/// Options of every MCAP file: compressed chunks with checksums and an index.
pub(crate) fn options(profile: &str) -> WriteOptions {
    WriteOptions::new()
        .profile(profile)
        .library(concat!("tipwatch ", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Zstd))
        .compression_threads(0)
        .chunk_size(Some(CHUNK_BYTES))
}

/// Begins a file that does not exist yet.
pub(super) fn create(path: &Path) -> Result<File, WriteError> {
    File::create_new(path).map_err(|source| WriteError::Create {
        path: path.into(),
        source,
    })
}

pub(super) fn failed(path: &Path, source: McapError) -> WriteError {
    WriteError::Write {
        path: path.into(),
        source,
    }
}
