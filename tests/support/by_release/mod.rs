//! Ratios of speed by release: the figures, and their table in the book.

mod figure;
mod table;

pub use figure::{FIGURES, Figure, Measured};
pub use table::Table;
