//! Compares two analyses and ranks their differences: two logs, one log under two machine files or
//! models, or two output folders.
//!
//! All data come from `summary.json` and `samples.parquet` of a result; a fresh analysis is converted to
//! the same documents.

mod comparison;
mod facts;
mod inputs;
mod page;
mod series;
mod side;
mod text;

pub use comparison::{Comparison, compare};
pub use facts::{Elsewhere, EventPair, FactDifference};
pub use inputs::InputDifference;
pub use page::render;
pub(crate) use page::render_drawn;
pub use series::{SeriesComparison, SeriesDifference};
pub use side::{Side, SideSummary};
pub use text::{Extent, as_text};
