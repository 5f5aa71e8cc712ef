//! Frames of candump from a pipe, as they come.

use std::{
    collections::VecDeque,
    io::{self, BufRead},
};

use super::{
    candump::Candump,
    candump_time::{Evidence, Stamp, UNTOLD},
    channels::Channels,
    lost::LostRanges,
};
use crate::frame::{Frame, FrameSource};

/// Reads the text of `candump -L` (or `-ta`, `-tA`) without seeking: a pipe, a terminal, standard input. Of `-tz` and
/// `-td` the first frames are held back until they tell which of both it is.
#[derive(Debug)]
pub struct CandumpStream<R> {
    reader: Candump<R>,
    channels: Channels,
    lost: LostRanges,
    refused: u64,
    /// Evidence of the stamps on the kind of time; `None` once the kind is known.
    evidence: Option<Evidence>,
    held: VecDeque<(Stamp, Frame)>,
}

impl<R: BufRead> CandumpStream<R> {
    /// Reads from this source.
    pub fn new(source: R) -> Self {
        Self {
            reader: Candump::stream(source),
            channels: Channels::default(),
            lost: LostRanges::default(),
            refused: 0,
            evidence: Some(Evidence::default()),
            held: VecDeque::new(),
        }
    }

    /// Returns the number of lines so far that were no frames, and the reason of the last of them.
    pub fn refused(&self) -> (u64, Option<&str>) {
        let last = self.lost.ranges.last();
        (self.refused, last.map(|lost| lost.reason.as_str()))
    }

    /// Holds frames back until the kind of their times is known.
    fn decide(&mut self, mut evidence: Evidence) -> io::Result<()> {
        let mut frame = Frame::default();
        let mut enough = Evidence::STREAM_STAMPS;
        loop {
            let stamp = self
                .reader
                .next_stamped(&mut frame, &mut self.channels, &mut self.lost)?;
            if let Some(stamp) = stamp {
                let interface = self.channels.names.get(frame.channel);
                evidence.take(stamp, interface.map_or(&[], |name| name.as_bytes()));
                self.held.push_back((stamp, frame.clone()));
            }
            let is_enough = evidence.is_enough(enough) || evidence.is_of_another_program();
            if stamp.is_some() && !is_enough {
                continue;
            }
            match evidence.counted_from() {
                Some(counted_from) => {
                    let clock = self.reader.set_counted_from(counted_from);
                    for (stamp, frame) in &mut self.held {
                        frame.time_ns = clock.time_ns(*stamp, &mut self.lost);
                    }
                    return Ok(());
                }
                None if stamp.is_some() && enough < Evidence::MOST_STAMPS => enough *= 2,
                None => return Err(io::Error::new(io::ErrorKind::InvalidData, UNTOLD)),
            }
        }
    }
}

impl<R: BufRead> FrameSource for CandumpStream<R> {
    fn next_frame(&mut self, frame: &mut Frame) -> io::Result<bool> {
        // each call reports on its own lines: a pipe may be read for months
        self.lost = LostRanges::default();
        let decided = match self.evidence.take() {
            Some(evidence) => self.decide(evidence),
            None => Ok(()),
        };
        let is_frame = match (decided, self.held.pop_front()) {
            (Err(error), _) => Err(error),
            (Ok(()), Some((_, held))) => {
                frame.clone_from(&held);
                Ok(true)
            }
            (Ok(()), None) => self
                .reader
                .next_frame(frame, &mut self.channels, &mut self.lost),
        };
        self.refused += self.lost.ranges.len() as u64;
        is_frame
    }

    fn channels(&self) -> &[String] {
        &self.channels.names
    }
}
