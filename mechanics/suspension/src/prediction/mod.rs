//! Predicted state: loads and stability angles for a candidate motion of the rods.

#[cfg(test)]
mod against_whole_body;

mod actuator_number;
mod predicted_state;
mod support;

pub(crate) use actuator_number::FromActuator;
pub(crate) use predicted_state::{PredictedState, RodMotion};
