//! What packages contain beside the programs.

pub mod bill;
pub mod pages;
pub mod third_party;
