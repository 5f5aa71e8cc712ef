//! Requirements on the control of a suspension: one binary, one module for each theme.

#![allow(clippy::unwrap_used, reason = "a failed setup fails the test")]

#[path = "../benches/problems/mod.rs"]
mod problems;
// Random manoeuvres.
mod manoeuvres;
mod support;

// No panic, no command outside the limits and bounded work, whatever the state.
mod any_state;
// Oil, valve and cylinder: conservation, limits, accuracy of the integration.
mod hydraulics;
// Never worse than locked.
mod never_worse;
// Rods must obey their valves and stay within their stroke; the oil is damped.
mod obedience;
// Lines of JSON: with pressures the valves damp the oil.
mod protocol;
// The critical step T* against Pinocchio.
mod val_critical_step;
