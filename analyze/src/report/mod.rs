//! The report: one page for people, complete in itself, that opens without a network.

mod clocks;
mod explanations;
mod faults;
mod findings;
mod log_report;
mod moment;
mod open_split;
mod plots;
mod prevention;
mod tables;
mod whatif;

pub use crate::page::{PlotLibrary, plot_library_script};
pub use findings::findings;
pub use log_report::render;
pub(crate) use whatif::render_what_if;
