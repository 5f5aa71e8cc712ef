//! Contents of packages other than the programs.

pub mod bill;
pub mod pages;
pub mod third_party;
