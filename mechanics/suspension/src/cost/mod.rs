//! Cost and margins of a candidate motion, with their derivatives.

mod evaluation;
mod weights;

pub(crate) use evaluation::{Evaluation, MAX_MARGINS};
pub(crate) use weights::Weights;
