//! Tables of CAN frames, as loggers and programs export them: they are read through a private copy as text of candump.

use std::{
    fmt::Write as _,
    io::{self, BufRead, Write},
};

use base64::{Engine as _, engine::general_purpose::STANDARD};

use super::lines::{each_line, without_mark};

/// A table of frames whose columns are known, by the names that its program gives them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FrameTable {
    /// SavvyCAN, GVRET: microseconds, hexadecimal, a column for each byte.
    SavvyCan,
    /// Converters of CSS Electronics (CANedge): seconds since 1970, hexadecimal.
    Css,
    /// python-can: seconds since 1970, hexadecimal with `0x`, bytes in base 64.
    PythonCan,
}

const TABLES: [(FrameTable, &[&str]); 3] = [
    (
        FrameTable::SavvyCan,
        &["Time Stamp", "ID", "Extended", "Bus", "LEN", "D1"],
    ),
    (
        FrameTable::Css,
        &[
            "TimestampEpoch",
            "BusChannel",
            "ID",
            "IDE",
            "DataLength",
            "DataBytes",
        ],
    ),
    (
        FrameTable::PythonCan,
        &[
            "timestamp",
            "arbitration_id",
            "extended",
            "remote",
            "error",
            "data",
        ],
    ),
];

impl FrameTable {
    /// The table whose names the first line has.
    pub(super) fn of(beginning: &[u8]) -> Option<Self> {
        let names = Columns::of(first_line(beginning))?;
        let has = |known: &&(Self, &[&str])| known.1.iter().all(|name| names.place(name).is_some());
        TABLES.iter().find(has).map(|(table, _)| *table)
    }

    /// Copies the frames. A line that is no frame stays as it is.
    pub(super) fn recode(self, source: &mut dyn BufRead, target: &mut dyn Write) -> io::Result<()> {
        let mut columns: Option<Columns> = None;
        each_line(source, &mut |line| {
            let text = std::str::from_utf8(without_mark(line))
                .unwrap_or_default()
                .trim();
            match &columns {
                None => columns = Columns::of(text),
                Some(_) if text.is_empty() => {}
                Some(columns) => {
                    let cells: Vec<&str> = columns.cells(text).collect();
                    let frame = self.frame(columns, &cells);
                    match frame.filter(|_| line.ends_with(b"\n")) {
                        Some(frame) => writeln!(target, "{frame}")?,
                        None => target.write_all(line)?,
                    }
                }
            }
            Ok(())
        })
    }

    /// A line of candump.
    fn frame(self, columns: &Columns, cells: &[&str]) -> Option<String> {
        let cell = |name: &str| cells.get(columns.place(name)?).copied();
        let is = |name: &str| cell(name).is_some_and(|cell| matches!(cell, "1" | "true" | "True"));
        let byte = |digits: &str| u8::try_from(hexadecimal(digits)?).ok();
        let (time, bus, id, is_extended, data) = match self {
            Self::SavvyCan => {
                let microseconds: u64 = cell("Time Stamp")?.parse().ok()?;
                let length: usize = cell("LEN")?.parse().ok()?;
                let first = columns.place("D1")?;
                let bytes = cells
                    .get(first..first.checked_add(length)?)?
                    .iter()
                    .map(|digits| byte(digits));
                (
                    format!(
                        "{}.{:06}",
                        microseconds / 1_000_000,
                        microseconds % 1_000_000
                    ),
                    cell("Bus")?,
                    identifier(cell("ID")?)?,
                    is("Extended"),
                    bytes.collect::<Option<Vec<u8>>>()?,
                )
            }
            Self::Css => {
                let digits = cell("DataBytes")?;
                let length: usize = cell("DataLength")?.parse().ok()?;
                let byte_at = |at: usize| byte(digits.get(2 * at..2 * at + 2)?);
                let bytes: Option<Vec<u8>> = (0..length).map(byte_at).collect();
                let id = identifier(cell("ID")?)?;
                (
                    cell("TimestampEpoch")?.to_owned(),
                    cell("BusChannel")?,
                    id,
                    is("IDE"),
                    bytes?,
                )
            }
            Self::PythonCan => {
                let id = identifier(cell("arbitration_id")?)?;
                let bytes = STANDARD.decode(cell("data")?).ok()?;
                (
                    cell("timestamp")?.to_owned(),
                    "0",
                    id,
                    is("extended"),
                    bytes,
                )
            }
        };
        let is_time = time.parse::<f64>().is_ok_and(f64::is_finite);
        let bus: u8 = bus.parse().ok().filter(|_| is_time)?;
        let mut frame = format!("({time}) can{bus} ");
        let put = match (is("error"), is_extended) {
            (true, _) => write!(frame, "20000000#"),
            (false, true) => write!(frame, "{id:08X}#"),
            (false, false) => write!(frame, "{id:03X}#"),
        };
        put.ok()?;
        if is("remote") {
            frame.push('R');
            return Some(frame);
        }
        if data.len() > 8 || is("EDL") {
            frame.push_str("#0");
        }
        data.iter()
            .try_for_each(|byte| write!(frame, "{byte:02X}"))
            .ok()?;
        Some(frame)
    }
}

fn identifier(text: &str) -> Option<u32> {
    hexadecimal(text.strip_prefix("0x").unwrap_or(text))
}

/// A number of hexadecimal digits, without a sign.
fn hexadecimal(digits: &str) -> Option<u32> {
    let are_digits = digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    let number = u32::from_str_radix(digits, 16);
    number.ok().filter(|_| are_digits)
}

/// The names of the columns.
struct Columns {
    separator: char,
    names: Vec<String>,
}

impl Columns {
    fn of(line: &str) -> Option<Self> {
        let separator = [',', ';', '\t']
            .into_iter()
            .find(|&mark| line.contains(mark))?;
        let mut columns = Self {
            separator,
            names: Vec::new(),
        };
        columns.names = columns.cells(line).map(str::to_owned).collect();
        Some(columns)
    }

    fn cells<'l>(&self, line: &'l str) -> impl Iterator<Item = &'l str> + use<'l> {
        line.split(self.separator)
            .map(|cell| cell.trim().trim_matches('"'))
    }

    fn place(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|column| column == name)
    }
}

fn first_line(beginning: &[u8]) -> &str {
    let end = beginning
        .iter()
        .position(|&byte| byte == b'\n')
        .unwrap_or(beginning.len());
    let line = beginning.get(..end).unwrap_or_default();
    std::str::from_utf8(without_mark(line))
        .unwrap_or_default()
        .trim()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frames_of_every_program_become_those_of_candump() {
        let cases = [
            (
                FrameTable::SavvyCan,
                "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n\
                 166064000,0000021A,false,Rx,0,3,00,37,C8,00,00,00,00,00,\n166064250,18FEF100,true,Rx,1,1,0A,\nend\n\
                 1,1,false,Rx,0,18446744073709551615,00,\n1,1,false,Rx,0,1,+1,\n1,+1,false,Rx,0,1,01,\n",
                "(166.064000) can0 21A#0037C8\n(166.064250) can1 18FEF100#0A\nend\n\
                 1,1,false,Rx,0,18446744073709551615,00,\n1,1,false,Rx,0,1,+1,\n1,+1,false,Rx,0,1,01,\n",
            ),
            (
                FrameTable::Css,
                "TimestampEpoch;BusChannel;ID;IDE;DLC;DataLength;Dir;EDL;BRS;DataBytes\n\
                 1700000000.161750;1;123;0;1;1;0;0;0;12\n1700000001.5;2;123;1;9;12;0;1;0;000102030405060708090A0B\n\
                 1700000002.5;1;7;0;2;2;0;0;0;1",
                "(1700000000.161750) can1 123#12\n(1700000001.5) can2 00000123##0000102030405060708090A0B\n\
                 1700000002.5;1;7;0;2;2;0;0;0;1",
            ),
            (
                FrameTable::PythonCan,
                "timestamp,arbitration_id,extended,remote,error,dlc,data\n1700000000.5,0x101,0,0,0,3,AQID\n\
                 1700000000.6,0x18fef100,1,1,0,0,\n1700000000.7,0x0,0,0,1,0,\n",
                "(1700000000.5) can0 101#010203\n(1700000000.6) can0 18FEF100#R\n(1700000000.7) can0 20000000#\n",
            ),
        ];
        for (table, text, expected) in cases {
            assert_eq!(FrameTable::of(text.as_bytes()), Some(table));
            let mut recoded = Vec::new();
            table.recode(&mut text.as_bytes(), &mut recoded).unwrap();
            assert_eq!(String::from_utf8(recoded).unwrap(), expected);
        }
        assert_eq!(FrameTable::of(b"timestamp,id,data\n"), None);
    }
}
