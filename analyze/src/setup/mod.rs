//! Before the first analysis: contents of a log, a first machine file for it, and a check of that file.

pub mod check_machine;
pub mod commissioning;
pub mod first_machine;
pub mod inspect;
