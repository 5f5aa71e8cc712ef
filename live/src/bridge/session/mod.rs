//! A session of the bridge: the first messages tell what the topics are, the following ones become samples.

mod assembly;
mod clock;
mod first_messages;
mod joint_names;
mod publishers;
mod run;

pub use assembly::Assembly;
pub use clock::Stamps;
pub use first_messages::{FirstMessages, Incomplete};
pub use publishers::{Admission, Publishers, Refused};
pub use run::{Ending, SessionCounts, SessionRun};
