//! The transport protocol of J1939-21: messages of up to 1785 bytes in packets of seven, to all (BAM, broadcast
//! announce message) or to one receiver (RTS and CTS, request and clear to send).

use super::identifier::Identifier;

const CONNECTION_PGN: u32 = 0xec00;
const DATA_PGN: u32 = 0xeb00;
const RTS: u8 = 16;
const BAM: u8 = 32;
const ABORT: u8 = 255;
const PACKET_BYTES: usize = 7;
const MOST_BYTES: usize = 1785;
/// A sender pauses at most this long (ns): T2 and T3 of the standard.
const LONGEST_PAUSE_NS: i64 = 1_250_000_000;
/// Far above any bus; the oldest gives way.
const MOST_SESSIONS: usize = 64;

/// Messages in the making.
#[derive(Debug, Clone, Default)]
pub(crate) struct Transport {
    sessions: Vec<Session>,
}

#[derive(Debug, Clone)]
struct Session {
    key: Key,
    pgn: u32,
    data: Vec<u8>,
    len: usize,
    has_packet: Vec<bool>,
    last_ns: i64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Key {
    channel: usize,
    source: u8,
    destination: u8,
}

/// Result of a frame of the transport protocol.
pub(crate) enum Assembled {
    /// Nothing yet.
    Nothing,
    /// A message is complete.
    Message { pgn: u32, source: u8, data: Vec<u8> },
    /// A message of this group will never be complete.
    Incomplete { pgn: u32 },
}

impl Transport {
    /// Whether frames of a group belong to the protocol.
    pub(crate) fn is_part(pgn: u32) -> bool {
        matches!(pgn, CONNECTION_PGN | DATA_PGN)
    }

    /// Takes a frame of the protocol. `wants` returns whether messages of a group are wanted.
    pub(crate) fn take(
        &mut self,
        id: Identifier,
        channel: usize,
        time_ns: i64,
        data: &[u8],
        wants: impl Fn(u32) -> bool,
    ) -> Assembled {
        let key = Key {
            channel,
            source: id.source,
            destination: id.destination.unwrap_or(u8::MAX),
        };
        match id.pgn {
            CONNECTION_PGN => self.connection(key, time_ns, data, wants),
            DATA_PGN => self.packet(key, time_ns, data),
            _ => Assembled::Nothing,
        }
    }

    fn connection(
        &mut self,
        key: Key,
        time_ns: i64,
        data: &[u8],
        wants: impl Fn(u32) -> bool,
    ) -> Assembled {
        let &[control, low, high, packets, _, first, second, third] = data else {
            return Assembled::Nothing;
        };
        let pgn = u32::from_le_bytes([first, second, third, 0]);
        match control {
            BAM | RTS => {
                let replaced = self.remove(key);
                let len = usize::from(u16::from_le_bytes([low, high]));
                let is_valid = (9..=MOST_BYTES).contains(&len)
                    && usize::from(packets) == len.div_ceil(PACKET_BYTES);
                if is_valid && wants(pgn) {
                    if self.sessions.len() == MOST_SESSIONS {
                        self.sessions.remove(0);
                    }
                    self.sessions.push(Session {
                        key,
                        pgn,
                        data: vec![0; usize::from(packets) * PACKET_BYTES],
                        len,
                        has_packet: vec![false; usize::from(packets)],
                        last_ns: time_ns,
                    });
                }
                match (replaced, is_valid) {
                    (Some(session), _) => Assembled::Incomplete { pgn: session.pgn },
                    (None, false) if wants(pgn) => Assembled::Incomplete { pgn },
                    _ => Assembled::Nothing,
                }
            }
            ABORT => {
                // either side may abort
                let back = Key {
                    source: key.destination,
                    destination: key.source,
                    ..key
                };
                let session = self.remove(key).or_else(|| self.remove(back));
                session.map_or(Assembled::Nothing, |session| Assembled::Incomplete {
                    pgn: session.pgn,
                })
            }
            // permission to send, and confirmation
            _ => Assembled::Nothing,
        }
    }

    fn packet(&mut self, key: Key, time_ns: i64, data: &[u8]) -> Assembled {
        let Some(place) = self.sessions.iter().position(|session| session.key == key) else {
            return Assembled::Nothing;
        };
        let Some(session) = self.sessions.get_mut(place) else {
            return Assembled::Nothing;
        };
        let pause = time_ns.saturating_sub(session.last_ns);
        let ([sequence, packet @ ..], true) = (data, data.len() == 8) else {
            return Assembled::Nothing;
        };
        let index = usize::from(*sequence).wrapping_sub(1);
        let start = index.saturating_mul(PACKET_BYTES);
        let is_in_time = (0..=LONGEST_PAUSE_NS).contains(&pause);
        let (Some(target), Some(has), true) = (
            session
                .data
                .get_mut(start..start.saturating_add(PACKET_BYTES)),
            session.has_packet.get_mut(index),
            is_in_time,
        ) else {
            let pgn = self.sessions.remove(place).pgn;
            return Assembled::Incomplete { pgn };
        };
        target.copy_from_slice(packet);
        *has = true;
        session.last_ns = time_ns;
        if session.has_packet.contains(&false) {
            return Assembled::Nothing;
        }
        let mut session = self.sessions.remove(place);
        session.data.truncate(session.len);
        Assembled::Message {
            pgn: session.pgn,
            source: key.source,
            data: session.data,
        }
    }

    fn remove(&mut self, key: Key) -> Option<Session> {
        let place = self
            .sessions
            .iter()
            .position(|session| session.key == key)?;
        Some(self.sessions.remove(place))
    }

    /// Groups of the messages that are not complete.
    pub(crate) fn unfinished(&self) -> impl Iterator<Item = u32> + '_ {
        self.sessions.iter().map(|session| session.pgn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::CanId;

    fn frames(len: usize, destination: u8, control: u8) -> Vec<(u32, Vec<u8>)> {
        let packets = len.div_ceil(7) as u8;
        let [low, high] = (len as u16).to_le_bytes();
        let to = u32::from(destination) << 8;
        let mut frames = vec![(
            0x1cec_0021 | to,
            vec![control, low, high, packets, 255, 0xea, 0xfe, 0],
        )];
        for packet in 0..packets {
            let first = packet * 7;
            let data = (0..7).map(|i| first.wrapping_add(i));
            frames.push((
                0x1ceb_0021 | to,
                std::iter::once(packet + 1).chain(data).collect(),
            ));
        }
        frames
    }

    fn assemble(frames: &[(u32, Vec<u8>)]) -> (Vec<Vec<u8>>, usize) {
        let mut transport = Transport::default();
        let (mut messages, mut incomplete) = (Vec::new(), 0);
        for (time, (id, data)) in frames.iter().enumerate() {
            let id = Identifier::of(CanId::extended(*id)).unwrap();
            match transport.take(id, 0, time as i64 * 50_000_000, data, |_| true) {
                Assembled::Message { pgn, source, data } => {
                    assert_eq!((pgn, source), (65_258, 0x21));
                    messages.push(data);
                }
                Assembled::Incomplete { .. } => incomplete += 1,
                Assembled::Nothing => {}
            }
        }
        (messages, incomplete + transport.unfinished().count())
    }

    #[test]
    fn messages_are_assembled_from_packets() {
        for (control, destination) in [(BAM, 255), (RTS, 3)] {
            for len in [9, 14, 15, 100] {
                let expected: Vec<u8> = (0..len as u8).collect();
                assert_eq!(
                    assemble(&frames(len, destination, control)),
                    (vec![expected], 0)
                );
            }
        }
    }

    #[test]
    fn a_message_with_a_missing_packet_is_incomplete() {
        let mut lossy = frames(20, 255, BAM);
        lossy.remove(2);
        assert_eq!(assemble(&lossy), (vec![], 1));
        // the next message is whole again
        lossy.extend(frames(20, 255, BAM));
        let (messages, incomplete) = assemble(&lossy);
        assert_eq!((messages.len(), incomplete), (1, 1));
    }

    #[test]
    fn a_resent_packet_completes_the_message() {
        let mut resent = frames(20, 3, RTS);
        let packet = resent.remove(2);
        resent.push(packet);
        assert_eq!(assemble(&resent).0, [(0..20).collect::<Vec<u8>>()]);
    }

    #[test]
    fn impossible_announcements_are_refused() {
        for announced in [[32, 255, 255, 1, 255, 0, 0, 0], [16, 8, 0, 2, 255, 0, 0, 0]] {
            assert_eq!(assemble(&[(0x1cec_ff21, announced.to_vec())]), (vec![], 1));
        }
    }
}
