//! Vector BLF: objects in zlib-compressed containers.

use std::{
    io::{self, Read, Seek, SeekFrom},
    ops::Range,
};

use flate2::read::ZlibDecoder;
use tipwatch_language::{say, word};

use super::{
    calendar::unix_ns, channels::Channels, lost::LostRanges, open_error::OpenError,
    written::Written,
};
use crate::{
    bits::{find, u16_at, u32_at, u64_at},
    frame::{CanId, Frame, FrameKind, MOST_DATA_BYTES, fd_length},
};

const FILE_MAGIC: &[u8] = b"LOGG";
const OBJECT_MAGIC: &[u8] = b"LOBJ";
const FILE_HEADER_BYTES: u64 = 144;
/// Magic, size of the header, version, size and type of an object.
const BASE_BYTES: usize = 16;
/// Loggers write containers of 128 kB.
const MOST_CONTAINER_BYTES: u64 = 16 << 20;
/// Far above the largest object of a frame; other objects may be larger and are passed over.
const MOST_OBJECT_BYTES: usize = 4 << 20;
const SEARCH_BYTES: usize = 64 << 10;
/// Zeros between objects: as loggers write them, and at most.
const USUAL_PADDING: usize = 3;
const MOST_PADDING: usize = 7;

/// Types of objects.
mod object {
    pub(super) const CAN_MESSAGE: u32 = 1;
    pub(super) const CAN_ERROR: u32 = 2;
    pub(super) const LOG_CONTAINER: u32 = 10;
    pub(super) const CAN_ERROR_EXT: u32 = 73;
    pub(super) const CAN_MESSAGE2: u32 = 86;
    pub(super) const CAN_FD_MESSAGE: u32 = 100;
    pub(super) const CAN_FD_MESSAGE_64: u32 = 101;
    pub(super) const CAN_FD_ERROR_64: u32 = 104;
}

#[derive(Debug)]
pub(super) struct Blf<R> {
    source: R,
    start_ns: i64,
    /// The next byte of the file to read.
    at: u64,
    len: u64,
    /// Decompressed objects; an object may continue in the next container.
    inner: Vec<u8>,
    inner_at: usize,
    /// Offset in `inner` of the objects of the last container.
    joint: usize,
    /// Whether the content of the last container ends with damage: nothing confirms it, and the next one does not continue it.
    is_damaged: bool,
    /// Bytes lost behind the objects that were found in the last container, with the reason.
    lost_behind: Option<(Range<u64>, String)>,
    /// The bytes of the file from which the objects came.
    inner_bytes: Range<u64>,
}

impl<R: Read + Seek> Blf<R> {
    pub(super) fn open(mut source: R, lost: &mut LostRanges) -> Result<Self, OpenError> {
        let written = Written::of(&mut source)?;
        if let Some(note) = written.note() {
            lost.note(note);
        }
        let len = written.bytes;
        source.seek(SeekFrom::Start(0))?;
        let mut header = Vec::new();
        (&mut source)
            .take(FILE_HEADER_BYTES)
            .read_to_end(&mut header)?;
        let is_intact = header.starts_with(FILE_MAGIC) && header.len() as u64 == FILE_HEADER_BYTES;
        let mut at = FILE_HEADER_BYTES;
        if is_intact {
            at = u64::from(u32_at(&header, 4).unwrap_or(0)).clamp(32, 4096);
        } else {
            lost.lose(
                0..len.min(FILE_HEADER_BYTES),
                word!("expected the header of a BLF file of 144 bytes"),
            );
        }
        let start_ns = system_time_ns(&header, 40).unwrap_or(0);
        if start_ns == 0 {
            lost.note(word!(
                "the file states no time of its start: times count from its beginning"
            ));
        } else {
            lost.note(word!(
                "the file states its start without a time zone: UTC is assumed"
            ));
        }
        Ok(Self {
            source,
            start_ns,
            at,
            len,
            inner: Vec::new(),
            inner_at: 0,
            joint: 0,
            is_damaged: false,
            lost_behind: None,
            inner_bytes: 0..0,
        })
    }

    pub(super) fn next_frame(
        &mut self,
        frame: &mut Frame,
        channels: &mut Channels,
        lost: &mut LostRanges,
    ) -> io::Result<bool> {
        loop {
            while let Some(range) = self.next_object(lost) {
                let is_joined = range.start < self.joint && self.joint < range.end;
                if is_joined && !self.is_at_object(MOST_PADDING)? {
                    lost.lose(
                        self.inner_bytes.clone(),
                        word!("an object that the next container does not continue"),
                    );
                    self.inner_at = self.joint;
                    continue;
                }
                let object = self.inner.get(range).unwrap_or_default();
                match parse(object, self.start_ns, frame, channels) {
                    None => {}
                    Some(Some(Body::Whole(_))) => return Ok(true),
                    // a size that is damaged leads to no object
                    Some(Some(Body::Shortened(_))) if self.is_at_object(USUAL_PADDING)? => {
                        lost.note(word!(
                            "the logger left out the last bytes of frames (they are zero as a rule): they are read as zero"
                        ));
                        return Ok(true);
                    }
                    Some(_) => lost.lose(
                        self.inner_bytes.clone(),
                        word!("an object of a frame that is too short"),
                    ),
                }
            }
            if !self.refill(lost)? {
                if self.inner_at < self.inner.len() && rest_is_object(&self.inner, self.inner_at) {
                    lost.lose(
                        self.inner_bytes.clone(),
                        word!("the last object is cut off"),
                    );
                    self.inner_at = self.inner.len();
                }
                return Ok(false);
            }
        }
    }

    /// Whether an object or the end of the file is next, behind no more than padding.
    fn is_at_object(&mut self, most_padding: usize) -> io::Result<bool> {
        let rest = self.inner.get(self.inner_at..).unwrap_or_default();
        let mut beginning = rest
            .get(..rest.len().min(most_padding + OBJECT_MAGIC.len()))
            .unwrap_or_default()
            .to_vec();
        if beginning.len() < OBJECT_MAGIC.len() {
            // the next container or object of the file
            self.source.seek(SeekFrom::Start(self.at))?;
            let missing = (most_padding + OBJECT_MAGIC.len() - beginning.len()) as u64;
            (&mut self.source)
                .take(missing.min(self.len.saturating_sub(self.at)))
                .read_to_end(&mut beginning)?;
        }
        let padding = find(&beginning, OBJECT_MAGIC).unwrap_or(beginning.len());
        let is_end = beginning.len() <= most_padding;
        let is_zero = beginning.iter().take(padding).all(|&byte| byte == 0);
        Ok(is_zero && (is_end || padding <= most_padding))
    }

    /// The next whole object among the decompressed bytes.
    fn next_object(&mut self, lost: &mut LostRanges) -> Option<Range<usize>> {
        loop {
            let rest = self.inner.get(self.inner_at..)?;
            // objects are padded, by fewer than eight bytes
            let skip = find(
                rest.get(..rest.len().min(8 + OBJECT_MAGIC.len()))?,
                OBJECT_MAGIC,
            );
            let Some(skip) = skip else {
                if rest.len() < 8 + OBJECT_MAGIC.len() {
                    return None;
                }
                lost.lose(
                    self.inner_bytes.clone(),
                    word!("expected an object (LOBJ), found other bytes"),
                );
                let next = find(rest, OBJECT_MAGIC).filter(|_| !self.is_damaged);
                self.inner_at += next.unwrap_or(rest.len() - OBJECT_MAGIC.len());
                next?;
                continue;
            };
            let start = self.inner_at + skip;
            let size = u32_at(&self.inner, start + 8)? as usize;
            if !(BASE_BYTES..=MOST_OBJECT_BYTES).contains(&size) {
                lost.lose(
                    self.inner_bytes.clone(),
                    say!("expected an object of 16 bytes to 4 MiB, found one of {size} bytes"),
                );
                self.inner_at = start + OBJECT_MAGIC.len();
                continue;
            }
            let end = start + size;
            if end > self.inner.len() {
                return None;
            }
            self.inner_at = end;
            return Some(start..end);
        }
    }

    /// Appends the objects of the next container; `false` at the end of the file.
    fn refill(&mut self, lost: &mut LostRanges) -> io::Result<bool> {
        if let Some((bytes, problem)) = self.lost_behind.take() {
            lost.lose(bytes, problem);
        }
        loop {
            let start = self.at;
            if start >= self.len {
                return Ok(false);
            }
            let mut head = Vec::with_capacity(BASE_BYTES);
            self.source.seek(SeekFrom::Start(start))?;
            (&mut self.source)
                .take(BASE_BYTES as u64)
                .read_to_end(&mut head)?;
            if head.len() < BASE_BYTES {
                if head.iter().any(|&byte| byte != 0) {
                    lost.lose(start..self.len, word!("the file ends within an object"));
                }
                self.at = self.len;
                return Ok(false);
            }
            let size = u64::from(u32_at(&head, 8).unwrap_or(0));
            let is_object = head.starts_with(OBJECT_MAGIC)
                && (BASE_BYTES as u64..=MOST_CONTAINER_BYTES).contains(&size);
            if !is_object {
                let next = self.search(start + 1)?;
                // padding behind a container is no loss
                if next - start > 3 {
                    lost.lose(
                        start..next,
                        word!("expected an object (LOBJ), found other bytes"),
                    );
                    self.inner.clear();
                    self.inner_at = 0;
                }
                self.at = next;
                continue;
            }
            let end = start + size;
            let available = end.min(self.len);
            let mut body = Vec::new();
            (&mut self.source)
                .take(available - start - BASE_BYTES as u64)
                .read_to_end(&mut body)?;
            self.forget_read();
            if std::mem::take(&mut self.is_damaged) {
                self.inner.clear();
            }
            self.joint = self.inner.len();
            let kind = u32_at(&head, 12).unwrap_or(0);
            if kind != object::LOG_CONTAINER {
                // an object outside containers, as uncompressed files have them
                self.inner.extend_from_slice(&head);
                self.inner.extend_from_slice(&body);
                self.inner_bytes = start..available;
                self.at = available;
                return Ok(true);
            }
            self.inner_bytes = start..available;
            let damage = unpack(&body, &mut self.inner);
            self.at = available;
            if let Some(damage) = &damage {
                // the size may be what is damaged: a container that starts within is found
                let content = damage.content_bytes;
                let behind = content.map_or(OBJECT_MAGIC.len(), |bytes| BASE_BYTES + bytes);
                self.at = self.search(start + behind as u64)?.min(available);
                self.is_damaged = content.is_none();
            }
            let problem = match damage {
                _ if end > self.len && self.at == available => {
                    Some(word!("the file ends within a container").to_owned())
                }
                damage => damage.map(|damage| damage.problem),
            };
            self.lost_behind = problem.map(|problem| (start..self.at, problem));
            return Ok(true);
        }
    }

    fn forget_read(&mut self) {
        let read = self.inner_at.min(self.inner.len());
        self.inner.drain(..read);
        self.inner_at = 0;
        if self.inner.len() > MOST_OBJECT_BYTES {
            self.inner.clear();
        }
    }

    /// The position of the next container behind `from`, else the end of the file.
    fn search(&mut self, from: u64) -> io::Result<u64> {
        self.source.seek(SeekFrom::Start(from))?;
        let mut window = Vec::new();
        let mut at = from;
        loop {
            let before = window.len();
            (&mut self.source)
                .take(SEARCH_BYTES as u64)
                .read_to_end(&mut window)?;
            if window.len() == before {
                return Ok(self.len);
            }
            if let Some(found) = find(&window, OBJECT_MAGIC) {
                return Ok(at + found as u64);
            }
            let keep = window.len().min(OBJECT_MAGIC.len() - 1);
            at += (window.len() - keep) as u64;
            window.drain(..window.len() - keep);
        }
    }
}

fn rest_is_object(inner: &[u8], at: usize) -> bool {
    inner
        .get(at..)
        .is_some_and(|rest| find(rest, OBJECT_MAGIC).is_some())
}

const NOT_PACKED: u16 = 0;
const ZLIB: u16 = 2;

/// Damage of a container.
struct Damage {
    problem: String,
    /// The bytes that its content takes, if that is whole all the same.
    content_bytes: Option<usize>,
}

/// Appends the objects of a container, and returns what is wrong with it. The beginning before damage is kept.
fn unpack(body: &[u8], into: &mut Vec<u8>) -> Option<Damage> {
    const HEADER_BYTES: usize = 16;
    let damage = |content_bytes, problem| {
        Some(Damage {
            problem,
            content_bytes,
        })
    };
    let method = u16_at(body, 0);
    let declared = u64::from(u32_at(body, 8).unwrap_or(0));
    let Some(data) = body.get(HEADER_BYTES..) else {
        return damage(None, word!("a container without a header").to_owned());
    };
    match method {
        Some(NOT_PACKED) => {
            into.extend_from_slice(data);
            None
        }
        Some(ZLIB) => {
            let before = into.len();
            let mut decoder = ZlibDecoder::new(data);
            let result = decoder
                .by_ref()
                .take(MOST_CONTAINER_BYTES)
                .read_to_end(into);
            let found = (into.len() - before) as u64;
            let used = usize::try_from(decoder.total_in()).unwrap_or(data.len());
            let behind = data.get(used..).unwrap_or_default();
            match result {
                Err(error) => damage(
                    None,
                    say!(
                        "damaged zlib after {found} bytes: {error}; the frames in these bytes are read, unverified"
                    ),
                ),
                Ok(_) if found != declared => damage(
                    Some(HEADER_BYTES + used),
                    say!("expected a container of {declared} bytes, found {found}"),
                ),
                Ok(_) if find(behind, OBJECT_MAGIC).is_some() => damage(
                    Some(HEADER_BYTES + used),
                    say!(
                        "expected a container of {used} bytes, as its content takes, found one of {} bytes with other objects",
                        data.len()
                    ),
                ),
                Ok(_) => None,
            }
        }
        other => damage(
            None,
            say!(
                "expected compression 0 or 2 (zlib), found {}",
                other.unwrap_or(u16::MAX)
            ),
        ),
    }
}

/// The channel of a frame that was read.
#[derive(Debug, Clone, Copy)]
enum Body {
    Whole(u16),
    /// The object ends before the data do: zeros stand for what is missing.
    Shortened(u16),
}

/// Reads a frame from an object: `None` for objects of other kinds, `Some(None)` for one that is too short.
fn parse(
    object: &[u8],
    start_ns: i64,
    frame: &mut Frame,
    channels: &mut Channels,
) -> Option<Option<Body>> {
    let read: fn(&[u8], &mut Frame) -> Option<Body> = match u32_at(object, 12)? {
        object::CAN_MESSAGE | object::CAN_MESSAGE2 => classical,
        object::CAN_ERROR | object::CAN_ERROR_EXT => error,
        object::CAN_FD_MESSAGE => fd,
        object::CAN_FD_MESSAGE_64 => fd_64,
        object::CAN_FD_ERROR_64 => fd_error_64,
        _ => return None,
    };
    let mut parts = || {
        let header_bytes = usize::from(u16_at(object, 4)?);
        // flags: 1 for units of 10 microseconds, 2 for nanoseconds
        let flags = u32_at(object, BASE_BYTES)?;
        let units = u64_at(object, BASE_BYTES + 8)?;
        let unit_ns = if flags == 1 { 10_000 } else { 1 };
        let time_ns = i64::try_from(units).ok()?.checked_mul(unit_ns)?;
        frame.time_ns = start_ns.checked_add(time_ns)?;
        let body = read(object.get(header_bytes..)?, frame)?;
        let (Body::Whole(channel) | Body::Shortened(channel)) = body;
        frame.channel = channels.numbered(u64::from(channel));
        Some(body)
    };
    Some(parts())
}

fn id(raw: u32) -> CanId {
    match raw & 1 << 31 {
        0 => CanId::standard(raw),
        _ => CanId::extended(raw),
    }
}

/// Takes as many bytes of data as the frame has, none for a remote one. Loggers may end an object with the last byte that is not zero.
fn take_data(from: &[u8], len: usize, channel: u16, frame: &mut Frame) -> Option<Body> {
    let len = match frame.kind {
        FrameKind::Remote => 0,
        _ => len,
    };
    let mut data = [0; MOST_DATA_BYTES];
    let data = data.get_mut(..len)?;
    let found = from.get(..from.len().min(len))?;
    data.get_mut(..found.len())?.copy_from_slice(found);
    frame.set_data(data).then_some(())?;
    Some(match found.len() < len {
        true => Body::Shortened(channel),
        false => Body::Whole(channel),
    })
}

fn classical(body: &[u8], frame: &mut Frame) -> Option<Body> {
    const REMOTE: u8 = 0x80;
    const DATA_AT: usize = 8;
    let (channel, flags, dlc) = (u16_at(body, 0)?, *body.get(2)?, *body.get(3)?);
    frame.id = id(u32_at(body, 4)?);
    frame.is_fd = false;
    frame.kind = kind(flags & REMOTE != 0);
    take_data(
        body.get(DATA_AT..)?,
        usize::from(dlc.min(8)),
        channel,
        frame,
    )
}

fn kind(is_remote: bool) -> FrameKind {
    match is_remote {
        true => FrameKind::Remote,
        false => FrameKind::Data,
    }
}

fn error(body: &[u8], frame: &mut Frame) -> Option<Body> {
    error_of(u16_at(body, 0)?, frame)
}

fn fd_error_64(body: &[u8], frame: &mut Frame) -> Option<Body> {
    error_of(u16::from(*body.first()?), frame)
}

fn error_of(channel: u16, frame: &mut Frame) -> Option<Body> {
    frame.set_error();
    frame.is_fd = false;
    Some(Body::Whole(channel))
}

fn fd(body: &[u8], frame: &mut Frame) -> Option<Body> {
    const REMOTE: u8 = 0x80;
    const DATA_AT: usize = 20;
    let (channel, flags) = (u16_at(body, 0)?, *body.get(2)?);
    frame.id = id(u32_at(body, 4)?);
    let (fd_flags, valid) = (*body.get(13)?, usize::from(*body.get(14)?));
    frame.is_fd = fd_flags & 1 != 0;
    frame.kind = kind(flags & REMOTE != 0);
    take_data(
        body.get(DATA_AT..).unwrap_or_default(),
        valid,
        channel,
        frame,
    )
}

fn fd_64(body: &[u8], frame: &mut Frame) -> Option<Body> {
    const REMOTE: u32 = 0x10;
    const FD: u32 = 0x1000;
    const DATA_AT: usize = 40;
    let (channel, dlc, valid) = (*body.first()?, *body.get(1)?, usize::from(*body.get(2)?));
    frame.id = id(u32_at(body, 4)?);
    let flags = u32_at(body, 12)?;
    frame.is_fd = flags & FD != 0;
    frame.kind = kind(flags & REMOTE != 0);
    let data = body.get(DATA_AT..).unwrap_or_default();
    take_data(data, valid.min(fd_length(dlc)), u16::from(channel), frame)
}

/// A SYSTEMTIME of Windows: year, month, day of week, day, hour, minute, second, millisecond.
fn system_time_ns(header: &[u8], at: usize) -> Option<i64> {
    let field = |index: usize| u16_at(header, at + 2 * index).map(i64::from);
    let (year, month, day) = (field(0)?, field(1)?, field(3)?);
    let (hour, minute, second, millisecond) = (field(4)?, field(5)?, field(6)?, field(7)?);
    (second < 60 && millisecond < 1000).then_some(())?;
    let second_ns = second * 1_000_000_000 + millisecond * 1_000_000;
    unix_ns([year, month, day], [hour, minute], second_ns)
}
