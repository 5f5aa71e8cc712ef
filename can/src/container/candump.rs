//! Text of candump: `(1436509052.249713) can0 044#2A366C2B`, one frame a line.

use std::io::{self, BufRead};

use super::{
    channels::Channels,
    lost::LostRanges,
    text::{Lines, decimal, digit, hexadecimal, seconds, words},
};
use crate::frame::{CanId, Frame, FrameKind, MOST_DATA_BYTES};

/// Flag of an error frame in the identifier (SocketCAN).
const ERROR_FLAG: u32 = 0x2000_0000;

/// Whether a line begins like that of a frame.
pub(super) fn is_line(line: &[u8]) -> bool {
    let mut words = words(line);
    let time = words.next().and_then(time);
    time.is_some()
        && words.next().is_some()
        && words.next().is_some_and(|word| id_part(word).is_some())
}

#[derive(Debug)]
pub(super) struct Candump<R> {
    lines: Lines<R>,
}

impl<R: BufRead> Candump<R> {
    pub(super) fn new(source: R) -> Self {
        Self {
            lines: Lines::new(source),
        }
    }

    pub(super) fn next_frame(
        &mut self,
        frame: &mut Frame,
        channels: &mut Channels,
        lost: &mut LostRanges,
    ) -> io::Result<bool> {
        while self.lines.advance()? {
            let line = self.lines.line();
            if line.is_empty() {
                continue;
            }
            if self.lines.is_whole() && parse(line, frame, channels).is_some() {
                return Ok(true);
            }
            let place = if self.lines.is_last {
                "a last line without line break, which may be cut off"
            } else {
                "a line"
            };
            let shown = line
                .get(..line.len().min(40))
                .unwrap_or_default()
                .escape_ascii();
            lost.lose(
                self.lines.start..self.lines.end,
                format!("expected (seconds) channel id#data, found {place}: \"{shown}\""),
            );
        }
        Ok(false)
    }
}

fn time(word: &[u8]) -> Option<i64> {
    seconds(word.strip_prefix(b"(")?.strip_suffix(b")")?)
}

/// The identifier, and the text behind `#`; `None` behind it for the spaced form.
fn id_part(word: &[u8]) -> Option<(CanId, FrameKind, Option<&[u8]>)> {
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

fn parse(line: &[u8], frame: &mut Frame, channels: &mut Channels) -> Option<()> {
    let mut words = words(line);
    frame.time_ns = time(words.next()?)?;
    let channel = std::str::from_utf8(words.next()?).ok()?;
    let (id, kind, data) = id_part(words.next()?)?;
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

/// `[8] 11 22 33 44 55 66 77 88`, as on a terminal.
fn spaced<'l>(mut words: impl Iterator<Item = &'l [u8]>, frame: &mut Frame) -> Option<()> {
    let text = words.next()?.strip_prefix(b"[")?.strip_suffix(b"]")?;
    let len = usize::try_from(decimal(text)?).ok()?;
    // CAN FD lengths have two digits
    frame.is_fd = text.len() == 2;
    let mut data = [0; MOST_DATA_BYTES];
    for byte in data.get_mut(..len)? {
        let word = words.next()?;
        if word == b"remote" {
            frame.kind = FrameKind::Remote;
            return frame.set_data(&[]).then_some(());
        }
        *byte = (word.len() == 2).then(|| hexadecimal(word))?? as u8;
    }
    frame.set_data(data.get(..len)?).then_some(())
}
