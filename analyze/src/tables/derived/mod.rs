//! `derived.mcap`: the results as messages for plotting in standard viewers.
//!
//! Flat messages of 64-bit numbers with embedded definitions, in CDR (common data representation), at
//! the time of each row on the log's own clock. Diagnostics and markers at up to 10 Hz. Report, URDF and
//! machine file as attachments. Numbers that cannot be computed are NaN.

mod diagnostics;
mod flat;
mod markers;
mod messages;
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
use self::verdict::VerdictTopic;
use crate::analysis::Analysis;

/// Period of diagnostics and markers (ns).
const BETWEEN_PICTURES_NS: i64 = 100_000_000;

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
    pub(crate) fn begin(analysis: &'a Analysis, path: &Path) -> Result<Self> {
        match fs::remove_file(path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(error).context(format!("{}: cannot be replaced", path.display()));
            }
            _ => {}
        }
        let mut writer = Ros2Writer::create(path)?;
        write_rows(analysis, &mut writer)?;
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

fn write_rows(analysis: &Analysis, writer: &mut Ros2Writer) -> Result<()> {
    let mut flat = FlatTopic::all(analysis, writer)?;
    let verdict = VerdictTopic::begin(analysis, writer)?;
    let diagnostics = Diagnostics::begin(analysis, writer)?;
    let markers = Markers::begin(analysis, writer)?;
    let mut placement = Placement::new(&analysis.machine);
    let mut state = State::zero(&analysis.machine);
    let mut next_picture_ns = i64::MIN;
    for (row, &time_ns) in analysis.rows.times_ns.iter().enumerate() {
        for topic in &mut flat {
            topic.write(analysis, row, writer)?;
        }
        if let Some(topic) = &verdict {
            topic.write(analysis, row, writer)?;
        }
        if time_ns >= next_picture_ns {
            next_picture_ns = time_ns.saturating_add(BETWEEN_PICTURES_NS);
            analysis.rows.states.get(row, &mut state);
            placement.place(&state);
            markers.write(row, &placement, writer)?;
            diagnostics.write(row, writer)?;
        }
    }
    Ok(())
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
