//! What-if studies: replay of a log with another motion of its suspension or under suppositions, and control over standard input
//! and output.

mod findings;
mod mode;
pub mod stabilise;
mod statistics;
mod summary;
mod supposed;
pub mod table;
mod what_if;

pub use findings::findings;
pub use mode::{SuspensionMode, WhatIfOptions};
pub use summary::Summary;
pub use supposed::{Suppositions, caveats, replies, suppose, supposing};
pub(crate) use table::rod_names;
pub use what_if::{CAVEATS, WhatIf, what_if};
