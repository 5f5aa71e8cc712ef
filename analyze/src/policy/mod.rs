//! Judges a log: [`facts`] are its key figures, and a [`Policy`] defines which of them pass.

pub mod facts;
mod judge;
mod rules;

pub use judge::{Judgement, RuleOutcome};
pub use rules::{Policy, Quantity};
