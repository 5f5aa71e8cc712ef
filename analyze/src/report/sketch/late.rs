//! A sketch that is drawn only if it is wanted after the last row.

use std::sync::Arc;

use anyhow::Result;

use super::{Detail, Sketch, SketchPass};
use crate::analysis::run::{Prepared, RowSink};
use crate::base::rows::Rows;

/// Most numbers of rows that are kept undrawn (16 MB).
const MOST_NUMBERS: usize = 2 << 20;

/// Keeps the rows of a short log and draws them when asked to, briefly. A longer log is drawn while its rows are computed.
#[derive(Debug)]
pub(crate) struct LateSketch {
    pass: SketchPass,
    /// Rows that are not drawn yet.
    undrawn: Vec<Arc<Rows>>,
    numbers: usize,
}

impl LateSketch {
    /// Before the first row.
    pub(crate) fn begin(prepared: &Prepared<'_>) -> Self {
        Self {
            pass: SketchPass::in_detail(prepared, Detail::BRIEF),
            undrawn: Vec::new(),
            numbers: 0,
        }
    }

    /// The sketch, after the last row.
    pub(crate) fn finish(mut self) -> Sketch {
        self.draw();
        self.pass.finish()
    }

    fn draw(&mut self) {
        for rows in self.undrawn.drain(..) {
            self.pass.add(&rows);
        }
    }
}

impl RowSink for LateSketch {
    fn take(&mut self, rows: &Arc<Rows>) -> Result<()> {
        self.undrawn.push(Arc::clone(rows));
        let columns = rows.outcomes.columns.len() + rows.states.width();
        self.numbers += rows.len() * columns;
        if self.numbers > MOST_NUMBERS {
            self.draw();
        }
        Ok(())
    }
}
