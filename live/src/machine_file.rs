//! A machine file, its URDF, and the hash that both ends of a session compare.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use tipwatch_mechanics::MachineSpec;

use crate::fnv::Fnv;

/// A machine file as read.
#[derive(Debug, Clone)]
pub struct MachineFile {
    /// Where it is.
    pub path: PathBuf,
    /// What it says.
    pub spec: MachineSpec,
    text: String,
}

/// The text of a URDF and where it is from, for messages.
#[derive(Debug, Clone)]
pub struct Urdf {
    /// The file or topic.
    pub name: String,
    /// The text.
    pub text: String,
}

impl MachineFile {
    /// Reads a machine file.
    ///
    /// # Errors
    /// The file cannot be read, or is no machine file.
    pub fn read(path: &Path) -> Result<Self> {
        let text = read(path)?;
        let spec = MachineSpec::from_toml(&text, &path.display().to_string())?;
        Ok(Self {
            path: path.into(),
            spec,
            text,
        })
    }

    /// The URDF that the machine file names, else `other`; `None` where there is neither.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn urdf(&self, other: Option<&Path>) -> Result<Option<Urdf>> {
        let named = |name: &String| self.path.parent().unwrap_or(Path::new("")).join(name);
        let Some(path) = self
            .spec
            .urdf
            .as_ref()
            .map(named)
            .or_else(|| other.map(Path::to_path_buf))
        else {
            return Ok(None);
        };
        let text = read(&path).with_context(|| format!("{}: its URDF", self.path.display()))?;
        Ok(Some(Urdf {
            name: path.display().to_string(),
            text,
        }))
    }

    /// The hash of the machine file's text and the URDF's.
    #[must_use]
    pub fn hash(&self, urdf: &Urdf) -> u64 {
        Fnv::new()
            .bytes(self.text.as_bytes())
            .bytes(urdf.text.as_bytes())
            .finish()
    }
}

fn read(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).with_context(|| format!("{}: cannot be read", path.display()))
}
