//! Where the parts of a frame are in the records of a group.

use std::io::{self, Read, Seek};

use super::block::{Block, BlockFile};
use crate::{
    bits::{BitRange, array_at, u16_at, u32_at, u64_at},
    container::lost::LostRanges,
    frame::{CanId, Frame, FrameKind, fd_length},
};

/// Loggers nest a frame's parts one level deep.
const MOST_NESTED: usize = 4;
const MOST_CHANNELS: usize = 4096;

/// The records of one kind of frame.
#[derive(Debug)]
pub(super) struct FrameLayout {
    kind: FrameKind,
    time: Time,
    id: BitRange,
    is_extended: Option<BitRange>,
    bus: Option<BitRange>,
    data_length: Option<BitRange>,
    dlc: Option<BitRange>,
    is_fd: Option<BitRange>,
    data: Data,
}

/// Where the time is, and how it is converted to seconds after the start.
#[derive(Debug, Clone, Copy)]
struct Time {
    at: usize,
    bits: BitRange,
    is_float: bool,
    factor: f64,
    offset: f64,
}

/// Where the data are.
#[derive(Debug, Clone, Copy)]
pub(super) enum Data {
    Absent,
    Fixed {
        at: usize,
        len: usize,
    },
    /// The record has the position in another stream, which the link leads to.
    Elsewhere {
        position: BitRange,
        link: u64,
    },
}

/// What a record says, and where its data are.
pub(super) enum Parsed {
    Whole,
    /// The data are at this position of the other stream.
    At(u64),
    Wrong,
}

impl FrameLayout {
    /// The layout of a group; `None` if it holds no frames.
    pub(super) fn find<R: Read + Seek>(
        file: &mut BlockFile<R>,
        first_channel: u64,
        lost: &mut LostRanges,
    ) -> io::Result<Option<Self>> {
        let mut channels = Vec::new();
        collect(file, first_channel, MOST_NESTED, &mut channels, lost)?;
        let kind = channels.iter().find_map(|channel| {
            let name = channel.name.split('.').next();
            match name {
                Some("CAN_DataFrame") => Some(FrameKind::Data),
                Some("CAN_RemoteFrame") => Some(FrameKind::Remote),
                Some("CAN_ErrorFrame") => Some(FrameKind::Error),
                _ => None,
            }
        });
        let named = |wanted: &str| {
            let is_named = |c: &&Channel| c.name.rsplit('.').next() == Some(wanted);
            channels.iter().find(is_named)
        };
        let bits = |wanted: &str| named(wanted).and_then(Channel::bits);
        let time = channels.iter().find(|channel| channel.is_time());
        let (Some(kind), Some(time)) = (kind, time) else {
            return Ok(None);
        };
        let Some(time) = time.time(file)? else {
            return Ok(None);
        };
        let id = match (bits("ID"), kind) {
            (Some(id), _) => id,
            // error frames need none
            (None, FrameKind::Error) => time.bits,
            (None, _) => return Ok(None),
        };
        let data = match named("DataBytes") {
            None => Data::Absent,
            Some(channel) => channel.data(),
        };
        Ok(Some(Self {
            kind,
            time,
            id,
            is_extended: bits("IDE"),
            bus: bits("BusChannel"),
            data_length: bits("DataLength"),
            dlc: bits("DLC"),
            is_fd: bits("EDL"),
            data,
        }))
    }

    /// The link to the data of variable length.
    pub(super) fn data_link(&self) -> Option<u64> {
        match self.data {
            Data::Elsewhere { link, .. } => Some(link),
            _ => None,
        }
    }

    /// Reads a record. The channel of the frame is the number of its bus.
    pub(super) fn parse(&self, record: &[u8], start_ns: i64, frame: &mut Frame) -> Parsed {
        self.parts(record, start_ns, frame).unwrap_or(Parsed::Wrong)
    }

    fn parts(&self, record: &[u8], start_ns: i64, frame: &mut Frame) -> Option<Parsed> {
        let optional = |bits: Option<BitRange>| bits.map(|bits| bits.read(record));
        frame.time_ns = self.time.read(record, start_ns)?;
        frame.kind = self.kind;
        frame.channel = optional(self.bus).flatten().unwrap_or(1) as usize;
        frame.set_data(&[]);
        if self.kind == FrameKind::Error {
            frame.id = CanId::default();
            return Some(Parsed::Whole);
        }
        let raw = self.id.read(record)? as u32;
        let is_extended = match optional(self.is_extended) {
            Some(flag) => flag? != 0,
            // bit 31 says it, as in the identifiers of DBC files
            None => raw & 1 << 31 != 0 || raw > 0x7ff,
        };
        frame.id = if is_extended {
            CanId::extended(raw)
        } else {
            CanId::standard(raw)
        };
        frame.is_fd = optional(self.is_fd).flatten().unwrap_or(0) != 0;
        if self.kind == FrameKind::Remote {
            return Some(Parsed::Whole);
        }
        match self.data {
            Data::Absent => Some(Parsed::Whole),
            Data::Elsewhere { position, .. } => Some(Parsed::At(position.read(record)?)),
            Data::Fixed { at, len } => {
                let dlc = optional(self.dlc).flatten().map(|dlc| fd_length(dlc as u8));
                let stated = optional(self.data_length).flatten().map(|len| len as usize);
                let stated = stated.or(dlc).unwrap_or(len);
                let data = record.get(at..at.checked_add(stated.min(len))?)?;
                let is_whole = stated <= len && frame.set_data(data);
                Some(if is_whole {
                    Parsed::Whole
                } else {
                    Parsed::Wrong
                })
            }
        }
    }
}

impl Time {
    fn read(&self, record: &[u8], start_ns: i64) -> Option<i64> {
        let seconds = match (self.is_float, self.bits.bit_count) {
            (true, 64) => f64::from_le_bytes(array_at(record, self.at)?),
            (true, _) => f64::from(f32::from_le_bytes(array_at(record, self.at)?)),
            (false, _) => self.bits.read(record)? as f64,
        };
        let nanos = (seconds * self.factor + self.offset) * 1e9;
        let is_possible = nanos.is_finite() && nanos.abs() < 9e18;
        is_possible.then(|| start_ns.checked_add(nanos.round() as i64))?
    }
}

/// A channel: a part of the record with a name.
struct Channel {
    name: String,
    block: Block,
}

/// Collects channels, those that a channel is made of behind it.
fn collect<R: Read + Seek>(
    file: &mut BlockFile<R>,
    first: u64,
    levels: usize,
    into: &mut Vec<Channel>,
    lost: &mut LostRanges,
) -> io::Result<()> {
    let mut next = first;
    while next != 0 && into.len() < MOST_CHANNELS {
        let block = match file.block(next, *b"CN")? {
            Ok(block) => block,
            Err(reason) => {
                lost.lose(next.min(file.len)..(next + 1).min(file.len), reason);
                return Ok(());
            }
        };
        next = block.link(0);
        let composition = block.link(1);
        let name = match file.text(block.link(2))? {
            Ok(name) => name,
            Err(reason) => {
                let at = block.link(2).min(file.len);
                lost.lose(at..(at + 1).min(file.len), reason);
                String::new()
            }
        };
        into.push(Channel { name, block });
        if composition != 0 && levels > 0 {
            collect(file, composition, levels - 1, into, lost)?;
        }
    }
    Ok(())
}

impl Channel {
    fn field(&self, at: usize) -> u8 {
        self.block.data.get(at).copied().unwrap_or(0)
    }

    fn is_time(&self) -> bool {
        // a master channel whose quantity is time
        matches!(self.field(0), 2 | 3) && self.field(1) == 1
    }

    fn byte_offset(&self) -> Option<usize> {
        u32_at(&self.block.data, 4).map(|at| at as usize)
    }

    fn bits(&self) -> Option<BitRange> {
        let start = self.byte_offset()?.checked_mul(8)? + usize::from(self.field(3));
        BitRange::little_endian(start, u32_at(&self.block.data, 8)?)
    }

    fn time<R: Read + Seek>(&self, file: &mut BlockFile<R>) -> io::Result<Option<Time>> {
        let (Some(at), Some(bits)) = (self.byte_offset(), self.bits()) else {
            return Ok(None);
        };
        let data_type = self.field(2);
        // unsigned, or floating point, of the lowest byte first
        if !matches!(data_type, 0 | 4) {
            return Ok(None);
        }
        let mut time = Time {
            at,
            bits,
            is_float: data_type == 4,
            factor: 1.0,
            offset: 0.0,
        };
        let conversion = self.block.link(4);
        if conversion != 0 {
            let Ok(block) = file.block(conversion, *b"CC")? else {
                return Ok(None);
            };
            let value = |index: usize| u64_at(&block.data, 24 + 8 * index).map(f64::from_bits);
            match (block.data.first(), u16_at(&block.data, 6)) {
                (Some(0), _) => {}
                (Some(1), Some(2..)) => {
                    (time.offset, time.factor) = (value(0).unwrap_or(0.0), value(1).unwrap_or(1.0));
                }
                _ => return Ok(None),
            }
        }
        Ok(Some(time))
    }

    fn data(&self) -> Data {
        const VARIABLE_LENGTH: u8 = 1;
        let (Some(at), Some(bit_count)) = (self.byte_offset(), u32_at(&self.block.data, 8)) else {
            return Data::Absent;
        };
        match (self.field(0), self.bits()) {
            (VARIABLE_LENGTH, Some(position)) => Data::Elsewhere {
                position,
                link: self.block.link(5),
            },
            _ => Data::Fixed {
                at,
                len: bit_count as usize / 8,
            },
        }
    }
}
