//! The crate from outside: logs made here, damaged here, and real ones.

// The exception in clippy.toml covers test functions, not the helpers they share.
#![allow(clippy::unwrap_used)]

mod support; // CDR messages and logs made in memory

mod bags; // bags of ROS 1
mod batches; // several threads find what one finds
mod binding; // which topic carries a signal
mod clocks; // all topics of a log on one clock
mod damage; // nothing panics, everything intact comes out
mod databases; // databases as crashes leave them, and of every version
mod fuzz; // every parser on damaged inputs
mod layout; // fields out of CDR messages
mod mcap_files; // the same samples however an MCAP file is written
mod number_fields; // single numbers of any messages
mod passed_over; // what an index says is of no use here is not read
mod real_logs; // logs of real and simulated robots, where they are at hand
mod recover; // the intact part as a clean file
mod rosbag2; // databases and folders
mod sensors; // messages as numbers
mod static_frames; // where /tf_static puts frames
mod telling; // messages that tell their own fields: JSON, protobuf
mod timing; // clocks, gaps, offsets
mod variants; // two hundred damaged variants of each format
mod writing; // what is written comes back
