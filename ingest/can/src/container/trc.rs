//! PEAK PCAN traces, versions 1.0 to 2.1: text with a header of comments and one message a line.

use std::io::{self, BufRead, Seek, SeekFrom};

use tipwatch_language::{say, word};

use super::{
    calendar::unix_ns,
    channels::Channels,
    lost::LostRanges,
    open_error::OpenError,
    text::{Lines, decimal, hexadecimal, seconds, shown, words},
};
use crate::frame::{CanId, Frame, FrameKind, MOST_DATA_BYTES, fd_length};

/// Far above any header.
const MOST_HEADER_LINES: usize = 10_000;
/// The identifier of warnings in version 1.
const WARNING_ID: &[u8] = b"FFFFFFFF";
/// The bus of versions that state none.
const ONLY_BUS: u64 = 1;

/// Whether a line is one of the header, or begins like a message of version 1, whose first header has no mark.
pub(super) fn is_line(line: &[u8]) -> bool {
    if let Some(key) = line.strip_prefix(b";$") {
        let keys: [&[u8]; 3] = [b"FILEVERSION=", b"STARTTIME=", b"COLUMNS="];
        return keys.iter().any(|known| key.starts_with(known));
    }
    let mut words = words(line);
    let number = words.next().and_then(|word| word.strip_suffix(b")"));
    number.is_some_and(|digits| decimal(digits).is_some())
        && words.next().is_some_and(|word| seconds(word).is_some())
        && words.next().is_some()
}

/// The word of a line in which each part of a message is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Columns {
    offset: usize,
    /// Version 1.0 has none.
    kind: Option<usize>,
    bus: Option<usize>,
    id: usize,
    length: usize,
    /// Index of the first data byte; it is the last column.
    data: usize,
}

#[derive(Debug)]
pub(super) struct Trc<R> {
    lines: Lines<R>,
    columns: Columns,
    start_ns: i64,
}

/// Kind of a line of a TRC file.
enum Line {
    Frame,
    /// A status of the hardware, a warning or an event.
    Other,
    Wrong,
    /// A message of several packets that the recorder put together.
    Assembled,
}

#[derive(Default)]
struct Header {
    version: Option<(i64, i64)>,
    columns: Option<Vec<u8>>,
    start_ns: Option<i64>,
    comment_ns: Option<i64>,
}

impl<R: BufRead + Seek> Trc<R> {
    pub(super) fn open(mut source: R, lost: &mut LostRanges) -> Result<Self, OpenError> {
        let mut header = Header::default();
        let mut lines = Lines::new(&mut source);
        for _ in 0..MOST_HEADER_LINES {
            if !lines.advance()? {
                break;
            }
            match lines.line().strip_prefix(b";") {
                Some(comment) => header.take(comment),
                None if lines.line().is_empty() => {}
                None => break,
            }
        }
        let columns = header.columns().map_err(OpenError::Invalid)?;
        let start_ns = header.start_ns.or(header.comment_ns);
        lost.note(match start_ns {
            Some(_) => word!("the file states its start without a time zone: UTC is assumed"),
            None => word!("the file states no time of its start: times count from its beginning"),
        });
        source.seek(SeekFrom::Start(0))?;
        Ok(Self {
            lines: Lines::new(source),
            columns,
            start_ns: start_ns.unwrap_or(0),
        })
    }
}

impl Header {
    fn take(&mut self, comment: &[u8]) {
        const START: &[u8] = b"Start time:";
        let value = |key: &[u8]| comment.strip_prefix(key).map(<[u8]>::trim_ascii);
        if let Some(version) = value(b"$FILEVERSION=") {
            let mut numbers = version.split(|&byte| byte == b'.').map(decimal);
            let major = numbers.next().flatten().unwrap_or(0);
            self.version = Some((major, numbers.next().flatten().unwrap_or(0)));
        } else if let Some(days) = value(b"$STARTTIME=") {
            self.start_ns = ole_date_ns(days);
        } else if let Some(columns) = value(b"$COLUMNS=") {
            self.columns = Some(columns.to_vec());
        } else if let Some(date) = comment.trim_ascii().strip_prefix(START) {
            self.comment_ns = date_ns(date);
        }
    }

    /// The columns of the version.
    fn columns(&self) -> Result<Columns, String> {
        let names: &[u8] = match self.version {
            // the first version has no mark
            None | Some((1, 0)) => b"N,O,I,L,D",
            Some((1, 1)) => b"N,O,T,I,L,D",
            Some((1, 2)) => b"N,O,B,T,I,L,D",
            Some((1, _)) => b"N,O,B,T,I,R,L,D",
            Some((2, minor)) => match (&self.columns, minor) {
                (Some(stated), _) => stated,
                (None, 0) => b"N,O,T,I,d,l,D",
                (None, _) => b"N,O,T,B,I,d,R,L,D",
            },
            Some((major, minor)) => {
                return Err(format!(
                    "expected a PCAN trace of version 1.0 to 2.1, found {major}.{minor}: save it as version 2.1 with PCAN \
                     software"
                ));
            }
        };
        let names: Vec<&[u8]> = names.split(|&byte| byte == b',').collect();
        let place = |wanted: &[&[u8]]| {
            names
                .iter()
                .position(|name| wanted.contains(&name.trim_ascii()))
        };
        let columns = || {
            Some(Columns {
                offset: place(&[b"O"])?,
                kind: place(&[b"T"]),
                bus: place(&[b"B"]),
                id: place(&[b"I"])?,
                length: place(&[b"L", b"l"])?,
                data: place(&[b"D"]).filter(|place| place + 1 == names.len())?,
            })
        };
        columns().ok_or_else(|| {
            format!(
                "expected columns of a PCAN trace with offset (O), identifier (I), length (L or l) and data (D) at the end, \
                 found \"{}\"",
                names.join(&b',').escape_ascii()
            )
        })
    }
}

impl<R: BufRead> Trc<R> {
    pub(super) fn next_frame(
        &mut self,
        frame: &mut Frame,
        channels: &mut Channels,
        lost: &mut LostRanges,
    ) -> io::Result<bool> {
        while self.lines.advance()? {
            let line = self.lines.line();
            if line.is_empty() || line.starts_with(b";") {
                continue;
            }
            let line_is = match self.lines.is_whole() {
                true => self.message(line, frame, channels).unwrap_or(Line::Wrong),
                false => Line::Wrong,
            };
            let expected = match line_is {
                Line::Frame => return Ok(true),
                Line::Other => {
                    lost.note(word!(
                        "lines with a status of the CAN hardware, a bus warning or an event are no frames and are left out"
                    ));
                    continue;
                }
                Line::Wrong => word!("a message of a PCAN trace in a whole line"),
                Line::Assembled => word!(
                    "a frame of at most 8 bytes (save the trace as CAN frames, not as messages of J1939)"
                ),
            };
            let shown = shown(line);
            let reason = say!("expected {expected}, found \"{shown}\"");
            self.lines.lose(lost, &reason);
        }
        Ok(false)
    }

    fn message(&self, line: &[u8], frame: &mut Frame, channels: &mut Channels) -> Option<Line> {
        const MOST_WORDS: usize = 16 + MOST_DATA_BYTES;
        let columns = self.columns;
        let words: Vec<&[u8]> = words(line).take(MOST_WORDS).collect();
        let word = |place: usize| words.get(place).copied();
        let offset_ns = seconds(word(columns.offset)?)? / 1000;
        let id = word(columns.id);
        let (kind, is_fd) = match columns.kind.map(&word) {
            None => (FrameKind::Data, false),
            Some(kind) => match kind? {
                b"Rx" | b"Tx" | b"DT" => (FrameKind::Data, false),
                b"FD" | b"FB" | b"FE" | b"BI" => (FrameKind::Data, true),
                b"RR" => (FrameKind::Remote, false),
                b"Error" | b"ER" => (FrameKind::Error, false),
                b"Warng" | b"ST" | b"EC" | b"EV" => return Some(Line::Other),
                _ => return None,
            },
        };
        if id == Some(WARNING_ID) {
            return Some(Line::Other);
        }
        let bus = match columns.bus {
            Some(place) => decimal(word(place)?)?.unsigned_abs(),
            None => ONLY_BUS,
        };
        frame.time_ns = self.start_ns.checked_add(offset_ns)?;
        let data = words.get(columns.data..).unwrap_or_default();
        frame.kind = match data.first() {
            Some(&b"RTR") if kind == FrameKind::Data => FrameKind::Remote,
            Some(&b"ERROR") => FrameKind::Error,
            _ => kind,
        };
        frame.is_fd = is_fd;
        frame.set_data(&[]);
        frame.id = CanId::default();
        if frame.kind != FrameKind::Error {
            frame.id = identifier(id?)?;
            let length = usize::try_from(decimal(word(columns.length)?)?).ok()?;
            match (frame.kind, is_fd) {
                (FrameKind::Data, false) if length > 15 => return Some(Line::Assembled),
                (FrameKind::Data, _) => bytes(data, length, is_fd, frame)?,
                _ => {}
            }
        }
        frame.channel = channels.numbered(bus);
        Some(Line::Frame)
    }
}

/// Identifiers of 29 bits have more than four digits.
fn identifier(word: &[u8]) -> Option<CanId> {
    let raw = hexadecimal(word)?;
    match word.len() {
        ..=4 => (raw <= 0x7ff).then(|| CanId::standard(raw)),
        _ => (raw <= 0x1fff_ffff).then(|| CanId::extended(raw)),
    }
}

/// Reads the data. The length is that of the data or its code, which differ from 9 on: programs mix up both.
fn bytes(words: &[&[u8]], length: usize, is_fd: bool, frame: &mut Frame) -> Option<()> {
    let coded = match is_fd {
        true => fd_length(u8::try_from(length.min(15)).ok()?),
        false => length.min(8),
    };
    let len = [coded, length]
        .into_iter()
        .find(|len| *len == words.len())?;
    let mut data = [0; MOST_DATA_BYTES];
    for (byte, word) in data.get_mut(..len)?.iter_mut().zip(words) {
        *byte = (word.len() == 2).then(|| hexadecimal(word))?? as u8;
    }
    (is_fd || len <= 8)
        .then(|| frame.set_data(&data[..len]))?
        .then_some(())
}

/// Days since 30 December 1899, as OLE counts them.
fn ole_date_ns(text: &[u8]) -> Option<i64> {
    /// 1 January 1970.
    const EPOCH_DAYS: f64 = 25_569.0;
    const MOST_DAYS: f64 = 109_575.0;
    // the point may be that of the language
    let text = std::str::from_utf8(text).ok()?.replace(',', ".");
    let days: f64 = text.parse().ok()?;
    // the number has no more than microseconds
    (EPOCH_DAYS..MOST_DAYS)
        .contains(&days)
        .then(|| ((days - EPOCH_DAYS) * 86_400e6).round() as i64 * 1000)
}

/// `11.09.2002 16:04:36.187.0` or `2002-09-11 16:04:36.187`, of version 1.0. With slashes nobody knows which number is
/// the month.
fn date_ns(text: &[u8]) -> Option<i64> {
    let mut words = words(text);
    let date = words.next()?;
    let (separator, is_year_first) = match date.contains(&b'-') {
        true => (b'-', true),
        false => (b'.', false),
    };
    let mut numbers = date.split(|&byte| byte == separator).map(decimal);
    let (first, month, last) = (numbers.next()??, numbers.next()??, numbers.next()??);
    let (year, day) = match is_year_first {
        true => (first, last),
        false => (last, first),
    };
    let clock = words.next()?;
    // a time zone may follow
    let clock = clock.split(|&byte| byte == b'+').next()?;
    let mut clock = clock.split(|&byte| byte == b':');
    let (hour, minute) = (decimal(clock.next()?)?, decimal(clock.next()?)?);
    // seconds, milliseconds, tenths of them
    let mut parts = clock.next()?.split(|&byte| byte == b'.');
    let whole = parts.next()?;
    let fraction = parts.collect::<Vec<_>>().concat();
    let second_ns = seconds(&[whole, b".", &fraction].concat())?;
    unix_ns([year, month, day], [hour, minute], second_ns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_dates_of_the_header_are_those_of_the_calendar() {
        // `date -u -d "2002-09-11 16:04:36.187" +%s%N`
        let expected = Some(1_031_760_276_187_000_000);
        assert_eq!(date_ns(b"11.09.2002 16:04:36.187.0"), expected);
        assert_eq!(date_ns(b" 2002-09-11 16:04:36.187+00:00"), expected);
        assert_eq!(date_ns(b"11/09/2002 16:04:36.187.0"), None);
        // 2023-11-14 22:13:20
        assert_eq!(
            ole_date_ns(b"45244.92592592593"),
            Some(1_700_000_000_000_000_000)
        );
        assert_eq!(ole_date_ns(b"0.0"), None);
        assert_eq!(ole_date_ns(b"1700000000.5"), None);
    }
}
