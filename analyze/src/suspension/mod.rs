//! Active suspension: replay of a log with another suspension motion, and control over standard input
//! and output.
//!
//! A replay recomputes the log with its suspension locked, as recorded, or controlled. Arm motion,
//! driving and the path of the wheels stay as recorded. The pose of the platform, the wheel loads and
//! the actuator forces follow from the rod strokes. [`CAVEATS`] lists what a replay cannot show.

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
