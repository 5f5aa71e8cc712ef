//! Text of candump: `(1436509052.249713) can0 044#2A366C2B`, one frame a line, or as candump prints it on a terminal.

use std::io::{self, BufRead, Seek, SeekFrom};

use tipwatch_language::{message, say, told, word};

use super::{
    candump_time::{Clock, CountedFrom, Evidence, Stamp, UNTOLD, stamp},
    channels::Channels,
    lost::LostRanges,
    open_error::OpenError,
    text::{Lines, decimal, digit, hexadecimal, shown, words},
};
use crate::frame::{CanId, Frame, FrameKind, MOST_DATA_BYTES};

/// Flag of an error frame in the identifier (SocketCAN).
const ERROR_FLAG: u32 = 0x2000_0000;
const ESCAPE: u8 = 0x1b;
/// Beginning of the line that candump writes when the kernel dropped frames.
const DROPPED: &[u8] = b"DROPCOUNT:";

/// Whether a line begins like that of a frame.
pub(super) fn is_line(line: &[u8]) -> bool {
    let line = without_colours(line);
    match stamp(&line) {
        Some((_, rest)) => words_of_frame(rest).is_some() || is_xl(rest),
        None => is_without_time(&line),
    }
}

/// Whether a line is a frame as candump prints it without `-t`.
fn is_without_time(line: &[u8]) -> bool {
    let is_length = |word: &[u8]| word.starts_with(b"[") && word.ends_with(b"]");
    words_of_frame(line).is_some_and(|(_, (.., data), mut words)| {
        data.is_none() && words.next().is_some_and(is_length)
    })
}

/// A reader of frames, which have the stamps of their lines or the times that these stand for.
#[derive(Debug)]
pub(super) struct Candump<R> {
    lines: Lines<R>,
    /// `None` while the kind of times is not known.
    clock: Option<Clock>,
    /// Whether the lines that follow may explain an error frame.
    is_explained: bool,
}

impl<R: BufRead> Candump<R> {
    /// Reads without seeking.
    pub(super) fn stream(source: R) -> Self {
        Self {
            lines: Lines::new(source),
            clock: None,
            is_explained: false,
        }
    }

    /// States the origin of the times.
    pub(super) fn set_counted_from(&mut self, counted_from: CountedFrom) -> &mut Clock {
        self.clock.insert(Clock::new(counted_from))
    }

    pub(super) fn next_frame(
        &mut self,
        frame: &mut Frame,
        channels: &mut Channels,
        lost: &mut LostRanges,
    ) -> io::Result<bool> {
        Ok(self.next_stamped(frame, channels, lost)?.is_some())
    }

    /// Reads the next frame and its stamp. The frame has its time if the origin of the times is known.
    pub(super) fn next_stamped(
        &mut self,
        frame: &mut Frame,
        channels: &mut Channels,
        lost: &mut LostRanges,
    ) -> io::Result<Option<Stamp>> {
        while self.lines.advance()? {
            let line = without_colours(self.lines.line());
            if line.is_empty() {
                continue;
            }
            let is_indented = self.lines.raw().starts_with(b"\t");
            if is_indented && self.is_explained {
                // `-e` explains an error frame in the lines behind it
                continue;
            }
            let stamp = match self.lines.is_whole() {
                true => stamp(&line),
                false => None,
            };
            let time_ns = stamp.map(|(stamp, _)| match &mut self.clock {
                Some(clock) => clock.time_ns(stamp, lost),
                None => stamp.time_ns,
            });
            if let (Some((stamp, rest)), Some(time_ns)) = (stamp, time_ns)
                && parse(rest, frame, channels).is_some()
            {
                frame.time_ns = time_ns;
                self.is_explained = frame.kind == FrameKind::Error;
                return Ok(Some(stamp));
            }
            if stamp.is_some_and(|(_, rest)| is_xl(rest)) {
                lost.note(word!(
                    "frames of CAN XL are left out: those of classical CAN and CAN FD are read"
                ));
                continue;
            }
            let reason = self.problem(&line, stamp.is_some());
            self.lines.lose(lost, &reason);
        }
        Ok(None)
    }

    /// Describes the problem of an unreadable line; `has_stamp` is true if its time was read.
    fn problem(&self, line: &[u8], has_stamp: bool) -> String {
        let shown = shown(line);
        if line.starts_with(DROPPED) {
            let said = line.get(..line.len().min(120)).unwrap_or_default();
            return say!(
                "frames that candump itself missed: \"{}\"",
                said.escape_ascii()
            );
        }
        if is_without_time(line) {
            return say!("{}, found \"{shown}\"", told(WITHOUT_TIME));
        }
        let place = if self.lines.is_last {
            word!("a last line without line break, which may be cut off")
        } else {
            word!("a line")
        };
        let cost = match &self.clock {
            Some(clock) if !has_stamp => clock.cost(),
            _ => "",
        };
        say!("expected (seconds) channel id#data, found {place}: \"{shown}\"{cost}")
    }
}

impl<R: BufRead + Seek> Candump<R> {
    /// Opens a file: its first lines determine the origin of its times.
    pub(super) fn open(mut source: R) -> Result<Self, OpenError> {
        let mut lines = Lines::new(&mut source);
        let mut evidence = Evidence::default();
        let mut is_without_times = false;
        while !evidence.is_enough(Evidence::MOST_STAMPS) && lines.advance()? {
            let line = without_colours(lines.line());
            match stamp(&line) {
                Some((stamp, rest)) => {
                    let is_frame = words_of_frame(rest).is_some() || is_xl(rest);
                    if let Some(interface) = words(rest).next().filter(|_| is_frame) {
                        evidence.take(stamp, interface);
                    }
                }
                None => is_without_times |= is_without_time(&line),
            }
        }
        if is_without_times && evidence.is_empty() {
            return Err(OpenError::Invalid(format!("{WITHOUT_TIME}, found none")));
        }
        let counted_from = evidence.counted_from();
        let counted_from = counted_from.ok_or_else(|| OpenError::Invalid(UNTOLD.to_owned()))?;
        source.seek(SeekFrom::Start(0))?;
        let mut reader = Self::stream(source);
        reader.set_counted_from(counted_from);
        Ok(reader)
    }
}

const WITHOUT_TIME: &str = message!(
    "expected frames of candump with a time (record with candump -l, or print with candump -ta)"
);

/// A line without the sequences that colour it on a terminal (`-c`).
fn without_colours(line: &[u8]) -> Vec<u8> {
    let mut plain = Vec::with_capacity(line.len());
    let mut bytes = line.iter();
    while let Some(&byte) = bytes.next() {
        if byte == ESCAPE {
            bytes.find(|byte| byte.is_ascii_alphabetic());
        } else {
            plain.push(byte);
        }
    }
    plain
}

type IdPart<'l> = (CanId, FrameKind, Option<&'l [u8]>);

/// The interface, the identifier with the text behind `#`, and the words behind them.
fn words_of_frame(rest: &[u8]) -> Option<(&[u8], IdPart<'_>, impl Iterator<Item = &[u8]>)> {
    let mut words = words(rest);
    let interface = words.next()?;
    let mut word = words.next()?;
    if matches!(word, b"RX" | b"TX") {
        // `-x`: the direction, whether the bit rate is switched, the state of the sender
        let mut flags = [words.next()?, words.next()?].into_iter();
        flags
            .all(|flag| matches!(flag, b"-" | b"B" | b"E"))
            .then_some(())?;
        word = words.next()?;
    }
    Some((interface, id_part(word)?, words))
}

/// Whether a line is a frame of CAN XL: five digits of network and priority, where other identifiers have three or eight, and
/// behind `#` the flags, the type of its service data unit and its acceptance field, `81:00:12345678`.
fn is_xl(rest: &[u8]) -> bool {
    let is_number = |text: &[u8], len: usize| text.len() == len && hexadecimal(text).is_some();
    let is_id = |word: &[u8]| {
        let mut parts = word
            .split(|&byte| byte == b'#')
            .filter(|part| !part.is_empty());
        let has_id = parts.next().is_some_and(|id| is_number(id, 5));
        let mut fields = parts.next().unwrap_or_default().split(|&byte| byte == b':');
        let have_lengths = [2, 2, 8].map(|len| fields.next().is_some_and(|it| is_number(it, len)));
        has_id && have_lengths == [true; 3] && fields.next().is_none()
    };
    // the interface, and what `-x` puts before the identifier
    words(rest).skip(1).take(4).any(is_id)
}

/// The identifier, and the text behind `#`; `None` behind it for the spaced form.
fn id_part(word: &[u8]) -> Option<IdPart<'_>> {
    let hash = word.iter().position(|&byte| byte == b'#');
    let id = hash.map_or(Some(word), |hash| word.get(..hash))?;
    let raw = hexadecimal(id)?;
    let is_error = raw & ERROR_FLAG != 0;
    let (id, most) = match id.len() {
        3 => (CanId::standard(raw), 0x7ff),
        8 => (CanId::extended(raw), 0x1fff_ffff | ERROR_FLAG),
        _ => return None,
    };
    let kind = if is_error {
        FrameKind::Error
    } else {
        FrameKind::Data
    };
    let data = hash.and_then(|hash| word.get(hash + 1..));
    (raw <= most).then_some((id, kind, data))
}

/// Parses the text behind the stamp.
fn parse(rest: &[u8], frame: &mut Frame, channels: &mut Channels) -> Option<()> {
    let (interface, (id, kind, data), words) = words_of_frame(rest)?;
    let channel = std::str::from_utf8(interface).ok()?;
    (frame.id, frame.kind, frame.is_fd) = (id, kind, false);
    match data {
        Some(data) => compact(data, frame)?,
        None => spaced(words, frame)?,
    }
    frame.channel = channels.named(channel);
    Some(())
}

/// `DEADBEEF`, `R8` for a remote frame, `#1DEADBEEF` for CAN FD with its flags.
fn compact(text: &[u8], frame: &mut Frame) -> Option<()> {
    if let Some(length) = text.strip_prefix(b"R") {
        // a raw data length code may follow
        let length = length.split(|&byte| byte == b'_').next()?;
        (length.is_empty() || decimal(length)? <= 8).then_some(())?;
        frame.kind = FrameKind::Remote;
        return frame.set_data(&[]).then_some(());
    }
    let mut digits = text;
    if let Some([flags, rest @ ..]) = text.strip_prefix(b"#") {
        digit(*flags)?;
        frame.is_fd = true;
        digits = rest;
    }
    // bytes may be separated by points; a raw data length code may follow classical data
    let digits = digits.split(|&byte| byte == b'_').next()?;
    let mut data = [0; MOST_DATA_BYTES];
    let mut len = 0;
    let mut rest = digits;
    while let [high, low, tail @ ..] = rest {
        *data.get_mut(len)? = digit(*high)? << 4 | digit(*low)?;
        len += 1;
        rest = tail.strip_prefix(b".").unwrap_or(tail);
    }
    let most = if frame.is_fd { MOST_DATA_BYTES } else { 8 };
    (rest.is_empty() && len <= most && frame.set_data(&data[..len])).then_some(())
}

/// `[8] 11 22 33 44 55 66 77 88`, as on a terminal; `{F}` with the raw data length code (`-8`).
fn spaced<'l>(mut words: impl Iterator<Item = &'l [u8]>, frame: &mut Frame) -> Option<()> {
    let word = words.next()?;
    let (is_code, text) = match word.strip_prefix(b"{") {
        Some(rest) => (true, rest.strip_suffix(b"}")?),
        None => (false, word.strip_prefix(b"[")?.strip_suffix(b"]")?),
    };
    let len = match is_code {
        true => hexadecimal(text)?.min(8) as usize,
        false => usize::try_from(decimal(text)?).ok()?,
    };
    // CAN FD lengths have two digits
    frame.is_fd = !is_code && text.len() == 2;
    let mut data = [0; MOST_DATA_BYTES];
    let mut words = words.peekable();
    if words.peek() == Some(&&b"remote"[..]) {
        frame.kind = FrameKind::Remote;
        return frame.set_data(&[]).then_some(());
    }
    for byte in data.get_mut(..len)? {
        let word = words.next()?;
        *byte = (word.len() == 2).then(|| hexadecimal(word))?? as u8;
    }
    frame.set_data(data.get(..len)?).then_some(())
}
