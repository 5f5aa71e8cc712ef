//! Settings by which a person completes what logs do not state themselves.

use std::{
    path::PathBuf,
    sync::{PoisonError, RwLock},
};

use serde::Serialize;

use crate::table::TableOptions;

/// Settings for reading logs, beyond what the logs state.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct ReadOptions {
    /// Settings for tables: CSV and Parquet.
    pub table: TableOptions,
    /// Folders with definitions of message types, `PACKAGE/msg/NAME.msg`, for logs that lack them.
    pub definitions: Vec<PathBuf>,
}

static STATED: RwLock<Option<ReadOptions>> = RwLock::new(None);

/// States how this process reads logs from now on: the settings of [`Log::open`](crate::Log::open).
pub fn set_read_options(options: ReadOptions) {
    *STATED.write().unwrap_or_else(PoisonError::into_inner) = Some(options);
}

/// Returns the settings stated for this process.
#[must_use]
pub fn read_options() -> ReadOptions {
    let stated = STATED.read().unwrap_or_else(PoisonError::into_inner);
    stated.clone().unwrap_or_default()
}
