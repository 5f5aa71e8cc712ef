//! `derived.mcap`: the results as messages for plotting in standard viewers.
//!
//! Flat messages of numbers with embedded definitions, in CDR (common data representation), at the time of
//! each row on the log's own clock: all rows around events, few elsewhere. Diagnostics and markers at up to
//! 10 Hz around events, 1 Hz elsewhere. Report, URDF and machine file as attachments. Numbers that cannot be
//! computed are NaN.

mod diagnostics;
mod flat;
mod markers;
mod messages;
mod selection;
mod verdict;

use std::collections::{BTreeMap, VecDeque};
use std::fs;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use tempfile::TempPath;
use tipwatch_ingest::Ros2Writer;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{Placement, State};

use self::diagnostics::Diagnostics;
use self::flat::FlatTopic;
use self::markers::Markers;
use self::selection::{SelectedRow, Selection};
use self::verdict::VerdictTopic;
use crate::analysis::Analysis;
use crate::analysis::run::{Prepared, RowSink};
use crate::base::files::unfinished_of;
use crate::base::options::{DerivedRows, Precision};
use crate::base::rows::Rows;
use crate::events::Event;

/// Period of diagnostics and markers around events (ns).
const BETWEEN_PICTURES_NS: i64 = 100_000_000;
/// Period of pictures elsewhere (ns).
const BETWEEN_FEW_PICTURES_NS: i64 = 1_000_000_000;

/// Most blocks that wait until all events around their rows are known. The rows after them are computed once more.
const MOST_WAITING: usize = 16;

/// The file while the rows of its analysis are computed.
pub(crate) struct DerivedPass {
    machine: Machine,
    writer: Ros2Writer,
    topics: Topics,
    selection: Selection,
    input_events: Vec<Event>,
    waiting: VecDeque<Arc<Rows>>,
    /// The first row that is neither written nor waits.
    next: usize,
    /// Whether later rows are left for the end, because too many waited.
    is_behind: bool,
    unfinished: TempPath,
}

impl DerivedPass {
    /// Begins a file in a folder, under another name until it is complete.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn begin(
        prepared: &Prepared<'_>,
        precision: Precision,
        rows: DerivedRows,
        path: &Path,
    ) -> Result<Self> {
        let (_, unfinished) = unfinished_of(path)?;
        fs::remove_file(&unfinished)?;
        let mut writer = Ros2Writer::create(&unfinished)?;
        let machine = prepared.machine.clone();
        let like = prepared.table.no_rows();
        Ok(Self {
            topics: Topics::begin(
                &machine,
                prepared.input_events,
                &like,
                precision,
                &mut writer,
            )?,
            machine,
            writer,
            selection: Selection::new(rows),
            input_events: prepared.input_events.to_vec(),
            waiting: VecDeque::new(),
            next: 0,
            is_behind: false,
            unfinished,
        })
    }

    /// Writes the rows whose events are known: those well before the row `settled`.
    fn write_settled(
        &mut self,
        settled: usize,
        time_ns: Option<i64>,
        events: &[Event],
    ) -> Result<()> {
        let full_rate = (self.selection).full_rate(events.iter().chain(&self.input_events));
        while let Some(block) = self.waiting.front() {
            let is_known = time_ns.is_none_or(|time_ns| {
                let last_ns = block.times_ns.last().copied().unwrap_or(i64::MIN);
                block.first + block.len() <= settled
                    && last_ns.saturating_add(Selection::AHEAD_NS) < time_ns
            });
            if !is_known {
                break;
            }
            let selected = self.selection.add(block, 0, &full_rate);
            (self.topics).write(&self.machine, selected, &mut self.writer)?;
            self.waiting.pop_front();
        }
        Ok(())
    }

    /// Writes the remaining rows.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn write_rest(&mut self, analysis: &Analysis) -> Result<()> {
        self.write_settled(usize::MAX, None, &analysis.events)?;
        let events = analysis.events.iter().chain(&self.input_events);
        let full_rate = self.selection.full_rate(events);
        if self.is_behind {
            analysis.rows.feed(&mut |rows| {
                let first = self.next.saturating_sub(rows.first);
                let selected = self.selection.add(rows, first, &full_rate);
                (self.topics).write(&self.machine, selected, &mut self.writer)
            })?;
        }
        let selected = self.selection.end_bin(&full_rate);
        (self.topics).write(&self.machine, selected, &mut self.writer)
    }

    /// Writes the attachments, and gives the file its name.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn finish(mut self, analysis: &Analysis, report: &str, path: &Path) -> Result<()> {
        let (times_ns, sources) = (&analysis.rows.times_ns, &analysis.sources);
        let time_ns = times_ns.first().copied().unwrap_or(0);
        for (name, media_type, text) in [
            ("report.html", "text/html", report),
            ("machine.toml", "application/toml", &sources.machine_file),
            ("machine.urdf", "application/xml", &sources.urdf),
        ] {
            self.writer
                .attach(name, media_type, time_ns, text.as_bytes())?;
        }
        self.writer.metadata("tipwatch", provenance(analysis))?;
        self.writer.finish()?;
        (self.unfinished.persist(path))
            .with_context(|| format!("{}: cannot be written", path.display()))
    }
}

impl RowSink for DerivedPass {
    fn take(&mut self, rows: &Arc<Rows>) -> Result<()> {
        self.is_behind |= self.waiting.len() >= MOST_WAITING;
        if !self.is_behind {
            self.waiting.push_back(Arc::clone(rows));
            self.next = rows.first + rows.len();
        }
        Ok(())
    }

    fn settle(&mut self, row: usize, time_ns: Option<i64>, events: &[Event]) -> Result<()> {
        self.write_settled(row, time_ns, events)
    }
}

/// The topics of the rows.
struct Topics {
    flat: Vec<FlatTopic>,
    verdict: Option<VerdictTopic>,
    diagnostics: Diagnostics,
    markers: Markers,
    state: State<f64>,
    last_picture_ns: i64,
}

impl Topics {
    /// Opens the topics for blocks with the columns of `like`.
    fn begin(
        machine: &Machine,
        input_events: &[Event],
        like: &Rows,
        precision: Precision,
        writer: &mut Ros2Writer,
    ) -> Result<Self> {
        Ok(Self {
            flat: FlatTopic::all(machine, like, precision, writer)?,
            verdict: VerdictTopic::begin(like, writer)?,
            diagnostics: Diagnostics::begin(input_events, writer)?,
            markers: Markers::begin(writer)?,
            state: State::zero(machine),
            last_picture_ns: i64::MIN,
        })
    }

    /// Writes selected rows.
    fn write(
        &mut self,
        machine: &Machine,
        rows: Vec<SelectedRow>,
        writer: &mut Ros2Writer,
    ) -> Result<()> {
        let mut placement = Placement::new(machine);
        for selected in rows {
            let (rows, row) = (&*selected.block, selected.row);
            for topic in &mut self.flat {
                topic.write(machine, rows, row, writer)?;
            }
            if let Some(topic) = &self.verdict {
                topic.write(machine, rows, row, writer)?;
            }
            let period_ns = match selected.is_at_full_rate {
                true => BETWEEN_PICTURES_NS,
                false => BETWEEN_FEW_PICTURES_NS,
            };
            let time_ns = rows.times_ns[row];
            if time_ns >= self.last_picture_ns.saturating_add(period_ns) {
                self.last_picture_ns = time_ns;
                rows.states.get(row, &mut self.state);
                placement.place(&self.state);
                (self.markers).write(machine, rows, row, &placement, writer)?;
                self.diagnostics.write(machine, rows, row, writer)?;
            }
        }
        Ok(())
    }
}

/// Metadata of the file.
fn provenance(analysis: &Analysis) -> BTreeMap<String, String> {
    let provenance = &analysis.provenance;
    let mut entries = BTreeMap::from([
        (
            "tipwatch_version".to_string(),
            provenance.tipwatch_version.clone(),
        ),
        ("machine".to_string(), analysis.machine.name().to_string()),
        (
            "model".to_string(),
            analysis.options.model.name().to_string(),
        ),
        (
            "machine_file_sha256".to_string(),
            provenance.machine_file.hash_text().to_string(),
        ),
        (
            "urdf_sha256".to_string(),
            provenance.urdf.hash_text().to_string(),
        ),
    ]);
    for (index, file) in provenance.log.iter().enumerate() {
        entries.insert(format!("log_{index}_sha256"), file.hash_text().to_string());
    }
    entries
}
