//! Exit codes.

/// Exit code: a file, the machine or the shared memory has failed.
pub(super) const FAILED: u8 = 1;
/// Exit code: finished, but parts of a log or of a recording were lost.
pub(super) const LOST: u8 = 3;
/// Exit code: the commissioning contradicts the machine file.
pub(super) const CONTRADICTED: u8 = 4;
/// Exit code: the commissioning leaves items open. Adds to [`CONTRADICTED`].
pub(super) const OPEN: u8 = 8;
