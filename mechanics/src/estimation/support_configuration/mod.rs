//! On which of its supports a machine stands: what signals and measured loads tell of each of them.
//!
//! [`on_ground`] decides from what is known of each support at one time. A [`SupportWatch`] knows that from the samples so
//! far, live and to reproduce a live run offline; the analysis of a whole log also knows what follows. Which loads a set
//! leaves is not computed here: see [`Machine::standing_on`](crate::machine::Machine::standing_on).

mod contradiction;
mod status;
mod watch;

pub use contradiction::doubts_by_measured_loads;
pub use status::{
    GroundGap, GroundSet, LOAD_MAX_AGE_S, SupportStatus, carries_from, is_set_from, on_ground,
};
pub use watch::SupportWatch;
