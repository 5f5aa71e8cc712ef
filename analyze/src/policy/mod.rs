//! Judges a log: [`facts`] are its key figures, and a [`Policy`] defines which of them pass.

pub mod facts;
mod judge;
mod rules;

/// An event of at least this probability is more likely than not.
const LIKELY: f64 = 0.5;

pub use judge::{Judgement, RuleOutcome};
pub use rules::{Policy, Quantity};
