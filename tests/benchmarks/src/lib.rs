//! Speed by release: ratios to peers and bare limits, their table in the book, and when a lower one is a loss.

mod attempts;
mod figure;
mod processors;
mod table;

pub use attempts::{Attempts, Judgement};
pub use figure::{FIGURES, Figure, Measured};
pub use processors::{Processors, have_sha256};
pub use table::Table;
