//! Machines that stand out: each against its own history, and against the other machines of its type.

mod comparisons;
mod statistics;

pub(super) use comparisons::{Against, Comparison, MOST_FALSE, Quantity, Verdict, comparisons};
