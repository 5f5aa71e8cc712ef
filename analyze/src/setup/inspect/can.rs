//! The messages on the CAN buses of a log.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use anyhow::Result;
use serde::Serialize;
use tipwatch_binding::{MachineFile, read_dbc};
use tipwatch_can::j1939::{self, Identifier};
use tipwatch_can::{
    Addressing, CanId, Database, Decoder, Frame, FrameKind, Message, Selection, Signal,
};
use tipwatch_ingest::{Log, Losses, Topic};

/// Buses have some hundreds of identifiers; further ones are counted together.
pub(crate) const MOST_IDS: usize = 2048;

/// A DBC file that was read.
#[derive(Debug)]
pub struct Described {
    /// The file.
    pub path: PathBuf,
    /// Description of the messages in the file.
    pub database: Database,
}

/// Reads the DBC files that were given and those that the machine file names.
///
/// # Errors
/// A file cannot be read, or is not a DBC file.
pub fn read_databases(given: &[PathBuf], file: Option<&MachineFile>) -> Result<Vec<Described>> {
    let mut paths = given.to_vec();
    paths.extend(file.map(MachineFile::dbc_files).unwrap_or_default());
    let mut databases: Vec<Described> = Vec::new();
    for path in paths {
        if !databases.iter().any(|known| known.path == path) {
            let database = read_dbc(&path)?;
            databases.push(Described { path, database });
        }
    }
    Ok(databases)
}

/// One bus.
#[derive(Debug, Default, Serialize)]
pub(super) struct BusInspection {
    /// The topic of its frames.
    topic: String,
    frames: u64,
    error_frames: u64,
    remote_frames: u64,
    messages: Vec<MessageInspection>,
    /// Frames of identifiers beyond those listed.
    other_frames: u64,
}

/// The frames of one identifier, or one message of several packets.
#[derive(Debug, Serialize)]
struct MessageInspection {
    /// Hexadecimal, of 3 or 8 digits.
    id: String,
    pgn: Option<u32>,
    source: Option<u8>,
    name: Option<String>,
    /// The DBC file, or "SAE J1939".
    described_by: Option<String>,
    frames: u64,
    /// Log time (ns) of the first and the last frame; null for messages of several packets.
    start_ns: Option<i64>,
    end_ns: Option<i64>,
    duration_s: Option<f64>,
    rate_hz: Option<f64>,
    signals: Vec<CanSignalInspection>,
    /// Notes on values that did not become numbers.
    notes: Vec<String>,
}

#[derive(Debug, Serialize)]
struct CanSignalInspection {
    name: String,
    /// The unit of the values here.
    unit: String,
    numbers: u64,
    first: Option<f64>,
    last: Option<f64>,
    least: Option<f64>,
    greatest: Option<f64>,
}

/// The numbers of one signal.
#[derive(Debug, Clone, Copy, Default)]
struct Numbers {
    count: u64,
    first: f64,
    last: f64,
    least: f64,
    greatest: f64,
}

impl Numbers {
    fn take(&mut self, value: f64) {
        if self.count == 0 {
            (self.first, self.least, self.greatest) = (value, value, value);
        }
        self.count += 1;
        self.last = value;
        self.least = self.least.min(value);
        self.greatest = self.greatest.max(value);
    }
}

/// Frames of an identifier that were seen.
struct IdentifierFrames {
    frames: u64,
    first_ns: i64,
    last_ns: i64,
    decoder: Option<Reading>,
}

/// A signal of a message, as its description and the log have it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct KnownSignal {
    pub(crate) name: String,
    /// The unit of its numbers; empty if none is described.
    pub(crate) unit: String,
    /// Whether the signal is described with a known unit, so that the numbers are in SI units.
    pub(crate) is_si: bool,
    /// Its least and its greatest number; `None` if the log has none.
    pub(crate) span: Option<[f64; 2]>,
}

/// The signals of a message.
pub(crate) struct Reading {
    decoder: Decoder,
    described_by: String,
    numbers: Vec<Numbers>,
}

/// Lists the messages of all buses; adds the losses.
pub(super) fn inspect(
    log: &Log,
    databases: &[Described],
    losses: &mut Losses,
) -> Result<Vec<BusInspection>> {
    let buses: Vec<&Topic> = log.can_buses().collect();
    let mut inspections = Vec::with_capacity(buses.len());
    for bus in buses {
        let mut inspection = BusInspection {
            topic: bus.name.clone(),
            ..BusInspection::default()
        };
        let mut seen: BTreeMap<CanId, IdentifierFrames> = BTreeMap::new();
        let mut long = long_messages(databases);
        let found = log.read_can_frames(bus.id, &mut |frame| {
            inspection.take(frame, databases, &mut seen);
            for reading in &mut long {
                reading.take(frame);
            }
        })?;
        losses.merge(&found);
        let listed = seen.into_iter().map(|(id, seen)| seen.inspection(id));
        inspection.messages = listed.collect();
        let long = long.into_iter().filter_map(Reading::long_inspection);
        inspection.messages.extend(long);
        inspections.push(inspection);
    }
    Ok(inspections)
}

impl BusInspection {
    fn take(
        &mut self,
        frame: &Frame,
        databases: &[Described],
        seen: &mut BTreeMap<CanId, IdentifierFrames>,
    ) {
        self.frames += 1;
        match frame.kind {
            FrameKind::Error => {
                self.error_frames += 1;
                return;
            }
            FrameKind::Remote => self.remote_frames += 1,
            FrameKind::Data => {}
        }
        if seen.len() == MOST_IDS && !seen.contains_key(&frame.id) {
            self.other_frames += 1;
            return;
        }
        let seen = seen.entry(frame.id).or_insert_with(|| IdentifierFrames {
            frames: 0,
            first_ns: frame.time_ns,
            last_ns: frame.time_ns,
            decoder: reading_of(frame.id, databases),
        });
        seen.frames += 1;
        seen.first_ns = seen.first_ns.min(frame.time_ns);
        seen.last_ns = seen.last_ns.max(frame.time_ns);
        if let Some(reading) = &mut seen.decoder {
            reading.take(frame);
        }
    }
}

/// Reads the signals of a described identifier.
fn reading_of(id: CanId, databases: &[Described]) -> Option<Reading> {
    let (path, message) = descriptions_of(id, databases).into_iter().next()?;
    Some(Reading::of(&message, path))
}

/// The descriptions of an identifier: by the first DBC file that has it, then its public parameter group. With the file,
/// if it is one.
pub(crate) fn descriptions_of(id: CanId, databases: &[Described]) -> Vec<(Option<&Path>, Message)> {
    let group = Identifier::of(id);
    let is_of = |message: &&Message| match (message.addressing, group) {
        (Addressing::Id(of), _) => of == id,
        (Addressing::ParameterGroup { pgn, source }, Some(group)) => {
            pgn == group.pgn && source.is_none_or(|source| source == group.source)
        }
        (Addressing::ParameterGroup { .. }, None) => false,
    };
    let of_file = databases.iter().find_map(|described| {
        let message = described.database.messages.iter().find(is_of)?;
        Some((Some(described.path.as_path()), message.clone()))
    });
    let public = group.and_then(|group| j1939::public_group(group.pgn));
    let public = public.map(|message| (None, message));
    of_file.into_iter().chain(public).collect()
}

/// Messages that no single frame holds.
fn long_messages(databases: &[Described]) -> Vec<Reading> {
    let mut readings = Vec::new();
    for described in databases {
        let messages = described.database.messages.iter();
        let is_long = |message: &&Message| message.pgn().is_some() && message.len > 8;
        for message in messages.filter(is_long) {
            readings.push(Reading::of(message, Some(&described.path)));
        }
    }
    readings
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

impl Reading {
    /// Reads the signals of a message that this DBC file describes, or that is public.
    pub(crate) fn of(message: &Message, file: Option<&Path>) -> Self {
        Self {
            numbers: vec![Numbers::default(); message.signals.len()],
            decoder: Decoder::new(vec![Selection::of(message.clone())]),
            described_by: file.map_or("SAE J1939".into(), file_name),
        }
    }

    pub(crate) fn take(&mut self, frame: &Frame) {
        let numbers = &mut self.numbers;
        self.decoder.decode(frame, &mut |_, values| {
            for (numbers, value) in numbers.iter_mut().zip(values) {
                if value.is_finite() {
                    numbers.take(*value);
                }
            }
        });
    }

    fn message(&self) -> Option<&Message> {
        self.decoder
            .selections()
            .next()
            .map(|selection| &selection.message)
    }

    /// Returns the known properties of each signal.
    pub(crate) fn known(&self) -> impl Iterator<Item = KnownSignal> {
        self.signals()
            .into_iter()
            .zip(self.described())
            .map(|(signal, described)| KnownSignal {
                is_si: described.is_converted && !signal.unit.is_empty(),
                span: signal
                    .least
                    .zip(signal.greatest)
                    .map(|(least, greatest)| [least, greatest]),
                name: signal.name,
                unit: signal.unit,
            })
    }

    fn described(&self) -> &[Signal] {
        let message = self.message();
        message.map_or(&[], |message| message.signals.as_slice())
    }

    fn signals(&self) -> Vec<CanSignalInspection> {
        let both = self.described().iter().zip(&self.numbers);
        both.map(|(signal, numbers)| {
            let known = |number: f64| (numbers.count > 0).then_some(number);
            CanSignalInspection {
                name: signal.name.clone(),
                unit: match signal.is_converted {
                    true => signal.si.symbol.into(),
                    false => signal.unit.clone(),
                },
                numbers: numbers.count,
                first: known(numbers.first),
                last: known(numbers.last),
                least: known(numbers.least),
                greatest: known(numbers.greatest),
            }
        })
        .collect()
    }

    fn notes(&self) -> Vec<String> {
        let tally = self.decoder.tally(0);
        let lines = tally
            .zip(self.message())
            .map(|(tally, message)| message.told(&tally));
        lines.unwrap_or_default()
    }

    /// Inspects messages of several packets; `None` if there were none.
    fn long_inspection(self) -> Option<MessageInspection> {
        let tally = self.decoder.tally(0)?;
        let message = self.message()?;
        (tally.frames + tally.incomplete > 0).then(|| MessageInspection {
            id: "transport".into(),
            pgn: message.pgn(),
            source: tally.sources.keys().next().copied(),
            name: Some(message.name.clone()),
            described_by: Some(self.described_by.clone()),
            frames: tally.frames,
            start_ns: None,
            end_ns: None,
            duration_s: None,
            rate_hz: None,
            signals: self.signals(),
            notes: self.notes(),
        })
    }
}

impl IdentifierFrames {
    fn inspection(self, id: CanId) -> MessageInspection {
        let group = Identifier::of(id);
        let span_s = self.last_ns.saturating_sub(self.first_ns) as f64 * 1e-9;
        let periods = self.frames.saturating_sub(1) as f64;
        let reading = self.decoder;
        let message = reading.as_ref().and_then(Reading::message);
        MessageInspection {
            id: match id.is_extended {
                true => format!("{:08X}", id.raw),
                false => format!("{:03X}", id.raw),
            },
            pgn: group.map(|group| group.pgn),
            source: group.map(|group| group.source),
            name: message.map(|message| message.name.clone()),
            described_by: reading.as_ref().map(|reading| reading.described_by.clone()),
            frames: self.frames,
            start_ns: Some(self.first_ns),
            end_ns: Some(self.last_ns),
            duration_s: Some(span_s),
            rate_hz: (span_s > 0.0).then(|| periods / span_s),
            signals: reading.as_ref().map(Reading::signals).unwrap_or_default(),
            notes: reading.as_ref().map(Reading::notes).unwrap_or_default(),
        }
    }
}

impl fmt::Display for BusInspection {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            out,
            "CAN messages of {} ({} frames)",
            self.topic, self.frames
        )?;
        for message in &self.messages {
            write!(out, "{message}")?;
        }
        let others = [
            (self.error_frames, "error frames of the bus"),
            (self.remote_frames, "remote frames, which carry no data"),
            (self.other_frames, "frames of further identifiers"),
        ];
        for (count, what) in others.into_iter().filter(|(count, _)| *count > 0) {
            writeln!(out, "  {count} {what}")?;
        }
        Ok(())
    }
}

impl fmt::Display for MessageInspection {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.name.as_deref().unwrap_or("not described");
        write!(out, "  {:<9} {name:<28} {:>8} frames", self.id, self.frames)?;
        if let Some(rate_hz) = self.rate_hz {
            write!(out, ", {rate_hz:.2} Hz")?;
        }
        if let Some(duration_s) = self.duration_s {
            write!(out, ", {duration_s:.3} s")?;
        }
        if let (Some(pgn), Some(source)) = (self.pgn, self.source) {
            write!(out, ", PGN {pgn} from source {source}")?;
        }
        match &self.described_by {
            Some(by) => writeln!(out, ", described by {by}")?,
            None => writeln!(out)?,
        }
        for signal in &self.signals {
            write!(
                out,
                "      {:<28} {:>8} numbers",
                signal.name, signal.numbers
            )?;
            if let (Some(least), Some(greatest)) = (signal.least, signal.greatest) {
                write!(out, ", {least:.4} to {greatest:.4} {}", signal.unit)?;
            }
            if let (Some(first), Some(last)) = (signal.first, signal.last) {
                write!(out, ", first {first:.4}, last {last:.4}")?;
            }
            writeln!(out)?;
        }
        for note in &self.notes {
            writeln!(out, "      {note}")?;
        }
        Ok(())
    }
}
