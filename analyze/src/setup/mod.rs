//! Before the first analysis: contents of a log, a first machine file for it, a check of that file, and commissioning.

pub mod check_machine;
pub mod commissioning;
pub mod first_machine;
pub mod inspect;
