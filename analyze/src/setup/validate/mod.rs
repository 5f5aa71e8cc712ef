//! `validate`: computed against measured loads of logs.

mod page;
mod print;
mod run;

pub use page::page;
pub use print::text;
pub use run::{LogValidation, Validation, validate};
