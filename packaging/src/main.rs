//! Makes what packages contain beside the programs: manual pages, shell completions, and the bill of materials.
//!
//! ```text
//!     tipwatch-packaging pages DIR     man/*.1 and completions/ of both programs
//!     tipwatch-packaging sbom          CycloneDX on stdout; fails on a licence that is not allowed
//!     tipwatch-packaging third-party   the texts of all licences on stdout
//! ```

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use tipwatch_packaging::{bill, pages, third_party};

/// Makes what packages contain beside the programs.
#[derive(Debug, Parser)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write manual pages and shell completions of both programs.
    Pages {
        /// The folder, which is created if necessary.
        folder: PathBuf,
    },
    /// Print the bill of materials: every crate of the programs with version, source, hash and licence.
    Sbom,
    /// Print the licences of all crates of the programs, with their texts.
    ThirdParty,
}

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Pages { folder } => pages::write(&folder),
        Command::Sbom => print_bill(),
        Command::ThirdParty => print_licences(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn print_bill() -> anyhow::Result<()> {
    let bill = bill::cyclonedx(&shipped()?);
    print(&format!("{bill:#}\n"))
}

fn print_licences() -> anyhow::Result<()> {
    print(&third_party::licences(&shipped()?)?)
}

/// The crates of the programs, all of which may be shipped.
fn shipped() -> anyhow::Result<Vec<bill::Crate>> {
    let crates = bill::crates(&bill::workspace())?;
    let refused = bill::refused(&crates);
    anyhow::ensure!(refused.is_empty(), "{}", refused.join("\n"));
    Ok(crates)
}

fn print(text: &str) -> anyhow::Result<()> {
    use std::io::Write;
    Ok(std::io::stdout().write_all(text.as_bytes())?)
}
