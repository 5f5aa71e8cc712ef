//! Advice on preventing an event: single changes, each put back into the model and simulated over the whole event, and the
//! answers to the usual questions about it.

mod advise;
mod candidates;
mod change;
mod counterfactual;
mod ground_slope;
mod hypothesis;
mod result;
mod simulate;
mod solve;
mod supposed_states;
mod to_base;
mod window;

pub(crate) use advise::advise;
pub use change::Change;
pub(crate) use counterfactual::{Question, ask_all, asked_as};
pub(crate) use ground_slope::GroundSlope;
pub(crate) use hypothesis::{Hypothesis, moves_arm_alone};
pub use result::{Advice, BeforeAfter, RejectedChange, SimulatedChange, WheelMargins};
pub(crate) use supposed_states::SupposedStates;
