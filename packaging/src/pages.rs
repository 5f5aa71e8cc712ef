//! Manual pages and shell completions, made of the definitions of the commands.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use clap::CommandFactory;
use clap_complete::Shell;

/// Shells whose completions are packaged.
const SHELLS: [Shell; 3] = [Shell::Bash, Shell::Fish, Shell::Zsh];

/// The commands of both programs.
#[must_use]
pub fn programs() -> [clap::Command; 2] {
    [
        tipwatch_analyze::cli::Cli::command(),
        tipwatch_live::cli::Cli::command(),
    ]
}

/// Writes `man/NAME.1` for every program and command, and `completions/SHELL/` for every program.
///
/// # Errors
/// A file cannot be written.
pub fn write(folder: &Path) -> Result<()> {
    let man = folder.join("man");
    fs::create_dir_all(&man).with_context(|| format!("{}: cannot create it", man.display()))?;
    for command in programs() {
        let name = command.get_name().to_string();
        clap_mangen::generate_to(command.clone(), &man)
            .with_context(|| format!("{}: cannot write there", man.display()))?;
        for shell in SHELLS {
            let place = folder.join("completions").join(shell.to_string());
            fs::create_dir_all(&place)
                .with_context(|| format!("{}: cannot create it", place.display()))?;
            clap_complete::generate_to(shell, &mut command.clone(), &name, &place)
                .with_context(|| format!("{}: cannot write there", place.display()))?;
        }
    }
    Ok(())
}
