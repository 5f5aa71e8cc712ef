//! Both programs in one executable that is always compiled together with the tests:
//! `programs tipwatch analyze ...`, `programs tipwatch-live monitor ...`.

use std::path::Path;
use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let arguments = tipwatch_storage::arguments();
    let arguments = arguments.get(1..).unwrap_or_default();
    match arguments.first().and_then(|name| name.to_str()) {
        Some("tipwatch") => {
            // To hash half a gigabyte of code that is not optimised would take most of the tests' time. That the program
            // states its own hash is tested with the program itself.
            let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("support/programs.rs");
            tipwatch_analyze::base::file_hash::set_program(&source);
            tipwatch_analyze::cli::run(&Parser::parse_from(arguments))
        }
        Some("tipwatch-live") => tipwatch_live::cli::run(&Parser::parse_from(arguments)),
        name => {
            eprintln!("error: expected tipwatch or tipwatch-live, found {name:?}");
            ExitCode::from(2)
        }
    }
}
