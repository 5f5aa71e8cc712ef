//! Rows on stdout: the one place of this program that writes there.
//!
//! With `--json` every row is one line, schema 1:
//!
//! | key | meaning |
//! |---|---|
//! | `schema` | 1 |
//! | `time_ns` | time of the row, by the clock of the joint states |
//! | `valid`, `reasons` | whether the row is valid, and why not |
//! | `load_n` | load by wheel, names in lower case |
//! | `otf_n` | load with all wheels held to the ground, by wheel |
//! | `load_min_n`, `load_max_n` | least and largest load that equilibrium allows, by wheel |
//! | `zmp_x_m`, `zmp_y_m`, `zmp_margin_m` | centre of pressure, and its distance from the nearest edge |
//! | `normal_force_n` | sum of the loads |
//!
//! Numbers are printed so that reading them gives the same bits; one that cannot be computed is null.

use std::io::{self, Stdout, Write};

use serde::ser::{Serialize, SerializeMap, Serializer};
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::signal::{Reason, Reasons};

use crate::monitor::Row;

/// Rows that people can follow: one in this time, by the rows' clock, in nanoseconds.
const LINE_PERIOD_NS: u64 = 200_000_000;

/// How rows are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Every row as JSON.
    Json,
    /// Some rows as text.
    Text,
}

/// Prints rows to stdout.
#[derive(Debug)]
pub struct Printer {
    format: Format,
    wheels: Vec<String>,
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    out: io::BufWriter<Stdout>,
}

impl Printer {
    /// A printer that has printed nothing.
    #[must_use]
    pub fn new(format: Format, machine: &Machine) -> Self {
        Self {
            format,
            wheels: machine
                .wheels()
                .iter()
                .map(|wheel| wheel.name.to_lowercase())
                .collect(),
            first_ns: None,
            last_ns: None,
            out: io::BufWriter::with_capacity(1 << 16, io::stdout()),
        }
    }

    /// Prints a row, or leaves it out if text would come too fast.
    ///
    /// # Errors
    /// Stdout cannot be written.
    pub fn row(&mut self, row: &Row<'_>) -> io::Result<()> {
        match self.format {
            Format::Json => write_json(&mut self.out, row, &self.wheels),
            Format::Text => self.text(row),
        }
    }

    /// Makes what was printed so far visible.
    ///
    /// # Errors
    /// Stdout cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    fn text(&mut self, row: &Row<'_>) -> io::Result<()> {
        let is_early = |last: i64| row.time_ns.abs_diff(last) < LINE_PERIOD_NS;
        if self.last_ns.is_some_and(is_early) {
            return Ok(());
        }
        self.last_ns = Some(row.time_ns);
        let first_ns = *self.first_ns.get_or_insert(row.time_ns);
        write!(
            self.out,
            "{:8.2} s  load",
            row.time_ns.saturating_sub(first_ns) as f64 * 1e-9
        )?;
        let loads = row.outcome.load.iter().zip(&row.outcome.otf);
        for (wheel, (load, otf)) in self.wheels.iter().zip(loads) {
            write!(self.out, "  {wheel} {load:.0} N (otf {otf:.0})")?;
        }
        write!(self.out, "  zmp margin {:.3} m", row.outcome.zmp_margin)?;
        for reason in row.reasons.iter() {
            write!(self.out, "  {}", reason.name())?;
        }
        writeln!(self.out)
    }
}

/// Writes a row as one line of JSON; `wheels` are the keys of the wheels.
///
/// # Errors
/// `out` cannot be written.
pub fn write_json(out: &mut impl Write, row: &Row<'_>, wheels: &[String]) -> io::Result<()> {
    serde_json::to_writer(&mut *out, &JsonRow { row, wheels })?;
    out.write_all(b"\n")
}

struct JsonRow<'a> {
    row: &'a Row<'a>,
    wheels: &'a [String],
}

impl Serialize for JsonRow<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (row, outcome) = (self.row, self.row.outcome);
        let by_wheel = |values| ByWheel {
            wheels: self.wheels,
            values,
        };
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("schema", &1)?;
        map.serialize_entry("time_ns", &row.time_ns)?;
        map.serialize_entry("valid", &row.reasons.is_empty())?;
        map.serialize_entry("reasons", &Names(row.reasons))?;
        map.serialize_entry("load_n", &by_wheel(&outcome.load))?;
        map.serialize_entry("otf_n", &by_wheel(&outcome.otf))?;
        map.serialize_entry("load_min_n", &by_wheel(&outcome.load_least))?;
        map.serialize_entry("load_max_n", &by_wheel(&outcome.load_largest))?;
        map.serialize_entry("zmp_x_m", &outcome.zmp_x)?;
        map.serialize_entry("zmp_y_m", &outcome.zmp_y)?;
        map.serialize_entry("zmp_margin_m", &outcome.zmp_margin)?;
        map.serialize_entry("normal_force_n", &outcome.normal_force)?;
        map.end()
    }
}

struct ByWheel<'a> {
    wheels: &'a [String],
    values: &'a [f64],
}

impl Serialize for ByWheel<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.wheels.iter().zip(self.values))
    }
}

struct Names(Reasons);

impl Serialize for Names {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(Reason::name))
    }
}
