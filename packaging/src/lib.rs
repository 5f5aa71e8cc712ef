//! What packages contain beside the programs.

pub mod bill;
pub mod pages;
