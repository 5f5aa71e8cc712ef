//! Questions on a terminal instead of a sheet: the answers become a sheet.

mod ask;
mod parts;
mod question;

pub use ask::ask;
pub use question::{Question, questions};
