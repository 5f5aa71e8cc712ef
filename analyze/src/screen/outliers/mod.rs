//! Machines that stand out: each against its own history, and against the other machines of its type.

mod comparisons;
mod statistics;

pub(super) use comparisons::{
    Against, ComparedQuantity, Comparison, MOST_FALSE, Verdict, comparisons,
};
