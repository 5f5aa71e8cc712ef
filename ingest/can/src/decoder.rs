//! Decoding of frames to signals.

use std::collections::HashMap;

use crate::{
    frame::{CanId, Frame, FrameKind},
    j1939::{Assembled, Identifier, Transport},
    message::{Addressing, Message},
    tally::Tally,
};

/// A message that is wanted, and from whom.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// The message.
    pub message: Message,
    /// The only sender (J1939). Without one, the first sender that comes is the only one: see [`Tally::sources`].
    pub source: Option<u8>,
}

impl Selection {
    /// A message from any sender.
    #[must_use]
    pub fn of(message: Message) -> Self {
        Self {
            message,
            source: None,
        }
    }
}

/// Identifiers remembered; buses have some hundreds.
const MOST_IDS: usize = 1 << 16;

/// Turns frames into the signals of wanted messages. Frames must come in their order of time.
#[derive(Debug, Clone)]
pub struct Decoder {
    selected: Vec<Selected>,
    /// The selections that a frame's identifier belongs to.
    by_id: HashMap<CanId, Vec<usize>>,
    transport: Transport,
    error_frames: u64,
    values: Vec<f64>,
}

#[derive(Debug, Clone)]
struct Selected {
    selection: Selection,
    tally: Tally,
    counter: Option<usize>,
    checksum: Option<usize>,
    last_source: Option<u8>,
    last: Option<Last>,
}

/// The counter, the checksum and the data of the last frame.
#[derive(Debug, Clone, Default)]
struct Last {
    counter: Option<u64>,
    checksum: Option<u64>,
    data: Vec<u8>,
    /// Whether the counter has moved since the first frame.
    has_counted: bool,
}

impl Decoder {
    /// A decoder of messages.
    #[must_use]
    pub fn new(selections: Vec<Selection>) -> Self {
        let selected = selections.into_iter().map(|selection| {
            let signals = &selection.message.signals;
            Selected {
                counter: signals.iter().position(|signal| signal.is_counter),
                checksum: signals.iter().position(|signal| signal.is_checksum),
                selection,
                tally: Tally::default(),
                last_source: None,
                last: None,
            }
        });
        Self {
            selected: selected.collect(),
            by_id: HashMap::new(),
            transport: Transport::default(),
            error_frames: 0,
            values: Vec::new(),
        }
    }

    /// Decodes a frame and passes every message that is complete with it to `take`: the index of its selection, and
    /// its signals in SI units where their unit is known, NaN where there is no number.
    pub fn decode(&mut self, frame: &Frame, take: &mut dyn FnMut(usize, &[f64])) {
        if frame.kind == FrameKind::Error {
            self.error_frames += 1;
            return;
        }
        let identifier = Identifier::of(frame.id);
        if let Some(id) = identifier
            && Transport::is_part(id.pgn)
        {
            self.packet(id, frame, take);
            return;
        }
        if !self.by_id.contains_key(&frame.id) {
            if self.by_id.len() == MOST_IDS {
                self.by_id.clear();
            }
            let wants = |place: &usize| {
                self.selected
                    .get(*place)
                    .is_some_and(|s| s.wants(frame.id, identifier))
            };
            let places: Vec<usize> = (0..self.selected.len()).filter(wants).collect();
            self.by_id.insert(frame.id, places);
        }
        let source = identifier.map(|id| id.source);
        for &place in self.by_id.get(&frame.id).into_iter().flatten() {
            let Some(selected) = self.selected.get_mut(place) else {
                continue;
            };
            if frame.kind == FrameKind::Remote {
                selected.tally.remote += 1;
            } else if selected.decode(frame.data(), frame.is_fd, source, &mut self.values) {
                take(place, &self.values);
            }
        }
    }

    fn packet(&mut self, id: Identifier, frame: &Frame, take: &mut dyn FnMut(usize, &[f64])) {
        let is_of = |selected: &Selected, pgn: u32| {
            matches!(selected.selection.message.addressing,
                Addressing::ParameterGroup { pgn: wanted, .. } if wanted == pgn)
        };
        let selected = &self.selected;
        let wants = |pgn: u32| selected.iter().any(|selected| is_of(selected, pgn));
        match self
            .transport
            .take(id, frame.channel, frame.time_ns, frame.data(), wants)
        {
            Assembled::Nothing => {}
            Assembled::Incomplete { pgn } => {
                for selected in self
                    .selected
                    .iter_mut()
                    .filter(|selected| is_of(selected, pgn))
                {
                    selected.tally.incomplete += 1;
                }
            }
            Assembled::Message { pgn, source, data } => {
                for (place, selected) in self.selected.iter_mut().enumerate() {
                    if is_of(selected, pgn)
                        && selected.accepts(source)
                        && selected.decode(&data, false, Some(source), &mut self.values)
                    {
                        take(place, &self.values);
                    }
                }
            }
        }
    }

    /// The wanted messages.
    pub fn selections(&self) -> impl ExactSizeIterator<Item = &Selection> {
        self.selected.iter().map(|selected| &selected.selection)
    }

    /// Returns the counts of values and frames that did not become numbers, for a selection.
    #[must_use]
    pub fn tally(&self, selection: usize) -> Option<Tally> {
        let selected = self.selected.get(selection)?;
        let mut tally = selected.tally.clone();
        if let Addressing::ParameterGroup { pgn, .. } = selected.selection.message.addressing {
            tally.incomplete += self.transport.unfinished().filter(|of| *of == pgn).count() as u64;
        }
        Some(tally)
    }

    /// Frames by which controllers reported errors on the bus.
    #[must_use]
    pub fn error_frames(&self) -> u64 {
        self.error_frames
    }
}

impl Selected {
    fn accepts(&self, source: u8) -> bool {
        let stated = match self.selection.message.addressing {
            Addressing::ParameterGroup { source, .. } => source,
            Addressing::Id(_) => None,
        };
        self.selection
            .source
            .or(stated)
            .is_none_or(|wanted| wanted == source)
    }

    fn wants(&self, id: CanId, identifier: Option<Identifier>) -> bool {
        match (self.selection.message.addressing, identifier) {
            (Addressing::Id(wanted), _) => wanted == id,
            (Addressing::ParameterGroup { pgn, .. }, Some(identifier)) => {
                identifier.pgn == pgn && self.accepts(identifier.source)
            }
            (Addressing::ParameterGroup { .. }, None) => false,
        }
    }

    /// Decodes data of the message; returns whether they gave values.
    fn decode(
        &mut self,
        data: &[u8],
        is_fd: bool,
        source: Option<u8>,
        values: &mut Vec<f64>,
    ) -> bool {
        let message = &self.selection.message;
        self.tally.frames += 1;
        if let (Addressing::ParameterGroup { .. }, Some(source)) = (message.addressing, source) {
            *self.tally.sources.entry(source).or_default() += 1;
            if *self.last_source.get_or_insert(source) != source {
                return false;
            }
        }
        if !message.has_length(data.len(), is_fd) {
            let count = self.tally.wrong_length.map_or(0, |(count, _)| count);
            self.tally.wrong_length = Some((count + 1, data.len()));
            return false;
        }
        if (self.counter.is_some() || self.checksum.is_some()) && self.stands_still(data) {
            return false;
        }
        self.selection.message.decode(data, values, &mut self.tally);
        true
    }

    /// Whether the counter stands still since the last frame, though it has counted before: the frame is a repetition.
    fn stands_still(&mut self, data: &[u8]) -> bool {
        let signals = &self.selection.message.signals;
        let raw = |index: Option<usize>| signals.get(index?)?.bits.read(data);
        let (counter, checksum) = (raw(self.counter), raw(self.checksum));
        let last = self.last.get_or_insert_default();
        let is_first = last.data.is_empty();
        let is_same = !is_first && counter.is_some() && counter == last.counter;
        last.has_counted |= !is_first && counter != last.counter;
        // one that has never counted is not implemented, and says nothing
        let is_standing = is_same && last.has_counted;
        if is_standing {
            self.tally.standing_counter += 1;
        } else if is_same && data != last.data {
            self.tally.idle_counter += 1;
        }
        if !is_first && checksum.is_some() && checksum == last.checksum && data != last.data {
            self.tally.standing_checksum += 1;
        }
        (last.counter, last.checksum) = (counter, checksum);
        last.data.clear();
        last.data.extend_from_slice(data);
        is_standing
    }
}
