//! Judges a log: [`facts`] are its key figures, and a [`Policy`] defines which of them pass.

pub mod facts;
mod judge;
mod rules;

use crate::events::LEAST_OF_A_FACT;

pub use judge::{Judgement, RuleOutcome};
pub use rules::Policy;
