//! Wheel loads and alarms beside a machine's logger, over shared memory.
//!
//! ```text
//!     producer (a machine, or replay) -> samples -> monitor -> verdicts -> watch, record, control
//!                                           '-------------------------------'
//! ```
//! - [`topics`] is what is on the wire, [`c_header`] the same for C; [`session`], [`sample`] and
//!   [`verdict`] convert it.
//! - [`monitor`] turns messages into verdicts, after the checks of [`guard`]; it knows no shared memory.
//!   [`monitor_loop`] joins the two, [`print_thread`] prints with [`output`], [`watch_over`] is the thread
//!   beside it.
//! - [`control`] turns samples and verdicts into [`command`]s to the valves of a suspension;
//!   [`control_loop`] joins it to the shared memory.
//! - [`recording`] reads a log's samples, [`replay()`](replay::replay) sends them by a [`producer`].
//! - [`record()`](record::record) writes samples and verdicts, [`watch()`](watch::watch) shows them.
//! - [`node`] is the only caller of iceoryx2, the shared memory.

pub mod acknowledge;
pub mod c_header;
pub mod cli;
pub mod clock;
pub mod command;
pub mod control;
pub mod control_loop;
pub mod fnv;
pub mod guard;
pub mod identity;
pub mod interrupt;
pub mod monitor;
pub mod monitor_listener;
pub mod monitor_loop;
pub mod names;
pub mod node;
pub mod output;
pub mod print_thread;
pub mod producer;
pub mod realtime;
pub mod record;
pub mod recording;
pub mod replay;
pub mod sample;
pub mod sample_reader;
pub mod session;
pub mod topics;
pub mod verdict;
pub mod wake;
pub mod watch;
pub mod watch_over;
mod wire;
