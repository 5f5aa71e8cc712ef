//! Files that an analysis writes, and how fine.

use crate::base::options::{DerivedRows, Precision};

pub(crate) const SAMPLES: &str = "samples.parquet";
pub(crate) const EVENTS: &str = "events.parquet";
/// The summary; in a bucket it is written last.
pub const SUMMARY: &str = "summary.json";
pub(super) const REPORT: &str = "report.html";
pub(crate) const DERIVED: &str = "derived.mcap";

/// Which files to write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Outputs {
    /// All of them.
    #[default]
    All,
    /// `samples.parquet` alone.
    Samples,
}

/// Which files to write, and how fine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::Args)]
pub struct OutputOptions {
    /// Which files to write.
    #[arg(long, value_enum, default_value_t)]
    pub outputs: Outputs,
    /// Width of the computed numbers in samples.parquet, monte_carlo.parquet and derived.mcap, in bits. Times are
    /// always exact.
    #[arg(long, value_enum, value_name = "BITS", default_value_t)]
    pub precision: Precision,
    /// Which rows derived.mcap has.
    #[arg(long, value_enum, value_name = "ROWS", default_value_t)]
    pub derived: DerivedRows,
}
