//! Frames of candump from a pipe, as they come.

use std::io::{self, BufRead};

use super::{candump::Candump, channels::Channels, lost::LostRanges};
use crate::frame::{Frame, FrameSource};

/// Reads the text of `candump -L` (or `-ta`) without seeking: a pipe, a terminal, standard input.
#[derive(Debug)]
pub struct CandumpStream<R> {
    reader: Candump<R>,
    channels: Channels,
    lost: LostRanges,
    refused: u64,
}

impl<R: BufRead> CandumpStream<R> {
    /// Reads from this source.
    pub fn new(source: R) -> Self {
        Self {
            reader: Candump::new(source),
            channels: Channels::default(),
            lost: LostRanges::default(),
            refused: 0,
        }
    }

    /// Lines so far that were no frames, and what was wrong with the last of them.
    pub fn refused(&self) -> (u64, Option<&str>) {
        let last = self.lost.ranges.last();
        (self.refused, last.map(|lost| lost.reason.as_str()))
    }
}

impl<R: BufRead> FrameSource for CandumpStream<R> {
    fn next_frame(&mut self, frame: &mut Frame) -> io::Result<bool> {
        // each call reports on its own lines: a pipe may be read for months
        self.lost = LostRanges::default();
        let is_frame = self
            .reader
            .next_frame(frame, &mut self.channels, &mut self.lost)?;
        self.refused += u64::from(!self.lost.ranges.is_empty());
        Ok(is_frame)
    }

    fn channels(&self) -> &[String] {
        &self.channels.names
    }
}
