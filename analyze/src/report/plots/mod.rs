//! The figures of the report, all on one time axis: loads, indicators, contributions, inputs.

mod causes;
mod figures;
mod indicators;
mod inputs;
mod loads;
mod plotter;
mod quality;
mod timeline;
mod uncertainty;

pub(super) use figures::figures;
pub(super) use plotter::{MOST_EVENTS, Part};
