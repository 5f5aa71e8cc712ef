//! Positions of the parts of a frame in the records of a group.

use std::io::{self, Read, Seek};

use tipwatch_language::{say, word};

use super::{
    block::BlockFile,
    channel::{Channel, Place, collect},
    conversion::number_at_end,
    field::Field,
};
use crate::{
    container::lost::LostRanges,
    frame::{CanId, Frame, FrameKind, fd_length},
};

/// Loggers nest a frame's parts one level deep.
const MOST_NESTED: usize = 4;
/// The bus of a group that names none.
const FIRST_BUS: u64 = 1;
const MOST_BUS: f64 = 255.0;

/// The records of one kind of frame.
#[derive(Debug)]
pub(super) struct FrameLayout {
    kind: FrameKind,
    /// Seconds after the start.
    time: Field,
    /// Error frames may have none.
    id: Option<Field>,
    is_extended: Option<Field>,
    bus: Bus,
    data_length: Option<Field>,
    dlc: Option<Field>,
    is_fd: Option<Field>,
    data: Data,
}

/// The bus of a record.
#[derive(Debug)]
enum Bus {
    Stated(Field),
    OfGroup(u64),
}

/// Position of the data.
#[derive(Debug)]
enum Data {
    Absent,
    Fixed {
        at: usize,
        len: usize,
    },
    /// The record has the position in another stream, which the link leads to.
    Elsewhere {
        position: Field,
        link: u64,
    },
}

/// Result of parsing a record: whether its data are within it, elsewhere, or invalid.
pub(super) enum Parsed {
    Whole,
    /// The data are at this position of the other stream.
    At(u64),
    Wrong,
}

impl FrameLayout {
    /// Finds the layout of a group, whose channels and source the links lead to: `None` if it holds no frames, and an error if
    /// they cannot be read.
    pub(super) fn find<R: Read + Seek>(
        file: &mut BlockFile<R>,
        first_channel: u64,
        source: u64,
        lost: &mut LostRanges,
    ) -> io::Result<Result<Option<Self>, String>> {
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
        match kind {
            Some(kind) => Self::of(file, &channels, kind, source, lost).map(|of| of.map(Some)),
            None => Ok(Ok(None)),
        }
    }

    fn of<R: Read + Seek>(
        file: &mut BlockFile<R>,
        channels: &[Channel],
        kind: FrameKind,
        source: u64,
        lost: &mut LostRanges,
    ) -> io::Result<Result<Self, String>> {
        let named = |wanted: &str| {
            let is_named = |c: &&Channel| c.name.rsplit('.').next() == Some(wanted);
            channels.iter().find(is_named)
        };
        macro_rules! field {
            ($channel:expr) => {
                match $channel {
                    None => None,
                    Some(channel) => match channel.field(file)? {
                        Ok(field) => Some(field),
                        Err(reason) => return Ok(Err(reason)),
                    },
                }
            };
        }
        let Some(time) = field!(channels.iter().find(|channel| channel.is_time())) else {
            return Ok(Err(word!(
                "expected a channel of time (master), found none: save the file with its times"
            )
            .to_owned()));
        };
        let id = match kind {
            FrameKind::Error => None,
            FrameKind::Data | FrameKind::Remote => match field!(named("ID")) {
                None => return Ok(Err(word!("expected a channel ID, found none").to_owned())),
                id => id,
            },
        };
        let mut data_length = field!(named("DataLength"));
        let bytes = named("DataBytes").filter(|_| kind == FrameKind::Data);
        let data = match bytes.map_or(Place::Nowhere, Channel::place) {
            Place::Nowhere => Data::Absent,
            Place::InRecord { at, len } => Data::Fixed { at, len },
            Place::UpTo { at, len, length_at } => {
                let length = channels.iter().find(|channel| channel.is_at(length_at));
                data_length = field!(length).or(data_length);
                Data::Fixed { at, len }
            }
            Place::Elsewhere { link } => match bytes.and_then(Channel::position) {
                Some(position) => Data::Elsewhere { position, link },
                None => Data::Absent,
            },
        };
        let bus_channel = named("BusChannel");
        let bus = match stated(field!(bus_channel)) {
            Some(field) => Bus::Stated(field),
            None => {
                let sources = [bus_channel.map_or(0, Channel::source), source];
                Bus::OfGroup(bus_of_source(file, sources)?.unwrap_or_else(|| {
                    lost.note(say!(
                        "the MF4 file names no bus for some frames: they are taken as those of can{FIRST_BUS}"
                    ));
                    FIRST_BUS
                }))
            }
        };
        Ok(Ok(Self {
            kind,
            time,
            id,
            is_extended: stated(field!(named("IDE"))),
            bus,
            data_length: stated(data_length),
            dlc: stated(field!(named("DLC"))),
            is_fd: stated(field!(named("EDL"))),
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

    /// Reads the record of an index. The channel of the frame is the number of its bus.
    pub(super) fn parse(
        &self,
        record: &[u8],
        index: u64,
        start_ns: i64,
        frame: &mut Frame,
    ) -> Parsed {
        self.parts(record, index, start_ns, frame)
            .unwrap_or(Parsed::Wrong)
    }

    fn parts(&self, record: &[u8], index: u64, start_ns: i64, frame: &mut Frame) -> Option<Parsed> {
        let whole = |field: &Field| field.whole(record, index);
        // a part that is there must be readable
        let optional = |field: &Option<Field>| match field {
            Some(field) => Some(Some(whole(field)?)),
            None => Some(None),
        };
        frame.time_ns = time_ns(self.time.number(record, index)?, start_ns)?;
        frame.kind = self.kind;
        frame.channel = usize::try_from(match &self.bus {
            Bus::Stated(field) => whole(field)?,
            Bus::OfGroup(bus) => *bus,
        })
        .ok()?;
        frame.set_data(&[]);
        frame.is_fd = false;
        let Some(id) = &self.id else {
            frame.id = CanId::default();
            return Some(Parsed::Whole);
        };
        let is_fd = optional(&self.is_fd)?;
        frame.is_fd = is_fd.unwrap_or(0) != 0;
        let raw = u32::try_from(whole(id)?).ok()?;
        let is_extended = match optional(&self.is_extended)? {
            Some(flag) => flag != 0,
            // bit 31 says it, as in the identifiers of DBC files
            None => raw & 1 << 31 != 0 || raw > 0x7ff,
        };
        frame.id = if is_extended {
            CanId::extended(raw)
        } else {
            CanId::standard(raw)
        };
        match &self.data {
            Data::Absent => Some(Parsed::Whole),
            Data::Elsewhere { position, .. } => Some(Parsed::At(whole(position)?)),
            Data::Fixed { at, len } => {
                let (at, len) = (*at, *len);
                let dlc = optional(&self.dlc)?.map(|dlc| match is_fd {
                    Some(0) => dlc.min(8) as usize,
                    _ => fd_length(dlc.min(15) as u8).min(len.max(8)),
                });
                let stated = optional(&self.data_length)?.map(|len| len as usize);
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

/// Returns the field of a part of a frame if it is stated; the index of the record says nothing about it.
fn stated(field: Option<Field>) -> Option<Field> {
    field.filter(|field| !field.is_bare_index())
}

fn time_ns(seconds: f64, start_ns: i64) -> Option<i64> {
    let nanos = seconds * 1e9;
    let is_possible = nanos.is_finite() && nanos.abs() < 9e18;
    is_possible.then(|| start_ns.checked_add(nanos.round() as i64))?
}

/// The number at the end of the name or path of a source, such as `CAN2`.
fn bus_of_source<R: Read + Seek>(
    file: &mut BlockFile<R>,
    sources: [u64; 2],
) -> io::Result<Option<u64>> {
    for source in sources.into_iter().filter(|source| *source != 0) {
        let Ok(block) = file.block(source, *b"SI")? else {
            continue;
        };
        for link in [block.link(0), block.link(1)] {
            let number = file.text(link)?.ok().and_then(|text| number_at_end(&text));
            if let Some(number) = number.filter(|number| *number <= MOST_BUS) {
                return Ok(Some(number as u64));
            }
        }
    }
    Ok(None)
}
