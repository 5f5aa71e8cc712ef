//! Finds the events of a log: light and lifting wheels, tipping edges, input gaps and faults.

mod causes;
mod counterfactual;
mod detect;
mod episodes;
mod event;
mod evidence;
mod finding;
mod inputs;
mod leaning;
mod onset;
mod pages;
mod pass;
mod rotation;
mod row_derivatives;
pub(crate) mod split_rule;
mod story;
pub(crate) mod support_words;
mod times;
mod tipping;
mod turning;
mod unloaded;

pub use counterfactual::{Answer, Counterfactual, Reply, Supposition};
pub(crate) use detect::NO_LEAN;
pub(crate) use episodes::{MERGED_NS, SHORTEST_NS};
pub use event::*;
pub(crate) use event::{LEAST_OF_A_FACT, TIP_OVER_RAD};
pub use finding::Finding;
pub(crate) use pass::{EventPass, LowestOtf, of_inputs, sorted};
pub(crate) use rotation::{FALL_RAD, FoundRotation, RotationTrace, Rotations};
pub(crate) use story::Stories;
pub(crate) use times::EventTimes;
pub(crate) use tipping::{SHIFT_SHARE, distances, drives, factors_off, may_be_fall, outwards};
pub use turning::Turning;
