//! What takes the rows of an analysis while they are computed: the table of samples, and the report's sketch.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};
use tempfile::TempPath;
use tipwatch_mechanics::machine::Machine;

use super::{OutputOptions, Outputs};
use crate::analysis::run::{Prepared, RowSink};
use crate::base::files::unfinished_in;
use crate::base::options::Precision;
use crate::base::provenance::Provenance;
use crate::base::rows::Rows;
use crate::report::{Sketch, SketchPass};
use crate::tables::parquet::write::{TableWriter, provenance_entry};
use crate::tables::samples;

/// Takes the rows of an analysis for its files.
pub struct Sinks {
    pub(super) options: OutputOptions,
    samples: SamplesFile,
    sketch: Option<SketchPass>,
}

impl Sinks {
    /// Before the first row. Creates the folder if it is missing.
    ///
    /// # Errors
    /// The folder cannot be created.
    pub fn begin(prepared: &Prepared<'_>, folder: &Path, options: OutputOptions) -> Result<Self> {
        fs::create_dir_all(folder)
            .with_context(|| format!("{}: cannot be created", folder.display()))?;
        Ok(Self {
            options,
            samples: SamplesFile {
                precision: options.precision,
                machine: prepared.machine.clone(),
                folder: folder.into(),
                file: None,
            },
            sketch: (options.outputs == Outputs::All).then(|| SketchPass::begin(prepared)),
        })
    }

    pub(super) fn finish(self) -> (SamplesFile, Option<Sketch>) {
        (self.samples, self.sketch.map(SketchPass::finish))
    }
}

impl RowSink for Sinks {
    fn take(&mut self, rows: &Arc<Rows>) -> Result<()> {
        let (written, ()) = rayon::join(
            || self.samples.take(rows),
            || {
                if let Some(sketch) = &mut self.sketch {
                    sketch.add(rows);
                }
            },
        );
        written
    }
}

/// `samples.parquet` while it is written, under another name until it is complete.
pub(super) struct SamplesFile {
    machine: Machine,
    folder: PathBuf,
    precision: Precision,
    file: Option<(TableWriter, TempPath)>,
}

impl SamplesFile {
    fn take(&mut self, rows: &Rows) -> Result<()> {
        let block = samples::samples(&self.machine, rows, self.precision);
        let (writer, _) = match &mut self.file {
            Some(file) => file,
            none => {
                let path = unfinished_in(&self.folder, super::SAMPLES)?;
                none.insert((TableWriter::create(&path, &block, &[])?, path))
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
