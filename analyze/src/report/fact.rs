//! Which events are told as facts.

use crate::events::Event;

/// An event that is less probable than this is no statement of fact.
pub(crate) const LEAST_OF_A_FACT: f64 = 0.5;

/// Whether an event is more probable than not; one without a probability rests on what was measured.
pub(super) fn is_fact(event: &Event) -> bool {
    event.certainty.is_none_or(|p| p >= LEAST_OF_A_FACT)
}
