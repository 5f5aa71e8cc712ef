//! The load chart of a machine: the load that it carries at each reach, and the comparison with a maker's chart.

mod compare;
mod picture;
mod points;
mod print;
mod request;

pub use compare::{Compared, SheetPoint, compare, sheet_points};
pub use picture::picture;
pub use points::{Chart, ChartPoint, PayloadLoads, chart};
pub use print::{csv, text};
pub use request::{ReachFrom, Request, Sweep};
