//! Questions on a terminal instead of a sheet: the answers become a sheet.

mod ask;
mod list;
mod parts;
mod prompt;
mod question;

pub use ask::ask;
pub use list::questions;
pub use prompt::{parts, prompt, refusal};
pub use question::Question;
