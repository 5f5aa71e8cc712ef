//! What a person can say about logs that do not say it themselves.

use std::{
    path::PathBuf,
    sync::{PoisonError, RwLock},
};

use serde::Serialize;

use crate::table::TableOptions;

/// How logs are read, beyond what they state.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct ReadOptions {
    /// For tables: CSV and Parquet.
    pub table: TableOptions,
    /// Folders with definitions of message types, `PACKAGE/msg/NAME.msg`, for logs that lack them.
    pub definitions: Vec<PathBuf>,
}

static STATED: RwLock<Option<ReadOptions>> = RwLock::new(None);

/// States how this process reads logs from now on: what [`Log::open`](crate::Log::open) uses.
pub fn set_read_options(options: ReadOptions) {
    *STATED.write().unwrap_or_else(PoisonError::into_inner) = Some(options);
}

/// What was stated for this process.
#[must_use]
pub fn read_options() -> ReadOptions {
    let stated = STATED.read().unwrap_or_else(PoisonError::into_inner);
    stated.clone().unwrap_or_default()
}
