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

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use tipwatch_ingest::Ros2Writer;
use tipwatch_mechanics::{Placement, State};

use self::diagnostics::Diagnostics;
use self::flat::FlatTopic;
use self::markers::Markers;
use self::selection::Selection;
use self::verdict::VerdictTopic;
use crate::analysis::Analysis;
use crate::base::options::{DerivedRows, Precision};
use crate::base::rows::Rows;

/// Period of diagnostics and markers around events (ns).
const BETWEEN_PICTURES_NS: i64 = 100_000_000;
/// Their period elsewhere (ns).
const BETWEEN_FEW_PICTURES_NS: i64 = 1_000_000_000;

/// A file with its messages, before its attachments.
pub(crate) struct Derived<'a> {
    analysis: &'a Analysis,
    writer: Ros2Writer,
}

impl<'a> Derived<'a> {
    /// Creates or replaces the file and writes its messages.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn begin(
        analysis: &'a Analysis,
        precision: Precision,
        rows: DerivedRows,
        path: &Path,
    ) -> Result<Self> {
        match fs::remove_file(path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(error).context(format!("{}: cannot be replaced", path.display()));
            }
            _ => {}
        }
        let mut writer = Ros2Writer::create(path)?;
        let selection = Selection::of(&analysis.events, rows);
        let like = analysis.rows.no_rows();
        let mut topics = Topics::begin(analysis, &like, precision, &mut writer)?;
        let rows = &analysis.rows;
        rows.feed(&mut |rows| topics.write(rows, &selection, &mut writer))?;
        Ok(Self { analysis, writer })
    }

    /// Attaches the report and the sources, and finishes the file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn finish(mut self, report: &str) -> Result<()> {
        let (times_ns, sources) = (&self.analysis.rows.times_ns, &self.analysis.sources);
        let time_ns = times_ns.first().copied().unwrap_or(0);
        for (name, media_type, text) in [
            ("report.html", "text/html", report),
            ("machine.toml", "application/toml", &sources.machine_file),
            ("machine.urdf", "application/xml", &sources.urdf),
        ] {
            self.writer
                .attach(name, media_type, time_ns, text.as_bytes())?;
        }
        self.writer
            .metadata("tipwatch", provenance(self.analysis))?;
        Ok(self.writer.finish()?)
    }
}

/// The topics of the rows.
struct Topics<'a> {
    flat: Vec<FlatTopic<'a>>,
    verdict: Option<VerdictTopic<'a>>,
    diagnostics: Diagnostics<'a>,
    markers: Markers<'a>,
    placement: Placement<'a>,
    state: State<f64>,
    last_picture_ns: i64,
}

impl<'a> Topics<'a> {
    /// Opens the topics for blocks with the columns of `like`.
    fn begin(
        analysis: &'a Analysis,
        like: &Rows,
        precision: Precision,
        writer: &mut Ros2Writer,
    ) -> Result<Self> {
        let machine = &analysis.machine;
        Ok(Self {
            flat: FlatTopic::all(machine, like, precision, writer)?,
            verdict: VerdictTopic::begin(machine, like, writer)?,
            diagnostics: Diagnostics::begin(analysis, writer)?,
            markers: Markers::begin(machine, writer)?,
            placement: Placement::new(machine),
            state: State::zero(machine),
            last_picture_ns: i64::MIN,
        })
    }

    /// Writes the selected rows of a block.
    fn write(&mut self, rows: &Rows, selection: &Selection, writer: &mut Ros2Writer) -> Result<()> {
        for selected in selection.rows(rows) {
            let row = selected.row;
            for topic in &mut self.flat {
                topic.write(rows, row, writer)?;
            }
            if let Some(topic) = &self.verdict {
                topic.write(rows, row, writer)?;
            }
            let period_ns = match selected.is_at_full_rate {
                true => BETWEEN_PICTURES_NS,
                false => BETWEEN_FEW_PICTURES_NS,
            };
            let time_ns = rows.times_ns[row];
            if time_ns >= self.last_picture_ns.saturating_add(period_ns) {
                self.last_picture_ns = time_ns;
                rows.states.get(row, &mut self.state);
                self.placement.place(&self.state);
                self.markers.write(rows, row, &self.placement, writer)?;
                self.diagnostics.write(rows, row, writer)?;
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
            provenance.machine_file.sha256.clone(),
        ),
        ("urdf_sha256".to_string(), provenance.urdf.sha256.clone()),
    ]);
    for (index, file) in provenance.log.iter().enumerate() {
        entries.insert(format!("log_{index}_sha256"), file.sha256.clone());
    }
    entries
}
