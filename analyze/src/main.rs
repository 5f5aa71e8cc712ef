//! The `tipwatch` program.

use std::process::ExitCode;

use clap::Parser;
use tipwatch_allocator::Allocator;
use tipwatch_analyze::cli;

#[global_allocator]
static ALLOCATOR: Allocator = Allocator;

fn main() -> ExitCode {
    cli::run(&cli::Cli::parse_from(tipwatch_storage::arguments()))
}
