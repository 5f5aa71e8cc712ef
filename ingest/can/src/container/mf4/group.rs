//! The records of one data group: all of one kind, or mixed.

use std::{
    collections::{HashMap, VecDeque},
    io::{self, Read, Seek},
};

use tipwatch_language::{say, word};

use super::{
    block::BlockFile,
    chain::{Bytes, Stream, record_id, value_length},
    layout::{FrameLayout, Parsed},
};
use crate::{container::lost::LostRanges, frame::Frame};

/// Frames whose data come later, and data whose frames come later.
const MOST_WAITING: usize = 4096;

/// A data group.
#[derive(Debug)]
pub(super) struct DataGroup {
    pub(super) stream: Stream,
    pub(super) id_bytes: usize,
    /// Records of the group, by identifier.
    pub(super) records: HashMap<u64, Records>,
    pub(super) at: u64,
    waiting: VecDeque<(u64, u64, Frame)>,
}

/// Records of one kind.
#[derive(Debug)]
pub(super) struct Records {
    pub(super) content: Content,
    pub(super) bytes: usize,
}

#[derive(Debug)]
pub(super) enum Content {
    Frames(Box<Frames>),
    /// Data of variable length that other records point to.
    Values {
        at_block: u64,
        next: u64,
        recent: VecDeque<(u64, Vec<u8>)>,
    },
    Other,
}

#[derive(Debug)]
pub(super) struct Frames {
    pub(super) layout: FrameLayout,
    /// Data of variable length in a stream of their own.
    pub(super) values: Option<Stream>,
    /// The record identifier of values in the same data group.
    pub(super) values_id: Option<u64>,
    /// Records so far, among mixed ones.
    pub(super) count: u64,
}

impl DataGroup {
    pub(super) fn new(stream: Stream, id_bytes: usize, records: HashMap<u64, Records>) -> Self {
        Self {
            stream,
            id_bytes,
            records,
            at: 0,
            waiting: VecDeque::new(),
        }
    }

    /// The next frame, whose channel is the number of its bus.
    pub(super) fn next<R: Read + Seek>(
        &mut self,
        file: &mut BlockFile<R>,
        start_ns: i64,
        frame: &mut Frame,
        lost: &mut LostRanges,
    ) -> io::Result<bool> {
        loop {
            let Some(id) = self.record_id(file, lost)? else {
                if !self.waiting.is_empty() {
                    let count = self.waiting.len();
                    self.waiting.clear();
                    lost.lose(
                        file.len..file.len,
                        say!("{count} frames whose data were not found"),
                    );
                }
                return Ok(false);
            };
            let start = self.at + self.id_bytes as u64;
            let Some(records) = self.records.get_mut(&id) else {
                let end = self.stream.len;
                lost.lose(
                    file.len..file.len,
                    say!(
                        "unknown record {id}: {} bytes of the group are lost",
                        end - self.at
                    ),
                );
                self.at = end;
                continue;
            };
            if let Content::Values { next, recent, .. } = &mut records.content {
                let Some(len) =
                    found(self.stream.read(file, start, 4, lost)?).and_then(value_length)
                else {
                    self.at = self.stream.len;
                    continue;
                };
                let value = found(self.stream.read(file, start + 4, len, lost)?)
                    .unwrap_or_default()
                    .to_vec();
                self.at = start + 4 + len as u64;
                let position = *next;
                *next += 4 + len as u64;
                let first = self.waiting.front().map(|(of, at, _)| (*of, *at));
                if first == Some((id, position))
                    && let Some((_, _, waiting)) = self.waiting.pop_front()
                {
                    *frame = waiting;
                    if frame.set_data(&value) {
                        return Ok(true);
                    }
                    continue;
                }
                recent.push_back((position, value));
                if recent.len() > MOST_WAITING {
                    recent.pop_front();
                }
                continue;
            }
            let bytes = match self.stream.read(file, start, records.bytes, lost)? {
                Bytes::Found(bytes) => bytes,
                Bytes::End => {
                    if start < self.stream.len {
                        lost.lose(file.len..file.len, word!("the last record is cut off"));
                    }
                    self.at = self.stream.len;
                    continue;
                }
                Bytes::LostUntil(end) => {
                    self.skip(end, records_bytes(&self.records, id), lost);
                    continue;
                }
            };
            self.at = start + bytes.len() as u64;
            let Content::Frames(frames) = &mut records.content else {
                continue;
            };
            let index = match self.id_bytes {
                // also behind lost records
                0 => start / (bytes.len() as u64).max(1),
                _ => frames.count,
            };
            frames.count += 1;
            match frames.layout.parse(bytes, index, start_ns, frame) {
                Parsed::Whole => return Ok(true),
                Parsed::Wrong => {
                    lost.lose(file.len..file.len, word!("records that are not frames"));
                }
                Parsed::At(position) => {
                    if let Some(values_id) = frames.values_id {
                        if self.take_value(values_id, position, frame, lost) {
                            return Ok(true);
                        }
                    } else if let Some(values) = &mut frames.values {
                        let len =
                            found(values.read(file, position, 4, lost)?).and_then(value_length);
                        let is_whole = match len {
                            Some(0) => frame.set_data(&[]),
                            Some(len) => {
                                let value = values.read(file, position + 4, len, lost)?;
                                found(value).is_some_and(|value| frame.set_data(value))
                            }
                            None => false,
                        };
                        if is_whole {
                            return Ok(true);
                        }
                        lost.lose(
                            file.len..file.len,
                            word!("frames whose data were not found"),
                        );
                    }
                }
            }
        }
    }

    /// Takes a value that came before its frame; if there is none, the frame waits for its value.
    fn take_value(
        &mut self,
        id: u64,
        position: u64,
        frame: &mut Frame,
        lost: &mut LostRanges,
    ) -> bool {
        if let Some(Records {
            content: Content::Values { recent, .. },
            ..
        }) = self.records.get_mut(&id)
            && let Some(place) = recent.iter().position(|(at, _)| *at == position)
        {
            let value = recent.drain(..=place).next_back();
            return value.is_some_and(|(_, value)| frame.set_data(&value));
        }
        if self.waiting.len() == MOST_WAITING {
            self.waiting.pop_front();
            lost.lose(0..0, word!("frames whose data were not found"));
        }
        self.waiting.push_back((id, position, frame.clone()));
        false
    }

    /// The identifier of the next record; `None` at the end.
    fn record_id<R: Read + Seek>(
        &mut self,
        file: &mut BlockFile<R>,
        lost: &mut LostRanges,
    ) -> io::Result<Option<u64>> {
        if self.at >= self.stream.len {
            return Ok(None);
        }
        if self.id_bytes == 0 {
            return Ok(self.records.keys().next().copied());
        }
        let bytes = self.stream.read(file, self.at, self.id_bytes, lost)?;
        let id = found(bytes).and_then(record_id);
        if id.is_none() && self.at < self.stream.len {
            let end = self.stream.len;
            lost.lose(
                file.len..file.len,
                say!("{} bytes of mixed records are lost", end - self.at),
            );
            self.at = end;
        }
        Ok(id)
    }

    /// Goes on behind lost bytes. Records of one kind are found again by their length, mixed ones are not.
    fn skip(&mut self, end: u64, bytes: usize, lost: &mut LostRanges) {
        if self.id_bytes == 0 && bytes > 0 {
            self.at = end.div_ceil(bytes as u64) * bytes as u64;
        } else {
            lost.lose(
                0..0,
                say!(
                    "{} bytes of mixed records are lost",
                    self.stream.len - self.at
                ),
            );
            self.at = self.stream.len;
        }
    }
}

fn records_bytes(records: &HashMap<u64, Records>, id: u64) -> usize {
    records.get(&id).map_or(0, |records| records.bytes)
}

fn found(bytes: Bytes<'_>) -> Option<&[u8]> {
    match bytes {
        Bytes::Found(bytes) => Some(bytes),
        Bytes::LostUntil(_) | Bytes::End => None,
    }
}
