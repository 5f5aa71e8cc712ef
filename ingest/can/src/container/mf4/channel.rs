//! Channels of a group: parts of its records with names, and numbers that no record has.

use std::io::{self, Read, Seek};

use tipwatch_language::{say, word};

use super::{
    block::{Block, BlockFile},
    conversion::Conversion,
    field::Field,
};
use crate::{bits::u32_at, container::lost::LostRanges};

const MOST_CHANNELS: usize = 4096;

/// Types of channels (`cn_type`).
mod kind {
    pub(super) const VARIABLE_LENGTH: u8 = 1;
    pub(super) const MASTER: u8 = 2;
    pub(super) const VIRTUAL_MASTER: u8 = 3;
    pub(super) const SYNCHRONISATION: u8 = 4;
    pub(super) const MOST_LENGTH: u8 = 5;
    pub(super) const VIRTUAL: u8 = 6;
}

/// A channel.
pub(super) struct Channel {
    pub(super) name: String,
    at: u64,
    block: Block,
}

/// Position of the bytes of a channel.
#[derive(Debug, Clone, Copy)]
pub(super) enum Place {
    Nowhere,
    InRecord {
        at: usize,
        len: usize,
    },
    /// Bytes in the record, whose number another channel states.
    UpTo {
        at: usize,
        len: usize,
        /// The block of the channel that states the length.
        length_at: u64,
    },
    /// The record has the position in another stream, which the link leads to.
    Elsewhere {
        link: u64,
    },
}

/// Collects channels, those that a channel is made of behind it.
pub(super) fn collect<R: Read + Seek>(
    file: &mut BlockFile<R>,
    first: u64,
    levels: usize,
    into: &mut Vec<Channel>,
    lost: &mut LostRanges,
) -> io::Result<()> {
    let mut next = first;
    while next != 0 && into.len() < MOST_CHANNELS {
        let at = next;
        if into.iter().any(|channel| channel.is_at(at)) {
            let reason = word!("a list of channels that leads back into itself");
            lost.lose_link(at, file.len, reason);
            return Ok(());
        }
        let block = match file.block(at, *b"CN")? {
            Ok(block) => block,
            Err(reason) => {
                lost.lose_link(at, file.len, reason);
                return Ok(());
            }
        };
        next = block.link(0);
        let composition = block.link(1);
        let name = match file.text(block.link(2))? {
            Ok(name) => name,
            Err(reason) => {
                lost.lose_link(block.link(2), file.len, reason);
                String::new()
            }
        };
        into.push(Channel { name, at, block });
        if composition != 0 && levels > 0 {
            collect(file, composition, levels - 1, into, lost)?;
        }
    }
    Ok(())
}

impl Channel {
    fn entry(&self, at: usize) -> u8 {
        self.block.data.get(at).copied().unwrap_or(0)
    }

    fn kind(&self) -> u8 {
        self.entry(0)
    }

    pub(super) fn is_at(&self, at: u64) -> bool {
        self.at == at
    }

    pub(super) fn is_time(&self) -> bool {
        // a master channel whose quantity is time
        matches!(self.kind(), kind::MASTER | kind::VIRTUAL_MASTER) && self.entry(1) == 1
    }

    /// Whether the channel's values are in no record, but follow from the index of the record.
    pub(super) fn is_virtual(&self) -> bool {
        matches!(self.kind(), kind::VIRTUAL_MASTER | kind::VIRTUAL)
    }

    /// The link to its source.
    pub(super) fn source(&self) -> u64 {
        self.block.link(3)
    }

    fn byte_offset(&self) -> Option<usize> {
        u32_at(&self.block.data, 4).map(|at| at as usize)
    }

    fn bit_count(&self) -> Option<u32> {
        u32_at(&self.block.data, 8)
    }

    /// Returns the number that the channel has in each record, or the error if it cannot be read.
    pub(super) fn field<R: Read + Seek>(
        &self,
        file: &mut BlockFile<R>,
    ) -> io::Result<Result<Field, String>> {
        let name = &self.name;
        let conversion = match Conversion::read(file, self.block.link(4))? {
            Ok(conversion) => conversion,
            Err(reason) => return Ok(Err(say!("channel {name}: {reason}"))),
        };
        if self.is_virtual() {
            return Ok(Ok(Field::of_index(conversion)));
        }
        let (bit_offset, data_type) = (self.entry(3), self.entry(2));
        let field = (self.byte_offset().zip(self.bit_count()))
            .and_then(|(at, count)| Field::of_bits(at, bit_offset, count, data_type, conversion));
        Ok(field.ok_or_else(|| {
            say!(
                "channel {name}: expected a number of 1 to 64 bits, found {} bits of data type {data_type}",
                self.bit_count().unwrap_or(0)
            )
        }))
    }

    /// The position of its bytes in another stream, which is in each record.
    pub(super) fn position(&self) -> Option<Field> {
        let (at, bit_count) = (self.byte_offset()?, self.bit_count()?);
        Field::of_bits(at, self.entry(3), bit_count, 0, Conversion::None)
    }

    pub(super) fn place(&self) -> Place {
        let (Some(at), Some(bit_count)) = (self.byte_offset(), self.bit_count()) else {
            return Place::Nowhere;
        };
        let len = bit_count as usize / 8;
        match self.kind() {
            kind::VARIABLE_LENGTH => Place::Elsewhere {
                link: self.block.link(5),
            },
            kind::MOST_LENGTH => Place::UpTo {
                at,
                len,
                length_at: self.block.link(5),
            },
            kind::VIRTUAL | kind::VIRTUAL_MASTER | kind::SYNCHRONISATION => Place::Nowhere,
            _ => Place::InRecord { at, len },
        }
    }
}
