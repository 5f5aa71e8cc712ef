//! `identify`: parameters of a machine from weighings and logs, and the machine file that results.

mod collect;
mod document;
mod machine_file;
mod print;
mod run;
pub(in crate::setup) mod weighings;

pub use document::{AgreementRow, IdentificationDocument};
pub use machine_file::{machine_file_text, write_machine_file};
pub use print::text;
pub use run::{Identified, NoResult, Request, identify};
