//! Judges a log: [`facts`] are what its analysis comes to in few numbers, a [`Policy`] says which of them pass.

pub mod facts;
mod judge;
mod margin;
mod rules;

pub use judge::{Judgement, RuleOutcome};
pub use rules::{Policy, Quantity};
