//! Tests of the public interface, on generated, damaged and real logs.

// The exception in clippy.toml covers test functions, not the helpers they share.
#![allow(clippy::unwrap_used)]

mod support; // CDR messages and logs made in memory

mod bags; // bags of ROS 1
mod batches; // several threads give the same result as one
mod binding; // which topic carries a signal
mod can_files; // files of CAN loggers
mod clips; // spans cut out of a log
mod clocks; // all topics of a log on one clock
mod damage; // nothing panics, everything intact is read
mod databases; // databases after crashes, and of every schema version
mod decoder_history; // a decoder gives the same after any messages
mod fuzz; // every parser on damaged inputs
mod layout; // fields of CDR messages
mod longer_records; // records with bytes behind their fields
mod mcap_files; // the same samples for all writer options
mod needs_shared; // logs of real and simulated robots
mod number_fields; // single numbers from any messages
mod recover; // the intact part of a log as a clean file
mod rosbag2; // databases and folders
mod self_describing; // self-describing messages: JSON, protobuf
mod sensor_blocks; // samples in blocks equal whole columns
mod sensors; // messages to samples
mod shared_topics; // publishers that share a topic
mod skipped_chunks; // chunks without a wanted topic are not read
mod static_frames; // transforms of /tf_static
mod stopped_reads; // what a stopped read leaves changes no later one
mod tables; // CSV and Parquet
mod timing; // clocks, gaps, offsets
mod variants; // two hundred damaged variants of each format
mod writing; // what is written can be read
