//! Output of the bridge: the verdict as messages of ROS 2, as a CAN frame, and as a command on a level.

mod can_frame;
mod command;
mod dbc;
mod diagnostics;
mod follow;
mod sinks;
mod view;

pub use can_frame::{CanVerdict, crc8};
pub use command::{CommandRule, Commands};
pub use dbc::dbc;
pub use diagnostics::diagnostics;
pub use follow::{Follower, VerdictSink};
pub use sinks::{CanSink, DdsSink, FrameSink, open_frames, verdict_msg};
pub use view::View;
