//! Wheel loads and alarms next to a machine's logger, over shared memory.
//!
//! ```text
//!     producer (a machine, or replay) -> samples -> monitor -> verdicts -> watch, record, control
//!                                           '-------------------------------'
//! ```
//! Every module uses only modules above it in this table.
//!
//! | module | purpose |
//! |---|---|
//! | [`safety_limits`] | every limit that safety rests on |
//! | [`system`] | clocks, signals, child processes, real-time scheduling, the supervisor of services |
//! | [`wire`] | message types and their conversion |
//! | [`node`] | shared memory: the only caller of iceoryx2 |
//! | [`alarm`] | the latched alarm on the disk, and who may acknowledge it |
//! | [`guard`] | checks of every message, in front of the state estimator |
//! | [`monitor`] | samples to verdicts |
//! | [`control`] | samples and verdicts to valve commands of an active suspension |
//! | [`replay`] | samples of a log to shared memory |
//! | [`record`] | samples, verdicts and commands to MCAP files |
//! | [`operator`] | a screen, and acknowledgement of alarms |
//! | [`bridge`] | ROS 2 and CAN to samples, verdicts to both |
//! | [`cli`] | the command line |

/// Replaces the standard macro, which panics if standard error is closed: a monitor must outlive the reader of its messages.
macro_rules! eprintln {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($text)*);
    }};
}

/// Prints as `eprintln`, without the end of the line.
macro_rules! eprint {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = write!(std::io::stderr(), $($text)*);
    }};
}

pub mod alarm;
pub mod bridge;
pub mod cli;
pub mod control;
pub mod guard;
pub mod monitor;
pub mod node;
pub mod operator;
pub mod record;
pub mod replay;
pub mod safety_limits;
pub mod system;
pub mod wire;
