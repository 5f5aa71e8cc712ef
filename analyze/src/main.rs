//! The `tipwatch` program.

use std::process::ExitCode;

use clap::Parser;
use tipwatch_analyze::cli;

/// Keeps freed memory for the next use: a log's columns come and go by the megabyte, and asking the
/// system for fresh pages each time costs as much as the mechanics.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let cli = cli::Cli::parse_from(tipwatch_storage::arguments());
    if cli.takes_many_logs() {
        keep_memory_between_logs();
    }
    cli::run(&cli)
}

/// Lets a log use the memory of the one before it. By default freed memory goes back to the system after 10 ms, so that a
/// single log uses little.
fn keep_memory_between_logs() {
    /// `mi_option_purge_delay` of mimalloc 2 and 3, in ms.
    const PURGE_DELAY: libmimalloc_sys::mi_option_t = 15;
    const DEFAULT_MS: std::ffi::c_long = 10;
    const BETWEEN_LOGS_MS: std::ffi::c_long = 1000;
    #[allow(
        unsafe_code,
        reason = "functions of the allocator without preconditions: an index that is no option is refused"
    )]
    unsafe {
        // another number: another allocator, or the user's own choice
        if libmimalloc_sys::mi_option_get(PURGE_DELAY) == DEFAULT_MS {
            libmimalloc_sys::mi_option_set(PURGE_DELAY, BETWEEN_LOGS_MS);
        }
    }
}
