//! Attempts: marks of analyses in progress, which survive the process.
//!
//! A log may end the process that analyses it (too much memory, an error in a library), and an engine then
//! starts the process again, at the same log. Each analysis begins with a mark, `attempts/<log>.<n>`, and
//! removes it when the log has its record. Marks without a process are therefore lost attempts. After a
//! few, the log gets a record of the failure instead of another attempt.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::Result;

use super::failure::FailureKind;
use super::place::Place;
use super::record::{Record, content_key, path_key};
use super::version::SOURCES;

const FOLDER: &str = "attempts";

/// The attempts of earlier processes.
#[derive(Debug)]
pub(super) struct Attempts {
    place: Place,
    /// Number of lost attempts after which a log fails.
    most: u32,
    /// Names of the marks when this process began.
    lost: Vec<String>,
}

/// An analysis in progress.
#[derive(Debug)]
pub(super) struct Attempt {
    marks: Vec<String>,
}

impl Attempts {
    pub(super) fn of(place: &Place, most: u32) -> Result<Self> {
        Ok(Self {
            place: place.clone(),
            most,
            lost: place.list(FOLDER)?,
        })
    }

    /// Separates the logs that may have ended a process from the others: they come last and one by one,
    /// so that they take no other log with them.
    pub(super) fn suspects_apart(&self, logs: Vec<PathBuf>) -> (Vec<PathBuf>, Vec<PathBuf>) {
        let path_of = |mark: &String| {
            let (log, _) = mark.rsplit_once('.')?;
            log.rsplit_once('-').map(|(_, path)| path.to_string())
        };
        let suspects: BTreeSet<String> = self.lost.iter().filter_map(path_of).collect();
        let is_suspect = |log: &Path| suspects.contains(&path_key(&log.to_string_lossy()));
        logs.into_iter().partition(|log| !is_suspect(log))
    }

    /// Begins the analysis of a log.
    ///
    /// # Errors
    /// Too many attempts were lost, or the mark cannot be written.
    pub(super) fn begin(&self, record: &Record) -> Result<Attempt> {
        let log_id = record.log_id.as_deref().unwrap_or_default();
        let content = content_key(log_id, SOURCES);
        let log = format!("{content}{}.", path_key(&record.path));
        let lost = self.lost.iter().filter(|mark| mark.starts_with(&log));
        let mut marks: Vec<String> = lost.cloned().collect();
        if marks.len() >= self.most as usize {
            return Err(FailureKind::WorkerLost.error(format!(
                "the process ended {} times while it analysed this log; it is not tried again with this build of \
                 tipwatch and --attempts {}",
                marks.len(),
                self.most
            )));
        }
        // another process may be at the same log
        for number in 1..=u32::MAX {
            let mark = format!("{log}{number}");
            if self
                .place
                .put_if_absent(&format!("{FOLDER}/{mark}"), record.path.as_bytes())?
            {
                marks.push(mark);
                break;
            }
        }
        Ok(Attempt { marks })
    }

    /// Removes the marks of a log that has its record.
    pub(super) fn finish(&self, attempt: &Attempt) -> Result<()> {
        let mut marks = attempt.marks.iter();
        marks.try_for_each(|mark| self.place.remove(&format!("{FOLDER}/{mark}")))
    }
}
