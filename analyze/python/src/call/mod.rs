//! Conventions of all calls from Python: options by name, errors as exceptions, progress, an end by Ctrl+C, and results that
//! pickle.

pub(crate) mod error;
pub(crate) mod interrupt;
pub(crate) mod number;
pub(crate) mod options;
pub(crate) mod pickle;
pub(crate) mod place;
pub(crate) mod progress;
