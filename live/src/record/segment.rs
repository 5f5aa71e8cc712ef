//! One MCAP file: short chunks with checksums, each written with one system call.
//!
//! Every write ends with the end of a file without index, which the next one overwrites: a killed process leaves a
//! complete file that every reader opens. A power failure loses what was not synced.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::os::unix::fs::{FileExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use anyhow::{Context, Result};
use mcap::records::MessageHeader;
use mcap::{Attachment, WriteOptions, Writer};

use super::pending::{Encoded, Kind};
use super::topics::Topic;

/// Larger than a batch, so that a chunk ends where a batch ends.
const CHUNK_BYTES: u64 = 1 << 20;

/// First and last bytes of every MCAP file.
pub(super) const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";

/// End of a file without index: the end of the data (opcode 15, without checksum), a footer (opcode 2) that knows of no
/// summary, and the magic bytes.
pub(super) const ENDING: [u8; 50] = {
    let mut ending = [0; 50];
    (ending[0], ending[1]) = (0x0f, 4);
    (ending[13], ending[14]) = (0x02, 20);
    let mut at = 0;
    while at < MAGIC.len() {
        ending[42 + at] = MAGIC[at];
        at += 1;
    }
    ending
};

/// Beginning of every file of a session.
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

/// Channels of other messages than samples; those of the sensors stand before them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Channels {
    pub(super) verdicts: usize,
    pub(super) commands: usize,
    pub(super) gaps: usize,
    pub(super) programs: usize,
}

impl Channels {
    /// The channel of a message of this kind.
    pub(super) fn of(self, kind: Kind) -> usize {
        match kind {
            Kind::Sample(sensor) => sensor,
            Kind::Verdict { .. } => self.verdicts,
            Kind::Command => self.commands,
            Kind::Gap => self.gaps,
            Kind::Program => self.programs,
        }
    }
}

/// A file being written.
pub(super) struct Segment {
    pub(super) path: PathBuf,
    file: File,
    /// Device and number of the file: the path may come to name another.
    identity: (u64, u64),
    /// Bytes of complete chunks in the file.
    pub(super) written: u64,
    writer: Writer<Batch>,
    batch: Batch,
    channels: Vec<u16>,
}

impl Segment {
    /// Creates a file, which must not exist yet.
    pub(super) fn begin(path: PathBuf, preamble: &Preamble) -> Result<Self> {
        let file = File::create_new(&path)
            .with_context(|| format!("{}: cannot create it", path.display()))?;
        // a recorder that starts beside this one leaves the file alone
        let _ = file.try_lock();
        let metadata = file.metadata()?;
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
            identity: (metadata.dev(), metadata.ino()),
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

    /// Another handle of the file, to sync it in another thread.
    pub(super) fn file(&self) -> io::Result<File> {
        self.file.try_clone()
    }

    /// The file itself, whatever its path names.
    pub(super) fn place(&self) -> Place {
        Place {
            path: self.path.clone(),
            identity: self.identity,
        }
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

    /// Writes the added messages as one chunk. If that fails, nothing of it stays in the file.
    pub(super) fn flush(&mut self) -> Result<()> {
        self.writer.flush()?;
        self.write_batch(&ENDING)
    }

    /// Adds a record of keys and values.
    pub(super) fn note(&mut self, name: &str, metadata: BTreeMap<String, String>) -> Result<()> {
        let name = name.into();
        let record = mcap::records::Metadata { name, metadata };
        Ok(self.writer.write_metadata(&record)?)
    }

    /// Finishes the file with its index.
    pub(super) fn finish(mut self) -> Result<()> {
        self.writer.finish()?;
        self.write_batch(&[])?;
        let synced = self.file.sync_all();
        synced.with_context(|| format!("{}: cannot sync it", self.path.display()))
    }

    /// Writes what waits, and this end behind it, with one call.
    fn write_batch(&mut self, ending: &[u8]) -> Result<()> {
        let mut bytes = self.batch.take();
        let added = bytes.len() as u64;
        bytes.extend_from_slice(ending);
        if let Err(error) = self.file.write_all_at(&bytes, self.written) {
            // a partial chunk is removed
            let _ = self.file.set_len(self.written);
            let _ = self.file.write_all_at(&ENDING, self.written);
            return Err(error).with_context(|| format!("{}: cannot write it", self.path.display()));
        }
        self.written += added;
        Ok(())
    }
}

/// A file and its path.
#[derive(Debug, Clone)]
pub(super) struct Place {
    pub(super) path: PathBuf,
    identity: (u64, u64),
}

impl Place {
    /// Whether the path still names the file: nobody has removed or replaced it, or a folder above it.
    pub(super) fn holds(&self) -> bool {
        let metadata = std::fs::metadata(&self.path);
        metadata.is_ok_and(|found| (found.dev(), found.ino()) == self.identity)
    }
}

/// Makes a new file name in a folder durable.
pub(super) fn sync_folder(folder: &Path) {
    if let Ok(folder) = File::open(folder) {
        // some file systems cannot sync folders
        let _ = folder.sync_all();
    }
}

/// Bytes that wait to be written to the file.
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
