//! A progress bar while a log is read, on a terminal only.

use std::path::Path;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// The bar; nothing where stderr is no terminal.
#[derive(Debug)]
pub(crate) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    pub(crate) fn new(log: &Path, quiet: bool) -> Self {
        let bytes = std::fs::metadata(log).map_or(0, |metadata| metadata.len());
        let target = if quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        };
        let bar = ProgressBar::with_draw_target(Some(bytes), target);
        if let Ok(style) =
            ProgressStyle::with_template("{msg} {wide_bar} {bytes}/{total_bytes} {eta}")
        {
            bar.set_style(style);
        }
        bar.set_message(log.display().to_string());
        Self { bar }
    }

    pub(crate) fn at(&mut self, bytes: u64) {
        self.bar.set_position(bytes);
    }

    pub(crate) fn finish(&mut self) {
        self.bar.finish_and_clear();
    }
}
