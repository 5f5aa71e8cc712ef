//! Commissioning: signs, axes, order, scale and mounting of all sensors, proven once from a drive made for it.
//!
//! A [`Recording`] takes samples offline or live; [`assess`] compares the sensors in it with each other through the
//! mechanics of the machine and answers every question about them: proven, contradicted or not shown.

mod assessment;
mod candidates;
mod correction;
mod describe;
mod driving;
mod estimate;
mod evidence;
mod grid;
mod judge;
mod leaning;
mod least_squares;
mod moved;
mod platform;
mod question;
mod readings;
mod recording;
mod rocking;
mod roles;
mod rolling;
mod signals;
mod steps;
mod still;
mod travel;

pub use assessment::{Answers, Assessment, Figure, Item, Status, Step};
pub use judge::assess;
pub use recording::Recording;
