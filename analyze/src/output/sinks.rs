//! Sinks for the rows of an analysis while they are computed: the table of samples, the report's sketch, and the derived log.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};
use tempfile::TempPath;
use tipwatch_mechanics::machine::Machine;

use super::options::{DERIVED, OutputOptions, Outputs, SAMPLES};
use crate::analysis::run::{Prepared, RowSink};
use crate::base::files::{make_folder, unfinished_in};
use crate::base::options::Precision;
use crate::base::provenance::Provenance;
use crate::base::rows::Rows;
use crate::events::Event;
use crate::load::MeasuredLoads;
use crate::report::SketchPass;
use crate::tables::derived::DerivedPass;
use crate::tables::parquet::{TableWriter, provenance_entry};
use crate::tables::samples;

/// Takes the rows of an analysis for its files.
pub struct Sinks {
    pub(super) options: OutputOptions,
    pub(super) samples: SamplesFile,
    /// Outputs that only the whole set of files has.
    pub(super) documents: Option<Documents>,
}

/// The sketch of the report, and the derived log.
pub(super) struct Documents {
    pub(super) sketch: SketchPass,
    pub(super) derived: DerivedPass,
}

impl Sinks {
    /// Begins the files before the first row, and creates the folder if it is missing.
    ///
    /// # Errors
    /// The folder or a file in it cannot be created.
    pub fn begin(prepared: &Prepared<'_>, folder: &Path, options: OutputOptions) -> Result<Self> {
        make_folder(folder)?;
        let samples = SamplesFile {
            machine: prepared.machine.clone(),
            folder: folder.into(),
            precision: options.precision,
            measured_loads: Arc::clone(prepared.measured_loads),
            file: None,
        };
        let documents = match options.outputs {
            Outputs::Samples => None,
            Outputs::All => {
                // what held the samples of the log is free, and these take more than the rows
                tipwatch_allocator::give_back();
                let path = folder.join(DERIVED);
                let (precision, rows) = (options.precision, options.derived);
                Some(Documents {
                    sketch: SketchPass::begin(prepared),
                    derived: DerivedPass::begin(prepared, precision, rows, &path)?,
                })
            }
        };
        Ok(Self {
            options,
            samples,
            documents,
        })
    }
}

impl RowSink for Sinks {
    fn take(&mut self, rows: &Arc<Rows>) -> Result<()> {
        let documents = &mut self.documents;
        let (samples, documents) = rayon::join(
            || self.samples.take(rows),
            || match documents {
                Some(documents) => {
                    documents.sketch.add(rows);
                    documents.derived.take(rows)
                }
                None => Ok(()),
            },
        );
        samples.and(documents)
    }

    fn settle(&mut self, row: usize, time_ns: Option<i64>, events: &[Event]) -> Result<()> {
        match &mut self.documents {
            Some(documents) => documents.derived.settle(row, time_ns, events),
            None => Ok(()),
        }
    }
}

/// `samples.parquet` while it is written, under another name until it is complete.
pub(super) struct SamplesFile {
    machine: Machine,
    folder: PathBuf,
    precision: Precision,
    measured_loads: Arc<MeasuredLoads>,
    file: Option<(TableWriter, TempPath)>,
}

impl SamplesFile {
    fn take(&mut self, rows: &Rows) -> Result<()> {
        let block = samples::samples(&self.machine, rows, self.precision, &self.measured_loads);
        let (writer, _) = match &mut self.file {
            Some(file) => file,
            none => {
                let (file, path) = unfinished_in(&self.folder, SAMPLES)?;
                none.insert((TableWriter::begin(file, &path, &block, &[])?, path))
            }
        };
        writer.write(&block)
    }

    /// Completes the file.
    pub(super) fn finish(self, provenance: &Provenance, path: &Path) -> Result<()> {
        let Some((mut writer, unfinished)) = self.file else {
            return Ok(());
        };
        let (key, value) = provenance_entry(provenance)?;
        writer.add_metadata(key, value);
        writer.finish()?;
        unfinished
            .persist(path)
            .with_context(|| format!("{}: cannot be written", path.display()))
    }
}
