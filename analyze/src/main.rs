//! The `tipwatch` program.

use std::process::ExitCode;

use clap::Parser;
use tipwatch_analyze::cli;

/// Keeps freed memory for the next use: a log's columns come and go by the megabyte, and asking the
/// system for fresh pages each time costs as much as the mechanics.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    cli::run(&cli::Cli::parse_from(tipwatch_storage::arguments()))
}
