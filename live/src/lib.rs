//! Wheel loads beside a machine's logger, over shared memory.
//!
//! - [`topics`] is what is on the wire; [`session`] and [`sample`] convert it.
//! - [`recording`] reads a log's samples, [`replay()`](replay::replay) sends them.
//! - [`monitor`] turns samples into rows, [`follow()`](follow::follow) feeds it from shared memory,
//!   [`output`] prints the rows.
//! - [`node`] is the only caller of iceoryx2, the shared memory.

pub mod cli;
pub mod fnv;
pub mod follow;
pub mod monitor;
pub mod node;
pub mod output;
pub mod recording;
pub mod replay;
pub mod sample;
pub mod session;
pub mod topics;
