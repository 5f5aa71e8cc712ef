//! What the identification must hold: one binary, a theme a module.

#![allow(clippy::unwrap_used, reason = "a failed setup fails the test")]

mod support;

// Bands of an identified machine.
mod bands;
// Derivatives by the adjoint against differences.
mod derivatives;
// Rows of a log: autocorrelated and wrong ones.
mod logged;
// Weighings in several postures.
mod weighings;
