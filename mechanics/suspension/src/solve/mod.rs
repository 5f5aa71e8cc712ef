//! Constrained minimisation of the cost in one or two variables, with bounded work.

mod minimise;
mod quadratic_step;
mod raise_margin;

pub(crate) use minimise::{Ending, MAX_EVALUATIONS, Minimum, minimise};
