//! Tests of the program and the library as a user meets them.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod check_machine; // comparison with weighed loads
mod cli; // outputs, exit codes, messages
mod clips; // spans cut out at the events
mod clocks; // logs with wrong clocks
mod commissioning; // sensors proven by a drive, and what an analysis makes of it
mod compare; // two results
mod csv_export; // logs made from tables
mod custody; // who analysed what, and the same bits again
mod derived; // derived.mcap read back
mod engines; // the files of deploy
mod first_machine; // inspect --write-machine
mod from_sheet; // machine new
mod gates; // logs and policies that decide nothing
mod health; // what sensors show by themselves
mod imu_mounting; // mounting from transforms, and mounting faults
mod in_blocks; // nothing holds the whole table
mod long_logs; // samples in temporary files
mod outliers; // machines that stand out in a fleet
mod questions; // what inspect --write-machine asks for
mod report; // the report in a browser
mod screen; // fleets of logs
mod shards; // a fleet split over processes
mod sizes; // small outputs
mod summary_schema; // the published JSON schema
mod support;
mod topics; // shared, contradictory and missing topics
mod urdf; // URDFs as robots have them
