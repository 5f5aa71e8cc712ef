//! `check-machine`: what a model weighs, where its centre of mass is and what its wheels carry, beside
//! what scales said.

mod check;
mod document;
mod geometry;
mod print;
mod readings;

pub use check::check;
pub use document::MachineCheck;
pub use print::print;
