//! Writes the intact part of a log as a clean, indexed MCAP file.

use std::{collections::BTreeMap, fs::File, io::BufWriter, ops::ControlFlow, path::Path};

use mcap::{McapError, Writer, records::Metadata};
use serde::Serialize;

use super::ros2_writer::{self, WriteError, header};
use crate::{
    log::Log,
    message::{Error, Extra, Losses, RawMessage, Topic, TopicId, TopicWriter},
    schema::Dialect,
    topics::MetadataRecord,
};

/// Error: the recovery of a log failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecoverError {
    /// The log cannot be read at all.
    #[error(transparent)]
    Log(#[from] Error),
    /// The new file cannot be created or written; an existing one is never overwritten.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Counts of the recovered messages, and the losses.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct RecoveryReport {
    /// Messages written, by topic name.
    pub messages: BTreeMap<String, u64>,
    /// Attachments and metadata records written.
    pub extras: u64,
    /// The size of the new file.
    pub bytes_written: u64,
    /// The losses of the log.
    pub losses: Losses,
}

impl RecoveryReport {
    /// The number of messages written.
    pub fn message_count(&self) -> u64 {
        self.messages.values().sum()
    }
}

/// Writes every intact message of a log of any format to a new MCAP file, in the order of the log,
/// with its times, its definitions and what the log says of its writer, in chunks with checksums and an index.
///
/// Messages are copied in encoded form, so no definitions are needed.
///
/// # Errors
/// The log cannot be read, or the new file exists already or cannot be written. An incomplete file
/// is removed.
pub fn recover(log: &Log, out: &Path) -> Result<RecoveryReport, RecoverError> {
    recover_with(log, out, &|_| None)
}

/// Recovers a log as [`recover`] does; `record` makes a metadata record from the losses, which is written last: the origin of the
/// new file.
///
/// # Errors
/// As for [`recover`].
pub fn recover_with(
    log: &Log,
    out: &Path,
    record: &dyn Fn(&Losses) -> Option<MetadataRecord>,
) -> Result<RecoveryReport, RecoverError> {
    let file = ros2_writer::create(out)?;
    let result = write_all(log, file, out, record);
    if result.is_err() {
        // The first error is the one that matters.
        let _ = std::fs::remove_file(out);
    }
    result
}

fn write_all(
    log: &Log,
    file: File,
    out: &Path,
    record: &dyn Fn(&Losses) -> Option<MetadataRecord>,
) -> Result<RecoveryReport, RecoverError> {
    let failed = |source| ros2_writer::failed(out, source);
    let mut recovery = Recovery::begin(log, file).map_err(failed)?;
    let ids: Vec<TopicId> = log.topics().iter().map(|topic| topic.id).collect();
    let mut failure = None;
    let losses = log.read(&ids, &mut |message| match recovery.message(message) {
        Ok(()) => ControlFlow::Continue(()),
        Err(error) => {
            failure = Some(error);
            ControlFlow::Break(())
        }
    })?;
    log.extras(true, &mut |extra| {
        if failure.is_none() {
            recovery.extras += 1;
            failure = write_extra(&mut recovery.writer, &extra).err();
        }
    })?;
    if let Some(source) = failure {
        return Err(failed(source).into());
    }
    if let Some(record) = record(&losses) {
        let metadata = Metadata {
            name: record.name,
            metadata: record.values,
        };
        let origin = recovery.writer.write_metadata(&metadata);
        origin.map_err(failed)?;
    }
    let mut report = recovery.finish(log).map_err(failed)?;
    report.losses = losses;
    report.bytes_written = std::fs::metadata(out)
        .map_err(|source| failed(McapError::Io(source)))?
        .len();
    Ok(report)
}

struct Recovery {
    writer: Writer<BufWriter<File>>,
    /// The channels of each topic, by writer.
    channels: Vec<Vec<u16>>,
    counts: Vec<u64>,
    extras: u64,
}

impl Recovery {
    fn begin(log: &Log, file: File) -> Result<Self, McapError> {
        let options = ros2_writer::options(profile(log));
        let mut writer = options.create(BufWriter::new(file))?;
        let channels = log
            .topics()
            .iter()
            .map(|topic| add_channels(&mut writer, topic))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            writer,
            channels,
            counts: vec![0; log.topics().len()],
            extras: 0,
        })
    }

    fn message(&mut self, message: &RawMessage<'_>) -> Result<(), McapError> {
        let index = message.topic.index();
        let channels = self.channels.get(index).map_or(&[][..], Vec::as_slice);
        let channel = channels.get(message.writer as usize).or(channels.first());
        let channel = channel.copied().unwrap_or_default();
        let (log_ns, publish_ns) = (message.log_time_ns, message.publish_time_ns);
        let header = header(channel, message.sequence, log_ns, publish_ns);
        if let Some(count) = self.counts.get_mut(index) {
            *count += 1;
        }
        self.writer.write_to_known_channel(&header, message.data)
    }

    fn finish(mut self, log: &Log) -> Result<RecoveryReport, McapError> {
        self.writer.finish()?;
        let buffered = self.writer.into_inner();
        let file = buffered
            .into_inner()
            .map_err(std::io::IntoInnerError::into_error)?;
        file.sync_all()?;
        let mut messages = BTreeMap::new();
        for (topic, count) in log.topics().iter().zip(&self.counts) {
            *messages.entry(topic.name.clone()).or_default() += count;
        }
        Ok(RecoveryReport {
            messages,
            extras: self.extras,
            ..RecoveryReport::default()
        })
    }
}

pub(super) fn write_extra(
    writer: &mut Writer<BufWriter<File>>,
    extra: &Extra<'_>,
) -> Result<(), McapError> {
    match extra {
        Extra::Attachment(attachment) => writer.attach(attachment),
        Extra::Metadata(metadata) => writer.write_metadata(metadata),
    }
}

/// The profile of the new file.
pub(super) fn profile(log: &Log) -> &'static str {
    let is_ros1 = log.topics().iter().any(|topic| topic.encoding == "ros1");
    let is_ros2 = log.topics().iter().any(|topic| topic.encoding == "cdr");
    match (is_ros1, is_ros2) {
        (true, false) => "ros1",
        (false, true) => "ros2",
        _ => "",
    }
}

/// Adds a channel for each writer of a topic; one if the log does not distinguish them.
pub(super) fn add_channels(
    writer: &mut Writer<BufWriter<File>>,
    topic: &Topic,
) -> Result<Vec<u16>, McapError> {
    let none = [TopicWriter::default()];
    let writers = match topic.writers.as_slice() {
        [] => &none[..],
        writers => writers,
    };
    let channels = writers.iter().map(|of| add_channel(writer, topic, of));
    channels.collect()
}

/// Adds the channel of a writer of a topic: its definition as recorded, and the log's record of the writer.
fn add_channel(
    writer: &mut Writer<BufWriter<File>>,
    topic: &Topic,
    of: &TopicWriter,
) -> Result<u16, McapError> {
    let schema = match &of.schema {
        Some(schema) => writer.add_schema(&topic.type_name, &schema.encoding, &schema.data)?,
        None if topic.type_name.is_empty() => 0,
        None => {
            let data = topic.definition.as_deref().unwrap_or_default();
            writer.add_schema(&topic.type_name, language(topic), data.as_bytes())?
        }
    };
    writer.add_channel(schema, &topic.name, &topic.encoding, &of.says)
}

/// The language of a definition, also of one that the log lacks: readers look at it before the text.
fn language(topic: &Topic) -> &str {
    match Dialect::of_encoding(&topic.encoding) {
        _ if !topic.schema_encoding.is_empty() => &topic.schema_encoding,
        Some(Dialect::Ros1) => "ros1msg",
        Some(Dialect::Ros2) => "ros2msg",
        None => "",
    }
}
