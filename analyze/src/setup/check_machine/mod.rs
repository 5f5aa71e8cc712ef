//! `check-machine`: mass, centre of mass and static loads of a machine, compared with weighed loads.

mod check;
mod document;
mod geometry;
mod print;
mod readings;

pub use check::check;
pub use document::MachineCheck;
pub use print::print;
