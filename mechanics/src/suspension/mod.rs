//! The active suspension.

pub mod hydraulics;
