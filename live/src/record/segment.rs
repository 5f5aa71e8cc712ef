//! One MCAP file: short chunks with checksums, each in the file with one write.
//!
//! A process that is killed leaves every chunk that was written; `tipwatch recover` and every reader
//! that does not insist on an index read them. A disk that fails loses what was not synced.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use anyhow::{Context, Result};
use mcap::records::MessageHeader;
use mcap::{Attachment, WriteOptions, Writer};

use super::pending::Encoded;
use super::topics::Topic;

/// More than a batch has, so that a chunk ends where a batch does.
const CHUNK_BYTES: u64 = 1 << 20;

/// What stands at the beginning of every file of a session.
#[derive(Debug, Clone)]
pub(super) struct Preamble {
    /// Topics, by channel.
    pub(super) topics: Vec<Topic>,
    pub(super) channels: Channels,
    /// Name and content of the machine file and the URDF.
    pub(super) attachments: [(String, String); 2],
    pub(super) metadata: BTreeMap<String, String>,
    pub(super) begun_ns: i64,
}

/// Channels of what is no sample; the sensors come before them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Channels {
    pub(super) verdicts: usize,
    pub(super) commands: usize,
    pub(super) gaps: usize,
}

/// A file being written.
pub(super) struct Segment {
    pub(super) path: PathBuf,
    file: File,
    /// Bytes of the file that are whole chunks.
    written: u64,
    writer: Writer<Batch>,
    batch: Batch,
    channels: Vec<u16>,
}

impl Segment {
    /// Begins a file, which must not exist yet.
    pub(super) fn begin(path: PathBuf, preamble: &Preamble) -> Result<Self> {
        let file = File::create_new(&path)
            .with_context(|| format!("{}: cannot be created", path.display()))?;
        let batch = Batch::default();
        let mut writer = WriteOptions::new()
            .profile("ros2")
            .library(concat!("tipwatch ", env!("CARGO_PKG_VERSION")))
            .compression(None)
            .chunk_size(Some(CHUNK_BYTES))
            .use_chunks(true)
            .disable_seeking(true)
            .create(batch.clone())?;
        for (name, text) in &preamble.attachments {
            writer.attach(&Attachment {
                log_time: preamble.begun_ns.unsigned_abs(),
                create_time: preamble.begun_ns.unsigned_abs(),
                name: name.clone(),
                media_type: "text/plain".into(),
                data: text.as_bytes().into(),
            })?;
        }
        writer.write_metadata(&mcap::records::Metadata {
            name: "tipwatch".into(),
            metadata: preamble.metadata.clone(),
        })?;
        let channels = preamble.topics.iter().map(|topic| {
            let schema =
                writer.add_schema(topic.type_name, "ros2msg", topic.definition.as_bytes())?;
            writer.add_channel(schema, &topic.name, "cdr", &BTreeMap::new())
        });
        let channels = channels.collect::<Result<_, _>>()?;
        let mut segment = Self {
            path,
            file,
            written: 0,
            writer,
            batch,
            channels,
        };
        if let Err(error) = segment.flush() {
            let _ = std::fs::remove_file(&segment.path);
            return Err(error);
        }
        Ok(segment)
    }

    /// Another handle of the file, to sync it elsewhere.
    pub(super) fn file(&self) -> io::Result<File> {
        self.file.try_clone()
    }

    pub(super) fn add(&mut self, channel: usize, message: &Encoded) -> Result<()> {
        let header = MessageHeader {
            channel_id: self.channels[channel],
            sequence: message.sequence,
            log_time: message.log_time_ns.unsigned_abs(),
            publish_time: message.publish_time_ns.unsigned_abs(),
        };
        Ok(self.writer.write_to_known_channel(&header, &message.data)?)
    }

    /// Puts what was added into the file, as one chunk; nothing of it if that fails.
    pub(super) fn flush(&mut self) -> Result<()> {
        self.writer.flush()?;
        self.write_batch()
    }

    /// Ends the file with its index.
    pub(super) fn finish(mut self) -> Result<()> {
        self.writer.finish()?;
        self.write_batch()?;
        let synced = self.file.sync_all();
        synced.with_context(|| format!("{}: cannot be synced", self.path.display()))
    }

    fn write_batch(&mut self) -> Result<()> {
        let bytes = self.batch.take();
        if let Err(error) = self.file.write_all(&bytes) {
            // What is torn is no chunk.
            let _ = self.file.set_len(self.written);
            let _ = self.file.seek(SeekFrom::Start(self.written));
            return Err(error)
                .with_context(|| format!("{}: cannot be written", self.path.display()));
        }
        self.written += bytes.len() as u64;
        Ok(())
    }
}

/// Makes a new name in a folder durable.
pub(super) fn sync_folder(folder: &Path) {
    if let Ok(folder) = File::open(folder) {
        // Some file systems have nothing to sync there.
        let _ = folder.sync_all();
    }
}

/// Bytes on their way into the file.
#[derive(Debug, Clone, Default)]
struct Batch(Rc<RefCell<Bytes>>);

#[derive(Debug, Default)]
struct Bytes {
    bytes: Vec<u8>,
    taken: u64,
}

impl Batch {
    fn take(&self) -> Vec<u8> {
        let mut inner = self.0.borrow_mut();
        inner.taken += inner.bytes.len() as u64;
        std::mem::take(&mut inner.bytes)
    }
}

impl Write for Batch {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().bytes.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Batch {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let inner = self.0.borrow();
        let here = inner.taken + inner.bytes.len() as u64;
        match to {
            SeekFrom::Current(0) | SeekFrom::End(0) => Ok(here),
            SeekFrom::Start(start) if start == here => Ok(here),
            _ => Err(io::ErrorKind::Unsupported.into()),
        }
    }
}
