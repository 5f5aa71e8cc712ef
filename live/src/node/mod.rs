//! The shared memory: the only caller of iceoryx2.

mod event;
mod expiring_sender;
mod housekeeping;
mod iceoryx;
mod leftovers;
mod live_node;
mod of_machine;
mod other_user;
mod port;
mod producer;
mod reader_progress;
mod room;
mod sample_reader;
mod session_follower;
mod wake;

pub use event::{EventListener, EventNotifier};
pub use expiring_sender::ExpiringSender;
pub use housekeeping::Housekeeping;
pub use live_node::{LiveNode, ServiceAddress, pause};
pub use port::{Receiver, Sender};
pub use producer::Producer;
pub use reader_progress::{NOTHING_YET, ReaderProgress};
pub use room::NoRoom;
pub use sample_reader::SampleReader;
pub use session_follower::{SessionFollower, SessionHost};
pub use wake::{LoopOptions, Waiter, Wake};
