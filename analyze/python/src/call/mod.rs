//! What every call from Python shares: options by name, errors as exceptions, progress, and an end by Ctrl+C.

pub(crate) mod error;
pub(crate) mod interrupt;
pub(crate) mod options;
pub(crate) mod place;
pub(crate) mod progress;
