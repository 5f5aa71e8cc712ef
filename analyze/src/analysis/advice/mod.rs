//! What would have prevented the worst event: single changes, each put back into the model and simulated over the
//! whole event.

mod advise;
mod candidates;
mod change;
mod result;
mod simulate;
mod solve;
mod window;

pub(crate) use advise::advise;
pub use change::Change;
pub use result::{Advice, BeforeAfter, RejectedChange, SimulatedChange, WheelMargins};
