//! Active suspension: what it would have done in a log, and its control over standard input and output.
//!
//! A replay takes the log again with its suspension moved otherwise: locked, as recorded, or controlled.
//! Arm, drive and the way of the wheels over the ground stay as they were recorded; where the platform is above
//! its wheels, what its wheels carry and what its actuators need follow from the rods. See [`CAVEATS`] for what
//! that cannot show.

mod best;
mod mode;
mod simulate;
pub mod stabilise;
mod summary;
pub(crate) mod table;
mod track;
mod what_if;

pub use best::Best;
pub use mode::{SuspensionMode, WhatIfOptions};
pub use summary::Summary;
pub(crate) use table::rod_names;
pub use track::Track;
pub use what_if::{CAVEATS, WhatIf, what_if};
