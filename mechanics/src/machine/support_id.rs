//! Which support of a machine is meant, whichever of them are on the ground.

/// A wheel, outrigger or track point of a machine: the same one on every set of supports.
///
/// Lists by wheel of a machine that stands on some of its supports have an entry for each of these only. Where a support
/// is in them, [`Machine::place_of`](super::Machine::place_of) tells; a number for all supports and one for those on the
/// ground can therefore not be confused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SupportId(usize);

impl SupportId {
    /// The support at this place of [`Supports::all`](super::Supports::all).
    pub(super) fn new(index: usize) -> Self {
        Self(index)
    }

    /// Its place in [`Supports::all`](super::Supports::all).
    #[must_use]
    pub fn index(self) -> usize {
        self.0
    }
}
