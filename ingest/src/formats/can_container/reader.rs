//! One file of a CAN logger.

use std::{
    fs::File,
    io::BufReader,
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use tipwatch_can::{Container, ContainerFormat, Frame, FrameSource, OpenError};
use tipwatch_language::say;

use super::encode::CanFrameType;
use crate::{
    file::LogFile,
    formats::reader::{FileReader, Request},
    message::{
        Error, Losses, LostPart, LostRange, RawMessage, TopicDescription, TopicId, TopicTable,
    },
};

/// Frames between two progress reports.
const FRAMES_PER_PROGRESS: u64 = 4096;

/// A file of frames. Its index is made when it is opened, by reading it once.
pub(crate) struct CanReader {
    format: ContainerFormat,
    path: PathBuf,
    data: PathBuf,
    bytes: u64,
    frames: u64,
    /// Topics in the order of the file's channels.
    channels: Vec<(TopicId, CanFrameType)>,
    span_ns: Option<(i64, i64)>,
}

/// Results of the first pass for one channel.
#[derive(Default)]
struct ChannelFrames {
    frames: u64,
    remote: u64,
    has_fd: bool,
}

impl CanReader {
    pub(crate) fn open(
        format: ContainerFormat,
        file: &LogFile,
        topics: &mut TopicTable,
        losses: &mut Losses,
    ) -> Result<Self, Error> {
        let path = file.path();
        let mut reader = Self {
            format,
            path: path.to_path_buf(),
            data: file.data().to_path_buf(),
            bytes: std::fs::metadata(file.data())
                .map_err(Error::io(path))?
                .len(),
            frames: 0,
            channels: Vec::new(),
            span_ns: None,
        };
        let mut source = reader.container()?;
        let mut seen: Vec<ChannelFrames> = Vec::new();
        let mut frame = Frame::default();
        while source.next_frame(&mut frame).map_err(Error::io(path))? {
            if seen.len() <= frame.channel {
                seen.resize_with(frame.channel + 1, ChannelFrames::default);
            }
            if let Some(seen) = seen.get_mut(frame.channel) {
                seen.frames += 1;
                seen.has_fd |= frame.is_fd;
                seen.remote += u64::from(frame.kind == tipwatch_can::FrameKind::Remote);
            }
            let (first, last) = reader.span_ns.unwrap_or((frame.time_ns, frame.time_ns));
            reader.span_ns = Some((first.min(frame.time_ns), last.max(frame.time_ns)));
            reader.frames += 1;
        }
        reader.register(&source, &seen, topics, losses);
        Ok(reader)
    }

    fn container(&self) -> Result<Container<BufReader<File>>, Error> {
        let file = File::open(&self.data).map_err(Error::io(&self.path))?;
        let source = BufReader::with_capacity(1 << 16, file);
        Container::open_as(self.format, source).map_err(|error| match error {
            OpenError::Io(source) => Error::io(&self.path)(source),
            other => Error::Unsupported {
                path: self.path.clone(),
                format: other.to_string(),
            },
        })
    }

    fn register(
        &mut self,
        source: &Container<BufReader<File>>,
        seen: &[ChannelFrames],
        topics: &mut TopicTable,
        losses: &mut Losses,
    ) {
        losses.integrity.checksums_absent = true;
        for lost in source.lost() {
            losses.push(lost_range(&self.path, lost));
        }
        for note in source.notes() {
            losses.note(format!("{}: {note}", self.path.display()));
        }
        for (name, seen) in source.channels().iter().zip(seen) {
            let frame_type = if seen.has_fd {
                CanFrameType::Fd
            } else {
                CanFrameType::Classical
            };
            let left_out = if seen.has_fd { seen.remote } else { 0 };
            if left_out > 0 {
                losses.note(say!(
                    "{name}: {left_out} remote frames, which carry no data, are left out of the topic: \
                     {} has no place for them",
                    frame_type.name()
                ));
            }
            let id = topics.register(&TopicDescription {
                name,
                type_name: frame_type.name(),
                encoding: "cdr",
                schema_encoding: "ros2msg",
                definition: Some(frame_type.definition().as_bytes()),
            });
            topics.add_messages(id, Some(seen.frames - left_out));
            self.channels.push((id, frame_type));
        }
    }
}

fn lost_range(path: &Path, lost: &tipwatch_can::Lost) -> LostRange {
    let (bytes, reason) = (lost.bytes.clone(), lost.reason.clone());
    LostRange {
        first_time_ns: lost.after_ns,
        last_time_ns: lost.before_ns,
        ..LostRange::of(LostPart::Records, path, bytes, reason)
    }
}

impl FileReader for CanReader {
    fn read(&self, request: &mut Request<'_>) -> Result<ControlFlow<()>, Error> {
        request.losses.integrity.checksums_absent = true;
        let mut source = self.container()?;
        let mut frame = Frame::default();
        let mut message = Vec::new();
        let mut frames: u64 = 0;
        while source
            .next_frame(&mut frame)
            .map_err(Error::io(&self.path))?
        {
            frames += 1;
            if frames.is_multiple_of(FRAMES_PER_PROGRESS) {
                // frames are of similar size
                let share = u128::from(frames.min(self.frames)) * u128::from(self.bytes);
                request.advance((share / u128::from(self.frames.max(1))) as u64);
            }
            let Some(&(topic, frame_type)) = self.channels.get(frame.channel) else {
                continue;
            };
            if !request.wants(topic) || !frame_type.encode(&frame, &mut message) {
                continue;
            }
            let flow = (request.visit)(&RawMessage {
                topic,
                writer: 0,
                log_time_ns: frame.time_ns,
                publish_time_ns: frame.time_ns,
                sequence: 0,
                data: &message,
            });
            if flow.is_break() {
                return Ok(flow);
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    fn span_ns(&self) -> Option<(i64, i64)> {
        self.span_ns
    }
}
