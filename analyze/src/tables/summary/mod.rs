//! `summary.json`: the analysis as one small, stable document.
//!
//! Keys include their unit. Values that cannot be computed are null. Keys change only with `schema`.

mod build;
mod document;
mod events;

pub use document::*;
