//! Studies that use evaluations: static postures, payloads, actuator forces, drawn parameters.

pub(crate) mod actuator_force;
pub(crate) mod actuator_force_sigma;
#[cfg(test)]
mod closed_form_against_newton_euler;
pub(crate) mod combination_sigma;
pub(crate) mod forces_by_rule;
pub mod load_capacity;
pub mod measured_forces;
pub mod measured_loads;
pub mod monte_carlo;
pub mod needed_proofs;
pub(crate) mod payload_estimate;
pub mod payload_watch;
pub(crate) mod placement;
pub(crate) mod self_equilibrated;
pub(crate) mod standing;
pub(crate) mod static_posture;
pub mod unobserved;
