//! Questions on a terminal instead of a sheet: the answers become a sheet.

mod ask;
mod parts;
mod prompt;
mod question;
mod questions;

pub use ask::ask;
pub use prompt::{parts, prompt, refusal};
pub use question::Question;
pub use questions::questions;
