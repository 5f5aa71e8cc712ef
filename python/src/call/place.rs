//! Places of logs as messages and progress bars name them.

use std::path::{Path, PathBuf};

use tipwatch_storage::{Location, redact};

/// A path or URL without what is secret in it; the place is found again by what remains.
pub(crate) fn named(place: &Path) -> PathBuf {
    match Location::of(place) {
        Ok(location) => location.path().into(),
        // it is refused where it is used
        Err(_) => redact(&place.to_string_lossy()).into(),
    }
}
