//! Cuts spans of time out of a log: each becomes an MCAP file with every topic, message by message as recorded.
//!
//! A clip also has what a program that starts in the middle of a log would miss: the last message of each latched topic
//! before the span (all different ones of static transforms), and the last small message of each slow topic.

use std::{
    collections::BTreeMap, fs::File, io::BufWriter, ops::ControlFlow, path::PathBuf, sync::Arc,
};

use mcap::{McapError, Writer, records::Metadata};

use super::{
    recover::{self, RecoverError},
    ros2_writer::{self, header},
};
use crate::{
    log::Log,
    message::{Extra, Losses, RawMessage, Topic, TopicId, TopicWriter},
    topics::{MetadataRecord, is_latched, is_static_transform},
};

/// Clips written in one pass over the log: each has a chunk in memory.
const CLIPS_AT_ONCE: usize = 16;
/// A topic without a message for so long after the start of a span is slow (ns).
const SLOW_NS: i64 = 1_000_000_000;
/// Larger messages of slow topics are not carried over.
const MAX_SLOW_BYTES: usize = 64 << 10;
/// Larger messages of latched topics are not carried over.
const MAX_LATCHED_BYTES: usize = 64 << 20;
/// Most different messages of a topic of static transforms.
const MAX_STATIC: usize = 1000;

/// A span of time to cut out.
#[derive(Debug, Clone)]
pub struct ClipRequest {
    /// The new file; an existing one is never overwritten.
    pub path: PathBuf,
    /// First log time (ns).
    pub start_ns: i64,
    /// Last log time (ns).
    pub end_ns: i64,
    /// A record with the origin of the clip.
    pub origin: MetadataRecord,
}

/// A clip that was written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ClipReport {
    /// Messages within the span.
    pub messages: u64,
    /// Messages from before the span: of latched and of slow topics.
    pub carried: u64,
    /// Messages of latched and slow topics that were too large or too many to be carried over.
    pub left_out: u64,
    /// Attachments and metadata records.
    pub extras: u64,
}

/// Writes clips of a log of any format. Payloads, log times, publish times and sequence numbers are those of the log,
/// and definitions and what the log says of the writers of a topic are kept. Returns a report for each clip, and the
/// losses of the log.
///
/// Up to 16 clips are written in one pass over the log, in bounded memory.
///
/// # Errors
/// The log cannot be read, or a new file exists already or cannot be written. Incomplete files are removed.
pub fn write_clips(
    log: &Log,
    clips: &[ClipRequest],
) -> Result<(Vec<ClipReport>, Losses), RecoverError> {
    let mut reports = Vec::with_capacity(clips.len());
    let mut losses = log.losses().clone();
    for some in clips.chunks(CLIPS_AT_ONCE) {
        let (written, found) = write_some(log, some).inspect_err(|_| {
            // the first error is the one that matters
            for clip in &clips[..reports.len()] {
                let _ = std::fs::remove_file(&clip.path);
            }
        })?;
        reports.extend(written);
        losses = found;
    }
    Ok((reports, losses))
}

fn write_some(log: &Log, clips: &[ClipRequest]) -> Result<(Vec<ClipReport>, Losses), RecoverError> {
    let mut cutters: Vec<Cutter> = Vec::with_capacity(clips.len());
    for clip in clips {
        match Cutter::begin(log, clip) {
            Ok(cutter) => cutters.push(cutter),
            Err(error) => {
                remove(&cutters);
                return Err(error);
            }
        }
    }
    cut(log, &mut cutters).inspect_err(|_| remove(&cutters))
}

fn remove(cutters: &[Cutter<'_>]) {
    for cutter in cutters {
        let _ = std::fs::remove_file(&cutter.request.path);
    }
}

fn cut(log: &Log, cutters: &mut [Cutter<'_>]) -> Result<(Vec<ClipReport>, Losses), RecoverError> {
    let ids: Vec<TopicId> = log.topics().iter().map(|topic| topic.id).collect();
    let mut failure = None;
    let losses = log.read(&ids, &mut |message| {
        let mut shared = None;
        for cutter in cutters.iter_mut() {
            if let Err(error) = cutter.take(message, &mut shared) {
                failure = Some(cutter.failed(error));
                return ControlFlow::Break(());
            }
        }
        ControlFlow::Continue(())
    })?;
    log.extras(true, &mut |extra| {
        for cutter in cutters.iter_mut() {
            if failure.is_none()
                && let Err(error) = cutter.extra(&extra)
            {
                failure = Some(cutter.failed(error));
            }
        }
    })?;
    if let Some(failure) = failure {
        return Err(failure);
    }
    let reports = cutters.iter_mut().map(|cutter| {
        let finished = cutter.finish();
        finished.map_err(|error| cutter.failed(error))
    });
    Ok((reports.collect::<Result<_, _>>()?, losses))
}

/// A message from before the span.
struct Held {
    log_time_ns: i64,
    publish_time_ns: i64,
    sequence: u32,
    data: Arc<[u8]>,
}

/// One writer of a topic.
struct Source {
    channel: u16,
    is_latched: bool,
    /// Whether all different messages are held, not only the last.
    is_static: bool,
    held: Vec<Held>,
    /// Whether the last message before the span was too large.
    is_left_out: bool,
    /// The first message within the span (ns).
    first_ns: Option<i64>,
}

/// Writes one clip.
struct Cutter<'r> {
    request: &'r ClipRequest,
    writer: Writer<BufWriter<File>>,
    /// Writers of the topics, by topic and writer.
    sources: Vec<Vec<Source>>,
    /// Whether a message of the span has come: latched messages stand before it.
    is_begun: bool,
    report: ClipReport,
}

impl<'r> Cutter<'r> {
    fn begin(log: &Log, request: &'r ClipRequest) -> Result<Self, RecoverError> {
        let path = request.path.as_path();
        let file = ros2_writer::create(path)?;
        let options = ros2_writer::options(recover::profile(log));
        let begun = options.create(BufWriter::new(file)).and_then(|mut writer| {
            let topics = log.topics().iter();
            let sources = topics.map(|topic| sources_of(&mut writer, topic));
            let sources = sources.collect::<Result<_, _>>()?;
            Ok((writer, sources))
        });
        match begun {
            Ok((writer, sources)) => Ok(Self {
                request,
                writer,
                sources,
                is_begun: false,
                report: ClipReport::default(),
            }),
            Err(source) => {
                let _ = std::fs::remove_file(path);
                Err(ros2_writer::failed(path, source).into())
            }
        }
    }

    fn failed(&self, source: McapError) -> RecoverError {
        ros2_writer::failed(&self.request.path, source).into()
    }

    fn take(
        &mut self,
        message: &RawMessage<'_>,
        shared: &mut Option<Arc<[u8]>>,
    ) -> Result<(), McapError> {
        let time_ns = message.log_time_ns;
        let of_topic = self.sources.get_mut(message.topic.index());
        let Some(source) = of_topic.and_then(|all| all.get_mut(message.writer as usize)) else {
            return Ok(());
        };
        if time_ns < self.request.start_ns {
            let is_new = source.hold(message, shared);
            if is_new && self.is_begun && source.is_latched {
                // out of order in the log: it comes late here, too
                let channel = source.channel;
                self.report.carried += 1;
                return write(&mut self.writer, channel, message);
            }
            return Ok(());
        }
        if time_ns > self.request.end_ns {
            return Ok(());
        }
        source.first_ns = Some(source.first_ns.map_or(time_ns, |first| first.min(time_ns)));
        let channel = source.channel;
        if !std::mem::replace(&mut self.is_begun, true) {
            self.carry(|source| source.is_latched)?;
        }
        self.report.messages += 1;
        write(&mut self.writer, channel, message)
    }

    /// Writes the held messages of some topics.
    fn carry(&mut self, which: impl Fn(&Source) -> bool) -> Result<(), McapError> {
        for source in self.sources.iter().flatten().filter(|source| which(source)) {
            self.report.left_out += u64::from(source.is_left_out);
            for held in &source.held {
                let header = header(
                    source.channel,
                    held.sequence,
                    held.log_time_ns,
                    held.publish_time_ns,
                );
                self.writer.write_to_known_channel(&header, &held.data)?;
                self.report.carried += 1;
            }
        }
        Ok(())
    }

    fn extra(&mut self, extra: &Extra<'_>) -> Result<(), McapError> {
        self.report.extras += 1;
        recover::write_extra(&mut self.writer, extra)
    }

    fn finish(&mut self) -> Result<ClipReport, McapError> {
        let slow_ns = self.request.start_ns.saturating_add(SLOW_NS);
        if !self.is_begun {
            self.carry(|source| source.is_latched)?;
        }
        self.carry(|source| {
            !source.is_latched && source.first_ns.is_none_or(|first| first > slow_ns)
        })?;
        self.writer.write_metadata(&Metadata {
            name: self.request.origin.name.clone(),
            metadata: self.request.origin.values.clone(),
        })?;
        self.writer.finish()?;
        Ok(self.report.clone())
    }
}

impl Source {
    /// Holds a message from before the span, if it is wanted; returns whether it is.
    fn hold(&mut self, message: &RawMessage<'_>, shared: &mut Option<Arc<[u8]>>) -> bool {
        let last = self.held.last();
        if last.is_some_and(|last| last.log_time_ns > message.log_time_ns) && !self.is_static {
            return false;
        }
        let limit = match self.is_latched {
            true => MAX_LATCHED_BYTES,
            false => MAX_SLOW_BYTES,
        };
        self.is_left_out = message.data.len() > limit;
        if self.is_static {
            // a publisher may repeat itself; the others' messages stay
            self.held.retain(|held| *held.data != *message.data);
            self.is_left_out |= self.held.len() >= MAX_STATIC;
            if self.held.len() >= MAX_STATIC {
                self.held.remove(0);
            }
        } else {
            self.held.clear();
        }
        if message.data.len() > limit {
            return false;
        }
        let data = shared.get_or_insert_with(|| message.data.into());
        self.held.push(Held {
            log_time_ns: message.log_time_ns,
            publish_time_ns: message.publish_time_ns,
            sequence: message.sequence,
            data: Arc::clone(data),
        });
        true
    }
}

fn sources_of(
    writer: &mut Writer<BufWriter<File>>,
    topic: &Topic,
) -> Result<Vec<Source>, McapError> {
    let channels = recover::add_channels(writer, topic)?.into_iter();
    let is_static = is_static_transform(&topic.name);
    let nothing = BTreeMap::new();
    let source = |(index, channel): (usize, u16)| {
        let says = topic
            .writers
            .get(index)
            .map_or(&nothing, |of: &TopicWriter| &of.says);
        Source {
            channel,
            is_latched: is_static || is_latched(&topic.name, says),
            is_static,
            held: Vec::new(),
            is_left_out: false,
            first_ns: None,
        }
    };
    Ok(channels.enumerate().map(source).collect())
}

fn write(
    writer: &mut Writer<BufWriter<File>>,
    channel: u16,
    message: &RawMessage<'_>,
) -> Result<(), McapError> {
    let header = header(
        channel,
        message.sequence,
        message.log_time_ns,
        message.publish_time_ns,
    );
    writer.write_to_known_channel(&header, message.data)
}
