//! Progress bars, shown only on a terminal.

use std::path::Path;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::stderr::to_stderr;

/// Progress through one log; hidden if stderr is not a terminal.
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

/// Progress through the logs of a fleet.
#[derive(Debug)]
pub(crate) struct LogCount {
    bar: ProgressBar,
    quiet: bool,
}

impl LogCount {
    pub(crate) fn new(quiet: bool) -> Self {
        let target = match quiet {
            true => ProgressDrawTarget::hidden(),
            false => ProgressDrawTarget::stderr(),
        };
        Self {
            bar: ProgressBar::with_draw_target(None, target),
            quiet,
        }
    }

    pub(crate) fn begin(&self, logs: usize) {
        self.bar.set_length(logs as u64);
        if let Ok(style) = ProgressStyle::with_template("{pos}/{len} logs {wide_bar} {eta}") {
            self.bar.set_style(style);
        }
    }

    pub(crate) fn next(&self) {
        self.bar.inc(1);
    }

    /// Prints a line above the bar unless quiet.
    pub(crate) fn print(&self, line: &str) {
        if !self.quiet {
            self.bar.suspend(|| to_stderr(line));
        }
    }

    /// Prints an error above the bar, even if quiet.
    pub(crate) fn error(&self, line: &str) {
        self.bar.suspend(|| to_stderr(line));
    }

    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
