//! The report: one page for people, complete in itself, that opens without a network.

mod basis;
mod charts;
mod clocks;
mod conclusion;
mod drawing;
mod explanations;
mod faults;
mod findings;
mod health;
mod log_report;
mod measured_loads;
mod moment;
mod open_split;
mod path;
mod pdf;
mod plots;
mod prevention;
mod sketch;
mod tables;
mod unstated_load;
mod whatif;
mod when;
mod worst;

pub use crate::page::{PlotLibrary, plot_library_script};
pub use findings::{findings, main_findings};
pub use log_report::{render, render_pdf, render_sketch, render_sketch_as_pdf};
pub(crate) use sketch::LateSketch;
pub use sketch::{Sketch, SketchPass};
pub(crate) use whatif::render_what_if;
