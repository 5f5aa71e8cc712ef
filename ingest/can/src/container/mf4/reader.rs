//! A file as one sequence of frames: its groups merged by time.

use std::{
    collections::{HashMap, HashSet, VecDeque},
    io::{self, Read, Seek},
};

use tipwatch_language::{message, say, told, word};

use super::{
    block::BlockFile,
    chain::Stream,
    group::{Content, DataGroup, Frames, Records},
    layout::FrameLayout,
};
use crate::{
    bits::{u16_at, u32_at, u64_at},
    container::{channels::Channels, lost::LostRanges, open_error::OpenError},
    frame::Frame,
};

const MOST_GROUPS: usize = 4096;
/// Reason for losing the rest of a list of groups.
const LEADS_BACK: &str = message!("a list of groups that leads back into itself");

#[derive(Debug)]
pub(in super::super) struct Mf4<R> {
    file: BlockFile<R>,
    start_ns: i64,
    groups: Vec<(DataGroup, Option<Frame>)>,
    has_begun: bool,
}

impl<R: Read + Seek> Mf4<R> {
    pub(in super::super) fn open(source: R, lost: &mut LostRanges) -> Result<Self, OpenError> {
        let mut file = BlockFile::new(source, lost)?;
        let identification = file.bytes(0, 64)?;
        let is_finalised = !identification.starts_with(b"UnFinMF ");
        if !is_finalised {
            lost.note(word!(
                "the logger did not finalise the file: its last records are taken as they are"
            ));
        }
        let version = u16_at(&identification, 28).unwrap_or(0);
        if !(400..500).contains(&version) {
            return Err(OpenError::Invalid(format!(
                "expected MDF version 4, found version {}.{:02}",
                version / 100,
                version % 100
            )));
        }
        let header = file.block(64, *b"HD")?.map_err(OpenError::Invalid)?;
        let start_ns = u64_at(&header.data, 0).and_then(|start| i64::try_from(start).ok());
        let mut groups = Vec::new();
        let mut others = 0;
        let mut next = header.link(0);
        let mut seen = HashSet::new();
        while next != 0 && groups.len() + others < MOST_GROUPS {
            if !seen.insert(next) {
                lost.lose_link(next, file.len, told(LEADS_BACK));
                break;
            }
            match data_group(&mut file, next, is_finalised, lost)? {
                Ok((Some(group), after)) => {
                    groups.push((group, None));
                    next = after;
                }
                Ok((None, after)) => {
                    others += 1;
                    next = after;
                }
                Err(reason) => {
                    lost.lose(next.min(file.len)..file.len, reason);
                    break;
                }
            }
        }
        if groups.is_empty() && lost.ranges.is_empty() {
            return Err(OpenError::Invalid(format!(
                "expected bus frames (CAN_DataFrame) in the MF4 file, found {others} groups of other channels: export the \
                 frames of the bus with the software of the logger, or its signals as a CSV table with a column of time"
            )));
        }
        if others > 0 {
            lost.note(say!(
                "{others} groups of the MF4 file hold no bus frames and are not read"
            ));
        }
        Ok(Self {
            file,
            start_ns: start_ns.unwrap_or(0),
            groups,
            has_begun: false,
        })
    }

    pub(in super::super) fn next_frame(
        &mut self,
        frame: &mut Frame,
        channels: &mut Channels,
        lost: &mut LostRanges,
    ) -> io::Result<bool> {
        if !self.has_begun {
            self.has_begun = true;
            for index in 0..self.groups.len() {
                self.advance(index, lost)?;
            }
        }
        let waiting = self.groups.iter().enumerate();
        let first = waiting
            .filter_map(|(index, (_, frame))| Some((frame.as_ref()?.time_ns, index)))
            .min();
        let Some((_, index)) = first else {
            return Ok(false);
        };
        if let Some((_, Some(next))) = self.groups.get(index) {
            frame.clone_from(next);
        }
        frame.channel = channels.numbered(frame.channel as u64);
        self.advance(index, lost)?;
        Ok(true)
    }

    fn advance(&mut self, index: usize, lost: &mut LostRanges) -> io::Result<()> {
        if let Some((group, next)) = self.groups.get_mut(index) {
            let mut frame = next.take().unwrap_or_default();
            if group.next(&mut self.file, self.start_ns, &mut frame, lost)? {
                *next = Some(frame);
            }
        }
        Ok(())
    }
}

type Found = (Option<DataGroup>, u64);

/// A data group, if it holds frames, and the link to the next.
fn data_group<R: Read + Seek>(
    file: &mut BlockFile<R>,
    at: u64,
    is_finalised: bool,
    lost: &mut LostRanges,
) -> io::Result<Result<Found, String>> {
    let block = match file.block(at, *b"DG")? {
        Ok(block) => block,
        Err(reason) => return Ok(Err(reason)),
    };
    let next = block.link(0);
    let id_bytes = usize::from(block.data.first().copied().unwrap_or(0));
    let mut records = HashMap::new();
    let mut channel_group = block.link(1);
    let mut seen = HashSet::new();
    while channel_group != 0 && records.len() < MOST_GROUPS {
        if !seen.insert(channel_group) {
            lost.lose_link(channel_group, file.len, told(LEADS_BACK));
            break;
        }
        let group = match file.block(channel_group, *b"CG")? {
            Ok(group) => group,
            Err(reason) => {
                lost.lose_link(channel_group, file.len, reason);
                break;
            }
        };
        const VALUES: u16 = 1;
        let id = u64_at(&group.data, 0).unwrap_or(0);
        let flags = u16_at(&group.data, 16).unwrap_or(0);
        let bytes = [24, 28].map(|at| u32_at(&group.data, at).unwrap_or(0) as usize);
        let content = if flags & VALUES != 0 {
            Content::Values {
                at_block: channel_group,
                next: 0,
                recent: VecDeque::new(),
            }
        } else {
            match FrameLayout::find(file, group.link(1), group.link(3), lost)? {
                Ok(Some(layout)) => Content::Frames(Box::new(Frames {
                    layout,
                    values: None,
                    values_id: None,
                    count: 0,
                })),
                Ok(None) => Content::Other,
                Err(reason) => {
                    lost.lose_link(
                        channel_group,
                        file.len,
                        say!("frames of a group that cannot be read: {reason}"),
                    );
                    Content::Other
                }
            }
        };
        let bytes = bytes[0].saturating_add(bytes[1]);
        records.insert(id, Records { content, bytes });
        channel_group = group.link(0);
    }
    let has_frames = records
        .values()
        .any(|of| matches!(of.content, Content::Frames(_)));
    if !has_frames {
        return Ok(Ok((None, next)));
    }
    if id_bytes == 0 && records.len() > 1 {
        return Ok(Err(say!(
            "the group at byte {at} mixes records without identifiers"
        )));
    }
    bind_values(file, &mut records, is_finalised, lost)?;
    let stream = match block.link(2) {
        0 => Stream::default(),
        data => Stream::open(file, data, is_finalised, lost)?,
    };
    Ok(Ok((Some(DataGroup::new(stream, id_bytes, records)), next)))
}

/// Finds the data of variable length of all frames.
fn bind_values<R: Read + Seek>(
    file: &mut BlockFile<R>,
    records: &mut HashMap<u64, Records>,
    is_finalised: bool,
    lost: &mut LostRanges,
) -> io::Result<()> {
    let blocks: HashMap<u64, u64> = (records.iter())
        .filter_map(|(id, of)| match of.content {
            Content::Values { at_block, .. } => Some((at_block, *id)),
            _ => None,
        })
        .collect();
    for of in records.values_mut() {
        let Content::Frames(frames) = &mut of.content else {
            continue;
        };
        let Some(link) = frames.layout.data_link() else {
            continue;
        };
        match blocks.get(&link) {
            Some(id) => frames.values_id = Some(*id),
            None if link != 0 => {
                frames.values = Some(Stream::open(file, link, is_finalised, lost)?);
            }
            None => {}
        }
    }
    Ok(())
}
