//! The machine file of a command, and its impossible inertias.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use tipwatch_binding::MachineFile;

use super::exit::Usage;

/// The machine file of a command that needs one.
#[derive(Debug, Args)]
pub(super) struct MachineFileArgs {
    /// The machine file.
    #[arg(long)]
    machine: PathBuf,
    #[command(flatten)]
    inertias: InertiaArgs,
}

impl MachineFileArgs {
    pub(super) fn read(&self) -> Result<MachineFile> {
        self.inertias.read(&self.machine)
    }
}

/// The machine file of a command that is about a machine: by position or by name.
#[derive(Debug, Args)]
pub(super) struct MachineArg {
    /// The machine file.
    #[arg(value_name = "MACHINE", required_unless_present = "machine")]
    positional: Option<PathBuf>,
    /// The machine file, as in the other commands.
    #[arg(long, conflicts_with = "positional")]
    machine: Option<PathBuf>,
}

impl MachineArg {
    pub(super) fn path(&self) -> Result<&Path> {
        let given = self.positional.as_deref().or(self.machine.as_deref());
        given.ok_or_else(|| Usage("expected a machine file: --machine MACHINE").into())
    }
}

/// What a machine file is to forgive.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct InertiaArgs {
    /// Replace inertias of the URDF that no body can have, with their uncertainty, instead of refusing them; the same as
    /// `accept_inertias = true` in the machine file.
    #[arg(long)]
    pub(super) accept_inertias: bool,
}

impl InertiaArgs {
    pub(super) fn read(self, path: &Path) -> Result<MachineFile> {
        self.applied(MachineFile::read(path)?)
    }

    /// Reads a machine file for use with this URDF, if one is given.
    pub(super) fn read_with_urdf(self, path: &Path, urdf: Option<&Path>) -> Result<MachineFile> {
        let file = self.read(path)?;
        Ok(match urdf {
            Some(urdf) => file.with_urdf(urdf)?,
            None => file,
        })
    }

    pub(super) fn applied(self, file: MachineFile) -> Result<MachineFile> {
        Ok(match self.accept_inertias {
            true => file.accepting_inertias()?,
            false => file,
        })
    }
}
