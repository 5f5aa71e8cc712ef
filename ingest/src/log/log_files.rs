//! The files that form one log.

use std::{collections::BTreeMap, path::PathBuf};

use crate::{
    file::Format,
    message::{Losses, LostRange},
};

/// The files of one log.
pub(crate) struct LogFiles {
    pub(crate) format: Format,
    pub(crate) files: Vec<PathBuf>,
    pub(crate) losses: Losses,
    /// Whether the recorder compressed every message; `None` if it does not state it.
    pub(crate) has_packed_messages: Option<bool>,
    /// Messages the recorder reports having written, by topic.
    pub(crate) declared_counts: BTreeMap<String, u64>,
    /// Files before which others are missing or cannot be read, and those, without their times.
    pub(crate) left_out: Vec<(usize, LostRange)>,
}
