//! A log opened for reading.

use std::{
    cell::Cell,
    collections::BTreeMap,
    fmt,
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use super::{
    can_topics::{CanPass, CanTopic, CanTopics},
    log_files::LogFiles,
    packed_messages::{self, Unpacker},
    rosbag2_folder,
};
use tipwatch_can::Frame;

use crate::{
    decode::{FrameDecoder, is_can_frame},
    file::{FileTransfer, Format, LONGEST_MAGIC_BYTES, LogFile, ReadOptions, Source, read_options},
    formats::{Batch, Batches, FileReader, Request, open},
    message::{Error, Extra, Losses, LostPart, LostRange, RawMessage, Topic, TopicId, TopicTable},
    schema::GivenDefinitions,
};

/// Creates batches, and is called after each delivery of one.
type BatchSource<'b> = (&'b (dyn Fn() -> Box<dyn Batch> + Sync), &'b dyn Fn());

/// A log opened for reading. Its files are never modified, and no file is created beside them.
pub struct Log {
    path: PathBuf,
    format: Format,
    files: Vec<PathBuf>,
    file_bytes: Vec<u64>,
    readers: Vec<Box<dyn FileReader>>,
    /// Keeps temporary files alive while they are read.
    opened: Vec<LogFile>,
    topics: Vec<Topic>,
    losses: Losses,
    /// Whether messages may be compressed one by one.
    has_packed_messages: bool,
    /// Messages the recorder reports having written, by topic; empty if it reports none.
    declared_counts: BTreeMap<String, u64>,
    can: CanTopics,
}

impl Log {
    /// Opens a file or a rosbag2 folder. The format is detected from the content, not the name.
    ///
    /// A path may also be a URL: `s3://`, `gs://`, `az://`, `https://`, `http://` or `file://`
    /// ([`tipwatch_storage::Location`]). Of a file with an index only the parts that are needed are transferred. Other
    /// files are transferred as a whole, if [`tipwatch_storage::set_whole_reads`] allows it.
    ///
    /// What the log does not state itself is read as [`set_read_options`](crate::set_read_options) stated for the
    /// process.
    pub fn open(path: &Path) -> Result<Log, Error> {
        Self::open_with(path, &read_options())
    }

    /// Opens a log of which something is known that it does not state itself.
    ///
    /// # Errors
    /// The log cannot be read.
    pub fn open_with(path: &Path, options: &ReadOptions) -> Result<Log, Error> {
        let (source, path) = Source::of(path, options)?;
        let path = path.as_path();
        let LogFiles {
            format,
            files,
            mut losses,
            has_packed_messages,
            declared_counts,
            left_out,
        } = recognise(path, &source)?;
        let has_damaged_beginning = !losses.is_empty();
        let given = GivenDefinitions::find(&options.definitions)
            .map_err(|(path, problem)| Error::Definitions { path, problem })?;
        let mut topics = TopicTable::new(given);
        let mut readers = Vec::with_capacity(files.len());
        let mut file_bytes = Vec::with_capacity(files.len());
        let mut opened = Vec::with_capacity(files.len());
        for path in &files {
            let file = source.open(path, &mut losses)?;
            let reader = open(format, &file, source.options(), &mut topics, &mut losses)?;
            readers.push(reader);
            let metadata = std::fs::metadata(file.data()).map_err(Error::io(path))?;
            file_bytes.push(metadata.len());
            opened.push(file);
        }
        for (behind, lost) in left_out {
            let span_ns = |at: Option<usize>| readers.get(at?)?.span_ns();
            losses.push(LostRange {
                first_time_ns: span_ns(behind.checked_sub(1)).map(|(_, last)| last),
                last_time_ns: span_ns(Some(behind)).map(|(first, _)| first),
                ..lost
            });
        }
        let topics = topics.into_topics();
        if topics.is_empty() && has_damaged_beginning {
            // Only the file name suggested a log.
            source.format_of(path)?;
        }
        let can_be_packed = matches!(format, Format::Mcap | Format::Rosbag2Sqlite);
        let first = readers
            .first()
            .filter(|_| can_be_packed && !source.is_remote());
        let has_packed_messages = has_packed_messages.unwrap_or_else(|| {
            first.is_some_and(|reader| packed_messages::has_packed_messages(&**reader, &topics))
        });
        Ok(Log {
            path: path.to_path_buf(),
            format,
            files,
            file_bytes,
            readers,
            opened,
            topics,
            losses,
            has_packed_messages,
            declared_counts,
            can: CanTopics::default(),
        })
    }

    /// Makes CAN messages topics: their frames are decoded while they are read, and every signal is a number in SI
    /// units where its unit is known. What did not become a number is told in the notes of the losses.
    ///
    /// # Errors
    /// The log has no such bus, or several and none is named.
    pub fn decode_can(&mut self, wanted: &[CanTopic]) -> Result<(), Error> {
        for topic in wanted {
            self.can.add(topic, &mut self.topics)?;
            for note in &topic.notes {
                self.losses.note(note.clone());
            }
        }
        Ok(())
    }

    /// The path that was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The format of the files.
    pub fn format(&self) -> Format {
        self.format
    }

    /// The files, in the order of reading.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// The decompressed size of all files.
    pub fn bytes(&self) -> u64 {
        self.file_bytes.iter().sum()
    }

    /// Returns the path of the file on this computer that has all bytes of each file, in the order of [`files`](Self::files);
    /// `None` for a file of which only parts were transferred.
    pub fn whole_files(&self) -> Vec<Option<&Path>> {
        self.opened.iter().map(LogFile::whole).collect()
    }

    /// Returns the requests and bytes that reading has taken so far, for each file of a bucket or server; empty for a local log.
    pub fn transfers(&self) -> Vec<FileTransfer> {
        self.opened.iter().filter_map(LogFile::transfer).collect()
    }

    /// All topics, in the order in which they were found.
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// One topic.
    pub fn topic(&self, id: TopicId) -> Result<&Topic, Error> {
        self.topics.get(id.0).ok_or_else(|| Error::NoSuchTopic {
            path: self.path.clone(),
            index: id.0,
            count: self.topics.len(),
        })
    }

    /// The topics that carry CAN frames.
    pub fn can_buses(&self) -> impl Iterator<Item = &Topic> {
        let is_bus = |topic: &&Topic| is_can_frame(&topic.type_name);
        self.topics.iter().filter(is_bus)
    }

    /// Calls `visit` with every frame on a topic of CAN frames, in file order. The channel of the frames is 0.
    ///
    /// # Errors
    /// The topic carries no frames, or the log cannot be read. Damage is reported in the losses.
    pub fn read_can_frames(
        &self,
        bus: TopicId,
        visit: &mut dyn FnMut(&Frame),
    ) -> Result<Losses, Error> {
        let topic = self.topic(bus)?;
        let mut decoder = FrameDecoder::new(topic)?;
        let mut frame = Frame::default();
        let mut undecodable = 0;
        let mut losses = self.read(&[bus], &mut |message| {
            match decoder.decode(message.data, &mut frame) {
                Ok(Some(_)) => {
                    frame.time_ns = message.log_time_ns;
                    visit(&frame);
                }
                _ => undecodable += 1,
            }
            ControlFlow::Continue(())
        })?;
        for _ in 0..undecodable {
            losses.count_undecodable(&topic.name);
        }
        Ok(losses)
    }

    /// Damage found while opening. Opening scans the whole log only if it has no intact index.
    pub fn losses(&self) -> &Losses {
        &self.losses
    }

    /// Log times (ns) of the first and the last message of all topics; `None` if unknown.
    ///
    /// Where a file has an index, its statements are used: they include messages that were lost.
    pub fn span_ns(&self) -> Option<(i64, i64)> {
        let spans = self.readers.iter().filter_map(|reader| reader.span_ns());
        spans.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// Calls `visit` with every intact message of the wanted topics, in file order, until it
    /// returns `Break`.
    ///
    /// The losses returned are those found while opening and while reading. Chunks without a wanted
    /// topic are skipped where an index lists their topics; they are then not verified.
    pub fn read(
        &self,
        wanted: &[TopicId],
        visit: &mut dyn FnMut(&RawMessage<'_>) -> ControlFlow<()>,
    ) -> Result<Losses, Error> {
        self.read_with_progress(wanted, visit, &mut |_| {})
    }

    /// Like [`read`](Self::read); also calls `progress` from time to time with the number of bytes
    /// read so far, which reaches [`bytes`](Self::bytes) unless `visit` breaks.
    pub fn read_with_progress(
        &self,
        wanted: &[TopicId],
        visit: &mut dyn FnMut(&RawMessage<'_>) -> ControlFlow<()>,
        progress: &mut dyn FnMut(u64),
    ) -> Result<Losses, Error> {
        self.read_in_batches(wanted, visit, progress, None)
    }

    /// Like [`read_with_progress`](Self::read_with_progress); given a factory of batches, most
    /// messages go to batches instead of `visit`. The second function is called after each delivery
    /// of a batch, by this thread.
    pub(crate) fn read_in_batches(
        &self,
        wanted: &[TopicId],
        visit: &mut dyn FnMut(&RawMessage<'_>) -> ControlFlow<()>,
        progress: &mut dyn FnMut(u64),
        batches: Option<BatchSource<'_>>,
    ) -> Result<Losses, Error> {
        let wanted = self.wanted_flags(wanted)?;
        if let Some(pass) = self.can.pass(&wanted) {
            return self.read_can(&wanted, pass, visit, progress);
        }
        if self.declared_counts.is_empty() {
            let batches = batches.map(|(empty, delivered)| Batches {
                empty,
                delivered,
                came: &|_, _| {},
            });
            return Ok(self.read_files(&wanted, visit, progress, batches)?.0);
        }
        let seen = vec![Cell::new(0); self.topics.len()];
        let count = |topic: TopicId, messages: u64| {
            seen[topic.0].set(seen[topic.0].get() + messages);
        };
        let mut count_and_visit = |message: &RawMessage<'_>| {
            count(message.topic, 1);
            visit(message)
        };
        let batches = batches.map(|(empty, delivered)| Batches {
            empty,
            delivered,
            came: &count,
        });
        let (mut losses, flow) =
            self.read_files(&wanted, &mut count_and_visit, progress, batches)?;
        if flow.is_continue() {
            self.report_missing(&wanted, &seen, &mut losses);
        }
        Ok(losses)
    }

    /// Returns the decoder of the CAN messages among the wanted topics, for frames that come one at a time; `None` if no wanted
    /// topic is a CAN message.
    pub(crate) fn can_pass(&self, wanted: &[TopicId]) -> Result<Option<CanPass>, Error> {
        Ok(self.can.pass(&self.wanted_flags(wanted)?))
    }

    /// Reads with CAN messages among the wanted topics: one message after the other, because what a frame means may
    /// depend on those before it.
    fn read_can(
        &self,
        wanted: &[bool],
        mut pass: CanPass,
        visit: &mut dyn FnMut(&RawMessage<'_>) -> ControlFlow<()>,
        progress: &mut dyn FnMut(u64),
    ) -> Result<Losses, Error> {
        let of_files = |topic: &TopicId| !self.can.has(*topic);
        let is_wanted = |topic: &TopicId| wanted.get(topic.0).copied().unwrap_or(false);
        let all = self.topics.iter().map(|topic| topic.id);
        let mut read: Vec<TopicId> = all.filter(is_wanted).filter(of_files).collect();
        read.extend(pass.buses());
        let mut is_broken = false;
        let mut decode = |message: &RawMessage<'_>| {
            let flow = pass.visit(message, visit);
            is_broken = flow.is_break();
            flow
        };
        let mut losses = self.read_in_batches(&read, &mut decode, progress, None)?;
        if !is_broken {
            pass.finish(&mut losses)?;
        }
        Ok(losses)
    }

    fn read_files(
        &self,
        wanted: &[bool],
        visit: &mut dyn FnMut(&RawMessage<'_>) -> ControlFlow<()>,
        progress: &mut dyn FnMut(u64),
        batches: Option<Batches<'_>>,
    ) -> Result<(Losses, ControlFlow<()>), Error> {
        let mut losses = self.losses.clone();
        if !self.has_packed_messages {
            let flow = self.read_each(wanted, visit, progress, batches, &mut losses)?;
            return Ok((losses, flow));
        }
        let mut unpacker = Unpacker::default();
        let mut unpack = |message: &RawMessage<'_>| unpacker.visit(message, visit);
        let flow = self.read_each(wanted, &mut unpack, progress, None, &mut losses)?;
        unpacker.report(&self.topics, &mut losses);
        Ok((losses, flow))
    }

    fn read_each(
        &self,
        wanted: &[bool],
        visit: &mut dyn FnMut(&RawMessage<'_>) -> ControlFlow<()>,
        progress: &mut dyn FnMut(u64),
        batches: Option<Batches<'_>>,
        losses: &mut Losses,
    ) -> Result<ControlFlow<()>, Error> {
        let mut bytes_before = 0;
        for (reader, bytes) in self.readers.iter().zip(&self.file_bytes) {
            let mut request = Request {
                wanted,
                visit: &mut *visit,
                progress: &mut *progress,
                bytes_before,
                losses: &mut *losses,
                batches,
            };
            if reader.read(&mut request)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
            bytes_before += bytes;
            progress(bytes_before);
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Compares the messages found with those the recorder reports having written.
    fn report_missing(&self, wanted: &[bool], seen: &[Cell<u64>], losses: &mut Losses) {
        for (name, &declared_counts) in &self.declared_counts {
            let of_name = || self.topics.iter().filter(|topic| topic.name == *name);
            if !of_name().all(|topic| wanted[topic.id.0]) || of_name().next().is_none() {
                continue;
            }
            let came: u64 = of_name().map(|topic| seen[topic.id.0].get()).sum();
            if declared_counts > came {
                losses.miss(name, declared_counts - came);
            }
        }
    }

    /// Passes metadata records to `take`, and attachments if they are wanted. Of a local file, attachments come always.
    pub(crate) fn extras(
        &self,
        with_attachments: bool,
        take: &mut dyn FnMut(Extra<'_>),
    ) -> Result<(), Error> {
        self.readers
            .iter()
            .try_for_each(|reader| reader.extras(with_attachments, take))
    }

    fn wanted_flags(&self, wanted: &[TopicId]) -> Result<Vec<bool>, Error> {
        let mut flags = vec![false; self.topics.len()];
        for &id in wanted {
            self.topic(id)?;
            flags[id.0] = true;
        }
        Ok(flags)
    }
}

impl fmt::Debug for Log {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Log")
            .field("path", &self.path)
            .field("format", &self.format)
            .field("files", &self.files)
            .field("topics", &self.topics.len())
            .finish_non_exhaustive()
    }
}

/// Detects the log at `path`.
fn recognise(path: &Path, source: &Source) -> Result<LogFiles, Error> {
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
        left_out: Vec::new(),
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
