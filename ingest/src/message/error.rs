//! Errors of opening or reading a log.

use std::path::{Path, PathBuf};

use super::binding_error::BindingError;

/// Error: a log cannot be opened or read at all.
///
/// Damage inside a log is not an error: the intact part is read, and [`Losses`](crate::Losses)
/// reports the rest.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system returned an error.
    #[error("{}: cannot be read: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The content is not in a supported format.
    #[error(
        "{}: not a log: expected MCAP, a bag of ROS 1, a rosbag2 SQLite database or folder, \
         CAN frames (candump text, Vector ASC or BLF, PEAK TRC, ASAM MF4) or a table (CSV, lines of JSON, Parquet) with a column of time \
          (another name for it: --time-column; no names: --no-header), found {found}",
        path.display()
    )]
    NotALog {
        /// The file or folder.
        path: PathBuf,
        /// Found content: the first bytes, or the content of a folder.
        found: String,
    },
    /// A known format without a reader.
    #[error("{}: unsupported format: {format}", path.display())]
    Unsupported {
        /// The file or folder.
        path: PathBuf,
        /// The name of the format.
        format: String,
    },
    /// A table whose times or columns are not known.
    #[error("{}: a table that cannot be read: {problem}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// The unknown property of the table, with the remedy.
        problem: String,
    },
    /// A folder of definitions cannot be used.
    #[error("{}: cannot be used as definitions of message types: {problem}", path.display())]
    Definitions {
        /// The folder, or a file in it.
        path: PathBuf,
        /// Description of the problem.
        problem: String,
    },
    /// A folder whose files do not form one log.
    #[error(
        "{}: the folder contains several logs ({}): name one of them",
        path.display(),
        names.join(", ")
    )]
    SeveralLogs {
        /// The folder.
        path: PathBuf,
        /// The logs in the folder.
        names: Vec<String>,
    },
    /// The SQLite library cannot read the database.
    #[error("{}: not readable as a rosbag2 database: {doing}: {source}", path.display())]
    Sqlite {
        /// The database.
        path: PathBuf,
        /// The part that was being read.
        doing: &'static str,
        /// The error of SQLite.
        source: rusqlite::Error,
    },
    /// One record or chunk needs more memory than is available.
    #[error("{}: byte {offset}: a record of {needed_bytes} bytes does not fit into memory", path.display())]
    OutOfMemory {
        /// The file.
        path: PathBuf,
        /// Offset of the record.
        offset: u64,
        /// Its size.
        needed_bytes: u64,
    },
    /// A topic number outside this log.
    #[error("{}: topic number {index} does not exist: the log has {count} topics", path.display())]
    NoSuchTopic {
        /// The log.
        path: PathBuf,
        /// Index of the requested topic.
        index: usize,
        /// The number of topics.
        count: usize,
    },
    /// A bucket or server cannot be read.
    #[error(transparent)]
    Storage(#[from] tipwatch_storage::Error),
    /// A topic cannot serve as the requested signal.
    #[error(transparent)]
    Binding(#[from] BindingError),
}

impl Error {
    pub(crate) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Error {
        move |source| Error::Io {
            path: path.to_path_buf(),
            source,
        }
    }

    pub(crate) fn sqlite(
        path: &Path,
        doing: &'static str,
    ) -> impl FnOnce(rusqlite::Error) -> Error {
        move |source| Error::Sqlite {
            path: path.to_path_buf(),
            doing,
            source,
        }
    }
}
