//! Which events are told as facts.

use crate::events::{Event, LEAST_OF_A_FACT};

/// Whether an event is more probable than not; one without a probability rests on what was measured.
pub(super) fn is_fact(event: &Event) -> bool {
    event.certainty.is_none_or(|p| p >= LEAST_OF_A_FACT)
}
