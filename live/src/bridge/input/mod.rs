//! Input of the bridge: messages of all networks in one bounded queue, each with its publisher and its sequence number.

mod can;
mod host_clock;
mod mcap_stream;
mod queue;
mod tell;
mod wanted;

pub use can::{CanInput, read_frames, start_can};
pub use host_clock::HostClock;
pub use mcap_stream::{read_mcap, start_mcap};
pub use queue::{Arrival, Arrivals, Intake, Lane, LaneCounts, LaneId};
pub use tell::Teller;
pub use wanted::Wanted;
