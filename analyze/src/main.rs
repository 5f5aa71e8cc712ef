//! The `tipwatch` program.

use std::process::ExitCode;

use clap::Parser;
use tipwatch_analyze::cli;

fn main() -> ExitCode {
    cli::run(&cli::Cli::parse())
}
