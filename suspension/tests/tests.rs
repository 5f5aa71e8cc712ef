//! What the control of a suspension must hold: one binary, a theme a module.

#![allow(clippy::unwrap_used, reason = "a failed setup fails the test")]

#[path = "../benches/problems/mod.rs"]
mod problems;
mod manoeuvres;
mod support;

// No panic, no command outside the limits and bounded work, whatever the state.
mod any_state;
// Oil, valve and cylinder: conservation, limits, accuracy of the integration.
mod hydraulics;
// Never worse than locked.
mod never_worse;
// The critical step T* against Pinocchio.
mod val_critical_step;
