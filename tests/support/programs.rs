//! Both programs in one executable that is always compiled together with the tests:
//! `programs tipwatch analyze ...`, `programs tipwatch-live monitor ...`.

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let arguments = tipwatch_storage::arguments();
    let arguments = arguments.get(1..).unwrap_or_default();
    match arguments.first().and_then(|name| name.to_str()) {
        Some("tipwatch") => tipwatch_analyze::cli::run(&Parser::parse_from(arguments)),
        Some("tipwatch-live") => tipwatch_live::cli::run(&Parser::parse_from(arguments)),
        name => {
            eprintln!("error: expected tipwatch or tipwatch-live, found {name:?}");
            ExitCode::from(2)
        }
    }
}
