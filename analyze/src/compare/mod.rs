//! Two analyses side by side, their differences ranked: two logs, or one log under two machine files or
//! models, or two folders of results.
//!
//! Everything is taken from the files of a result, `summary.json` and `samples.parquet`; an analysis that
//! was just made is seen through the same documents.

mod comparison;
mod facts;
mod page;
mod series;
mod side;
mod text;

pub use comparison::{Comparison, compare};
pub use facts::{EventPair, FactDifference};
pub use page::render;
pub use series::{SeriesComparison, SeriesDifference};
pub use side::{Side, SideSummary};
pub use text::told;
