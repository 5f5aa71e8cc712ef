//! The files that form one log.

use std::{collections::BTreeMap, path::PathBuf};

use crate::{file::Format, message::Losses};

/// The files of one log.
pub(crate) struct Recording {
    pub(crate) format: Format,
    pub(crate) files: Vec<PathBuf>,
    pub(crate) losses: Losses,
    /// How many messages the recorder says it wrote, for each topic.
    pub(crate) promised: BTreeMap<String, u64>,
}
