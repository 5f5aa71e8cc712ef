//! Analysis of whole logs. Placeholder overview.

pub mod analysis;
pub mod events;
pub mod options;
pub mod provenance;
