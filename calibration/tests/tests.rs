//! Tests of the identification: one binary, a theme a module.

#![allow(clippy::unwrap_used, reason = "a failed setup fails the test")]

mod support;

// Weighings against each other, and bands that hold what was measured.
mod agreement;
// Bands of an identified machine.
mod bands;
// Derivatives by the adjoint against differences.
mod derivatives;
// Rows of a log: autocorrelated and wrong ones.
mod logged;
// Machines on any set of their supports.
mod supports;
// Weighings in several postures.
mod weighings;
