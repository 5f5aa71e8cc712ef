//! The `tipwatch-live` program.

use std::process::ExitCode;

use clap::Parser;
use tipwatch_live::cli;

fn main() -> ExitCode {
    cli::run(&cli::Cli::parse_from(tipwatch_storage::arguments()))
}
