//! Redundancy: what one sensor measures, compared with what the mechanics of the machine make of the others.
//!
//! Such checks find sensors that are wrong but plausible by themselves: a sign, an axis, a mounting, a drift. Each
//! compares a pair of sensors and cannot tell which of the two is wrong. A check says nothing while the motion
//! shows nothing.

mod band;
mod comparisons;
mod drive;
mod evidence;
mod excitation;
mod lasting;
mod leaky;
mod lean;
mod lean_comparison;
mod lean_difference;
mod lean_model;
mod low_pass;
mod rolling;
mod rotation;
mod specific_force;
mod standstill;
#[cfg(test)]
mod tests;
mod tilt;
mod travel;
mod yaw;

pub(super) use comparisons::Comparisons;
pub(in crate::estimation) use comparisons::OtherComparisons;
pub use excitation::{Excitation, Unshown};
pub(in crate::estimation) use lean_comparison::{ByWheels, LeanComparison};
