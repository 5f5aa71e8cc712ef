//! What every other folder uses: options, the types of rows and provenance, files, numbers, the terminal.

pub(crate) mod files;
pub(crate) mod number;
pub mod options;
pub(crate) mod progress;
pub mod provenance;
pub mod rows;
pub(crate) mod stdout;
