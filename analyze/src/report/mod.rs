//! The report: one page for people, complete in itself, that opens without a network.

mod area;
mod basis;
mod charts;
mod clocks;
mod deciding;
mod drawing;
mod explanations;
mod faults;
mod findings;
mod health;
mod in_band;
mod log_report;
mod machine_view;
mod measured_loads;
mod moment;
mod open_split;
mod parameter_words;
mod path;
mod pdf;
mod plots;
mod prevention;
mod sheet;
mod sketch;
mod sliders;
mod tables;
mod unstated_load;
mod whatif;

pub use findings::{BANDS, doubts, findings, main_findings};
pub use log_report::{render, render_pdf, render_sketch, render_sketch_as_pdf};
pub(crate) use log_report::{render_beside, shared_library};
pub(crate) use parameter_words::uncertainty_in_words;
pub use sheet::{doubted, story};
pub(crate) use sketch::LateSketch;
pub use sketch::{Sketch, SketchPass};
pub use sliders::{Slider, Sliders, sliders};
pub(crate) use whatif::render_what_if;
