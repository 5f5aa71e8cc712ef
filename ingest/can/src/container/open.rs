//! Opens a file of frames by its content.

use std::io::{self, BufRead, Read, Seek, SeekFrom};

use super::{
    asc::Asc,
    blf::Blf,
    candump::Candump,
    channels::Channels,
    format::ContainerFormat,
    lost::{Lost, LostRanges},
    mf4::Mf4,
    open_error::OpenError,
    trc::Trc,
};
use crate::frame::{Frame, FrameSource};

/// Enough of a file to see its format.
const BEGINNING_BYTES: u64 = 4096;

/// A file of frames.
#[derive(Debug)]
pub struct Container<R> {
    format: ContainerFormat,
    reader: Reader<R>,
    channels: Channels,
    lost: LostRanges,
}

#[derive(Debug)]
enum Reader<R> {
    Candump(Candump<R>),
    Asc(Asc<R>),
    Blf(Box<Blf<R>>),
    Trc(Trc<R>),
    Mf4(Box<Mf4<R>>),
}

impl<R: BufRead + Seek> Container<R> {
    /// Opens a file, whose format is recognised by its first bytes.
    ///
    /// # Errors
    /// The file cannot be read, is of another format, or is damaged from the beginning.
    pub fn open(mut source: R) -> Result<Self, OpenError> {
        source.seek(SeekFrom::Start(0))?;
        let mut beginning = Vec::new();
        (&mut source)
            .take(BEGINNING_BYTES)
            .read_to_end(&mut beginning)?;
        source.seek(SeekFrom::Start(0))?;
        match ContainerFormat::of(&beginning) {
            Some(format) => Self::open_as(format, source),
            None => Err(OpenError::Unknown {
                found: beginning
                    .get(..beginning.len().min(16))
                    .unwrap_or_default()
                    .escape_ascii()
                    .to_string(),
            }),
        }
    }

    /// Opens a file of a known format, which may be damaged at its beginning.
    ///
    /// # Errors
    /// The file cannot be read, or has nothing that could be read.
    pub fn open_as(format: ContainerFormat, mut source: R) -> Result<Self, OpenError> {
        let mut lost = LostRanges::default();
        source.seek(SeekFrom::Start(0))?;
        let reader = match format {
            ContainerFormat::Candump => Reader::Candump(Candump::open(source)?),
            ContainerFormat::Asc => Reader::Asc(Asc::new(source)),
            ContainerFormat::Blf => Reader::Blf(Box::new(Blf::open(source, &mut lost)?)),
            ContainerFormat::Trc => Reader::Trc(Trc::open(source, &mut lost)?),
            ContainerFormat::Mf4 => Reader::Mf4(Box::new(Mf4::open(source, &mut lost)?)),
        };
        Ok(Self {
            format,
            reader,
            channels: Channels::default(),
            lost,
        })
    }

    /// The format.
    #[must_use]
    pub fn format(&self) -> ContainerFormat {
        self.format
    }

    /// Ranges lost in the part read so far.
    #[must_use]
    pub fn lost(&self) -> &[Lost] {
        &self.lost.ranges
    }

    /// Remarks that are not losses.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.lost.notes
    }
}

impl<R: BufRead + Seek> FrameSource for Container<R> {
    fn next_frame(&mut self, frame: &mut Frame) -> io::Result<bool> {
        let (channels, lost) = (&mut self.channels, &mut self.lost);
        let is_frame = match &mut self.reader {
            Reader::Candump(reader) => reader.next_frame(frame, channels, lost)?,
            Reader::Asc(reader) => reader.next_frame(frame, channels, lost)?,
            Reader::Blf(reader) => reader.next_frame(frame, channels, lost)?,
            Reader::Trc(reader) => reader.next_frame(frame, channels, lost)?,
            Reader::Mf4(reader) => reader.next_frame(frame, channels, lost)?,
        };
        if is_frame {
            // loggers that state no format of a frame leave it to its length
            frame.is_fd |= frame.data().len() > 8;
            match self.reader {
                // its blocks are in no order of time
                Reader::Mf4(_) => self.lost.last_time_ns = Some(frame.time_ns),
                _ => self.lost.intact(frame.time_ns),
            }
        }
        Ok(is_frame)
    }

    fn channels(&self) -> &[String] {
        &self.channels.names
    }
}
